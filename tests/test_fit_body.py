# SPDX-License-Identifier: Apache-2.0
"""`fit` gets to know the person in the first second, or says why it did not."""

import json
from dataclasses import replace

import numpy as np
import pytest

from kintrack.calibration.config import BodyConfig, BundleConfig, CalibrationConfig, MeetingConfig
from kintrack.calibration.measures import height
from kintrack.clothing import USUAL_M, dressed_human
from kintrack.commands.fit import said_of_body
from kintrack.fit import fit_sequence, load_person
from kintrack.result import Track
from kintrack.sequence import open_sequence
from kintrack.sequence.write import SequenceWriter

TALL = np.array([0.9, -0.4, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
RATE_HZ = 8.0
FRAMES = 12
"""The last three are the second second's."""
QUICK = BodyConfig(
    meeting=MeetingConfig(calibration=CalibrationConfig(frames=5, bundle=BundleConfig(rounds=12)))
)


def filmed(scene, folder, human, moves=1.0, frames=FRAMES):
    """Somebody who lifts and bends the arms."""
    writer = SequenceWriter(folder, scene.camera)
    for n in range(frames):
        pose = {"shoulder_elevation": 10 + 5.0 * moves * n, "elbow_flexion": 15 + 7.0 * moves * n}
        depth = scene.depth(scene.place(pose, heading_deg=2.0 * moves * n), human)
        writer.write(n / RATE_HZ, depth)
    return open_sequence(folder)


@pytest.fixture(scope="module")
def tall(scene, tmp_path_factory):
    return filmed(scene, tmp_path_factory.mktemp("tall") / "tall", dressed_human(TALL))


@pytest.fixture(scope="module")
def fitted(tall, tmp_path_factory):
    folder, reported = tmp_path_factory.mktemp("fit"), []
    fit_sequence(
        tall, folder, on_frame=lambda frame, result: reported.append(frame.index), body=QUICK
    )
    return folder, reported


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def test_the_person_is_calibrated_in_the_first_second(fitted):
    folder, reported = fitted
    body = summary_of(folder)["body"]
    assert body["used"] == "calibrated"
    (attempt,) = body["attempts"]
    assert attempt["frame"] == 8 and attempt["tracked_s"] == pytest.approx(1.0)
    assert abs(body["height_m"]["value_m"] - height(TALL)[0]) < 0.03
    assert reported == [*range(9), *range(FRAMES)]  # from the beginning, with her


def test_one_body_is_that_of_all_frames(fitted):
    human, _ = load_person(fitted[0])
    track = Track.load(fitted[0] / "track.npz")
    assert len(human.shape) == 10 and len(track) == FRAMES
    assert (track.status == "tracking").all()
    assert summary_of(fitted[0])["finished"] is True
    assert summary_of(fitted[0])["person"]["clothing_m"].keys() >= {"chest", "thigh"}


def test_what_was_estimated_is_said(fitted):
    said = said_of_body(summary_of(fitted[0])["body"])
    assert len(said) == 1 and said[0].startswith("calibrated after 1.0 s: height 1.")
    assert "±" in said[0] and "thigh" in said[0]


def test_the_same_recording_gives_the_same_bytes(fitted, tall, tmp_path):
    fit_sequence(tall, tmp_path, body=QUICK)
    first, again = (Track.load(folder / "track.npz") for folder in (fitted[0], tmp_path))
    assert first.q.tobytes() == again.q.tobytes()
    assert summary_of(tmp_path)["person"] == summary_of(fitted[0])["person"]


@pytest.mark.parametrize("stop_at", [4, 12])
def test_an_interrupt_leaves_a_valid_result_in_either_pass(tall, tmp_path, stop_at):
    """The thirteenth report is of frame 3 of the second pass."""
    reported = []

    def interrupt(frame, result):
        reported.append(frame.index)
        if len(reported) == stop_at + 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fit_sequence(tall, tmp_path, on_frame=interrupt, body=QUICK)
    track, summary = Track.load(tmp_path / "track.npz"), summary_of(tmp_path)
    assert len(track) == reported[-1] + 1 and summary["finished"] is False
    assert (track.status == "tracking").all()
    assert len(load_person(tmp_path)[0].shape) == (10 if stop_at > 9 else 3)


def test_the_template_stays_where_it_is_wanted(tall, tmp_path):
    fit_sequence(tall, tmp_path, body=BodyConfig("template"))
    summary = summary_of(tmp_path)
    assert summary["body"] == {"kind": "template", "used": "template", "attempts": []}
    assert len(summary["person"]["shape"]) == 3 and said_of_body(summary["body"]) == []
    assert summary["person"]["clothing_m"] == dict(USUAL_M)
    assert dict(load_person(tmp_path)[0].clothing_m) == dict(USUAL_M)


def test_who_stands_still_gets_a_body_too(scene, tmp_path):
    still = filmed(scene, tmp_path / "still", scene.human, moves=0.0, frames=10)
    fit_sequence(still, tmp_path / "result", body=QUICK)
    body = summary_of(tmp_path / "result")["body"]
    assert body["used"] == "calibrated" and len(body["attempts"]) == 1
    assert body["attempts"][0]["problems"] == []


def test_a_child_is_tracked_with_the_template_and_the_reason(scene, tmp_path):
    child = dressed_human(np.array([-4.2, 0.0]))
    filmed_child = filmed(scene, tmp_path / "child", child, frames=9)
    fit_sequence(filmed_child, tmp_path / "result", body=QUICK)
    summary = summary_of(tmp_path / "result")
    assert summary["body"]["used"] == "template"
    assert set(summary["status_counts"]) >= {"tracking"}
    said = said_of_body(summary["body"])
    assert said[0].startswith("estimated: height 1.") and "adults of 1.4 to 2.1 m" in said[1]


def test_a_height_that_the_frames_deny_is_named(tall, tmp_path):
    told = BodyConfig(height_m=1.45, meeting=replace(QUICK.meeting, attempts=1))
    fit_sequence(tall, tmp_path, body=told)
    body = summary_of(tmp_path)["body"]
    assert body["used"] == "template"
    assert (
        "a stated height of 1.45 m, where the frames say 1." in body["attempts"][0]["problems"][0]
    )

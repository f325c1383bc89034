# SPDX-License-Identifier: Apache-2.0
"""Many recordings labelled into one folder, each only once."""

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

import kintrack
from kintrack.errors import ConfigError, DatasetError, ResultError
from kintrack.geometry import PinholeCamera
from kintrack.labelling import several
from kintrack.labelling.keeping import KeepingConfig
from kintrack.labelling.opinions import LabellingConfig
from kintrack.labelling.sequence import Report
from kintrack.labelling.several import find_recordings, label_recordings, people_in
from kintrack.sequence import open_sequence
from kintrack.sequence.write import SequenceWriter

CAMERA = PinholeCamera(64, 48, 60.0, 60.0, 31.5, 23.5)


def record(folder, frames=4, person=True):
    writer = SequenceWriter(folder, CAMERA)
    for n in range(frames):
        depth = np.full((48, 64), 4.0, np.float32)
        if person:
            depth[10:40, 20:30] = 2.0
        writer.write(n / 10, depth)
    return folder


@pytest.fixture
def recordings(tmp_path):
    return [record(tmp_path / "mine" / name) for name in ("a", "b", "c")]


@pytest.fixture
def calls(monkeypatch):
    """Stands in for the tracker: every frame with something near is kept; what was labelled."""
    done = []

    def label(sequence, output, config, tracker, T, on_progress):
        done.append(sequence.name)
        frames = [frame for frame in sequence if (frame.depth_m < 3).any()]
        for n in range(len(sequence)):
            on_progress("labelling", n + 1, len(sequence))
        if not frames:
            raise ResultError(f"{sequence.root}: no frame is kept: not tracking (4 of 4 frames)")
        writer = SequenceWriter(output, sequence.camera)
        for frame in frames:
            writer.write(frame.timestamp_s, frame.depth_m, labels=np.uint8(frame.depth_m < 3))
        return Report([{"frame": n, "kept": True} for n in range(len(frames))])

    monkeypatch.setattr(several, "label_sequence", label)
    return done


def test_every_recording_gets_a_folder_of_its_kept_frames(recordings, tmp_path, calls):
    steps = []
    found = label_recordings(
        recordings, tmp_path / "labels", on_progress=lambda *s: steps.append(s)
    )
    assert [(one.name, one.frames, one.kept) for one in found] == [(n, 4, 4) for n in "abc"]
    for one in found:
        frames = list(open_sequence(tmp_path / "labels" / one.key))
        assert len(frames) == 4 and frames[0].labels.any()
    assert steps[-1] == ("labelling", 12, 12) and sorted(s[1] for s in steps) == [
        s[1] for s in steps
    ]
    assert not [path for path in (tmp_path / "labels").iterdir() if path.name.startswith(".")]


def test_a_second_run_labels_nothing_again(recordings, tmp_path, calls):
    first = label_recordings(recordings, tmp_path / "labels")
    assert label_recordings(recordings, tmp_path / "labels") == first
    assert calls == ["a", "b", "c"]


def test_what_has_changed_is_labelled_again(recordings, tmp_path, calls):
    label_recordings(recordings, tmp_path / "labels")
    shutil.rmtree(recordings[1])
    record(recordings[1], frames=6)
    found = label_recordings(recordings, tmp_path / "labels")
    assert found[1].kept == 6 and calls[3:] == ["b"]
    strict = LabellingConfig(keeping=KeepingConfig(max_limits=3))
    label_recordings(recordings, tmp_path / "labels", config=strict)
    assert calls[4:] == ["a", "b", "c"]


def test_labels_that_were_lost_are_made_again(recordings, tmp_path, calls):
    found = label_recordings(recordings, tmp_path / "labels")
    shutil.rmtree(tmp_path / "labels" / found[0].key)
    (tmp_path / "labels" / f"{found[2].key}.json").write_text('{"fingerprint": ')
    label_recordings(recordings, tmp_path / "labels")
    assert calls[3:] == ["a", "c"]


def test_a_stop_leaves_no_half_labelled_recording(recordings, tmp_path, calls, monkeypatch):
    whole = several.label_sequence

    def stopped(sequence, output, *rest, **more):
        whole(sequence, output, *rest, **more)
        if sequence.name == "b":
            raise KeyboardInterrupt
        return Report()

    monkeypatch.setattr(several, "label_sequence", stopped)
    with pytest.raises(KeyboardInterrupt):
        label_recordings(recordings, tmp_path / "labels")
    monkeypatch.setattr(several, "label_sequence", whole)
    shown = [path for path in (tmp_path / "labels").iterdir() if not path.name.startswith(".")]
    assert {path.name[0] for path in shown} == {"a"}
    assert label_recordings(recordings, tmp_path / "labels")[1].kept == 4


def test_one_with_nobody_in_view_is_passed_over_and_remembered(recordings, tmp_path, calls):
    shutil.rmtree(recordings[1])
    record(recordings[1], person=False)
    for _ in range(2):
        found = label_recordings(recordings, tmp_path / "labels")
        assert [one.kept for one in found] == [4, 0, 4]
        assert "no frame is kept: not tracking" in found[1].problem
    assert calls == ["a", "b", "c"]


def test_one_that_cannot_be_read_is_passed_over_but_tried_again(recordings, tmp_path, calls):
    camera = recordings[0] / "camera.json"
    content = camera.read_text()
    camera.write_text("{")
    found = label_recordings(recordings, tmp_path / "labels")
    assert (found[0].frames, found[0].kept) == (0, 0) and "camera.json" in found[0].problem
    camera.write_text(content)
    assert label_recordings(recordings, tmp_path / "labels")[0].kept == 4


def test_a_full_disk_is_not_remembered_as_a_verdict(recordings, tmp_path, calls, monkeypatch):
    whole = several.label_sequence

    def full(sequence, output, *rest, **more):
        output.mkdir(parents=True)
        raise ResultError(f"{output} cannot be written: no space left")

    monkeypatch.setattr(several, "label_sequence", full)
    assert "no space" in label_recordings(recordings[:1], tmp_path / "labels")[0].problem
    monkeypatch.setattr(several, "label_sequence", whole)
    assert label_recordings(recordings[:1], tmp_path / "labels")[0].kept == 4


def test_recordings_of_one_name_keep_apart(tmp_path, calls):
    pair = [record(tmp_path / person / "walk") for person in ("ann", "ben")]
    found = label_recordings(pair, tmp_path / "labels")
    assert [one.name for one in found] == ["ann/walk", "ben/walk"] and found[0].key != found[1].key


def test_recordings_are_found_below_folders_but_not_in_the_run_itself(recordings, tmp_path):
    run = record(tmp_path / "mine/run/labels/x").parents[1]
    azure = tmp_path / "mine/d"
    (azure / "depth").mkdir(parents=True)
    (azure / "intrinsic.json").write_text("{}")
    record(tmp_path / "mine/.old")
    assert find_recordings([tmp_path / "mine"], run) == [*recordings, azure]
    assert find_recordings([recordings[1], tmp_path / "mine"], run)[0] == recordings[1]
    assert len(find_recordings([recordings[1], tmp_path / "mine"], run)) == 4
    (tmp_path / "none").mkdir()
    with pytest.raises(DatasetError, match=r"none holds no recording.*depth.txt"):
        find_recordings([tmp_path / "none"])
    with pytest.raises(DatasetError, match="nowhere is no folder"):
        find_recordings([tmp_path / "nowhere"])


def test_people_are_told_by_their_paths(recordings):
    assert people_in(recordings, "") == {}
    assert list(people_in(recordings, r"mine/(\w)").values()) == ["a", "b", "c"]
    assert list(people_in(recordings, "mine").values()) == ["mine"] * 3
    with pytest.raises(ConfigError, match=r"'/\(a\|b\)\$' is not found in .*c \(1 of 3"):
        people_in(recordings, "/(a|b)$")
    with pytest.raises(ConfigError, match="no regular expression"):
        people_in(recordings, "(")


def test_the_tracker_labels_the_recording_that_ships(tmp_path, quick):
    """The whole way without a stand-in, in four frames of which one is broken."""
    demo = Path(kintrack.__file__).parent / "demo"
    root = tmp_path / "demo"
    (root / "depth").mkdir(parents=True)
    shutil.copy(demo / "camera.json", root)
    lines = [line for line in (demo / "depth.txt").read_text().splitlines() if line[0] != "#"][:4]
    (root / "depth.txt").write_text("\n".join(lines) + "\n")
    for line in lines:
        shutil.copy(demo / line.split()[1], root / "depth")
    cv2.imwrite(str(root / lines[2].split()[1]), np.zeros((3, 3), np.uint16))
    (one,) = label_recordings([root], tmp_path / "labels", tracker=quick)
    assert (one.frames, one.kept) == (4, 2) and one.reasons["not tracking"] == 1
    report = json.loads((tmp_path / "labels" / one.key / "labels.json").read_text())
    assert 2 in report["dropped"] and len(open_sequence(tmp_path / "labels" / one.key)) == 2

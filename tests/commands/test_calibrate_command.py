# SPDX-License-Identifier: Apache-2.0
import json
from dataclasses import replace

import numpy as np
import pytest

from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.measures import Length
from kintrack.calibration.person import Person, read_person
from kintrack.calibration.recording import calibrate_recording
from kintrack.commands import calibrate
from kintrack.commands.calibrate import Calibrate, report
from kintrack.fit import fit_sequence
from kintrack.human import load_human
from kintrack.joints import JOINT_NAMES
from kintrack.result import Track
from kintrack.sequence import open_sequence
from kintrack.sequence.write import SequenceWriter


@pytest.fixture(scope="module")
def recording(scene, tmp_path_factory):
    """A person of average shape who lifts and bends the arms."""
    folder = tmp_path_factory.mktemp("recording") / "person"
    writer = SequenceWriter(folder, scene.camera)
    for n in range(8):
        pose = {"shoulder_elevation": 8.0 * n, "elbow_flexion": 10.0 * n}
        writer.write(n / 30.0, scene.depth(scene.place(pose, heading_deg=3.0 * n)))
    return folder


def test_an_impossible_height_is_refused_before_the_recording_is_opened(tmp_path):
    with pytest.raises(CalibrationError, match=r"17.8 m: adults"):
        Calibrate(tmp_path / "nowhere", height_m=17.8).run()


def test_a_recording_becomes_a_person_and_a_model(recording, tmp_path, unsized, monkeypatch, scene):
    said = []
    monkeypatch.setattr(calibrate.console, "print", lambda *text, **_: said.append(str(text[0])))
    folder = tmp_path / "result"
    first = open_sequence(recording).frame(0)
    start = (replace(first, timestamp_s=-0.03), scene.joints(scene.place()))
    fit_sequence(open_sequence(recording), folder, unsized, begun=start)
    out = tmp_path / "new" / "person.json"
    Calibrate(recording, out, urdf=tmp_path / "model", track=folder, config=unsized).run()
    person = read_person(out)
    assert f"estimated: {person.describe()}" in said
    assert len(person.frames) == 8
    assert (load_human(tmp_path / "model").body.nv, len(person.shape)) == (48, 10)
    assert json.loads(out.read_text())["format"] == "kintrack person 1"


def test_a_recording_in_which_nobody_was_tracked_is_named(recording):
    sequence, human = open_sequence(recording), load_human()
    nobody = Track.from_frames(JOINT_NAMES, [])
    with pytest.raises(CalibrationError, match="nobody was tracked"):
        calibrate_recording(sequence, nobody, human)


def test_a_template_comes_with_what_was_estimated_and_why_it_is_not_used():
    said = []
    tall = Length(1.12, 0.02)
    child = Person(
        np.zeros(10), np.eye(10), {}, tall, {"thigh": Length(0.2, 0.01)}, (1, 2, 3), 0.1, 0.008,
        problems=("a height of 1.12 m; adults of 1.4 to 2.1 m are known",),
    )  # fmt: skip
    report(child, said.append)
    assert said[0].startswith("estimated: height 1.120 ± 0.020 m, thigh 20.0 ± 1.0 cm")
    assert said[1] == "not used: a height of 1.12 m; adults of 1.4 to 2.1 m are known"
    assert "average adult" in said[2]

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.calibration.calibrator import Calibrator
from kintrack.calibration.config import MeetingConfig
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.measures import LIMBS, Length, height
from kintrack.calibration.meeting import Meeting
from kintrack.calibration.person import Person
from kintrack.errors import ConfigError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.human import load_human
from kintrack.reporting import empty_result
from kintrack.sequence.frame import Frame

from .people import CAMERA, scene_of

TALL = (0.9, -0.6, 0.5, 0.4)
RATE_HZ = 5.0


@pytest.fixture(scope="module")
def tall():
    return scene_of(TALL)


@pytest.fixture(scope="module")
def template():
    return load_human()


def tracked(scene, human, n, at, status="tracking"):
    """Pose n of a scene as the frame `at` of a recording, and its result."""
    frame = Frame(at, at / RATE_HZ, CAMERA, scene.depths_m[n])
    state = run_kinematics(human.body, scene.qs_template[n])
    joints = transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), state.joint_positions_world)
    result = replace(
        empty_result(frame, human.body, status, 0.0),
        q=scene.qs_template[n],
        joint_positions_camera_m=joints,
        joint_visible=np.ones(len(joints)),
    )
    return frame, result, human


def alike(meeting, scene, human, frames, first=0):
    """Somebody who does not move."""
    return [meeting.see(*tracked(scene, human, 0, first + at)) for at in range(frames)]


def test_she_is_known_after_the_first_second(tall, template):
    meeting = Meeting()
    found = [meeting.see(*tracked(tall, template, n, n)) for n in range(6)]
    assert found[:5] == [None] * 5 and meeting.over
    person = found[5]
    assert person is not None and not person.is_template
    assert abs(person.height.value_m - height(tall.shape)[0]) < 0.02
    (attempt,) = meeting.attempts
    assert (attempt.frame, attempt.problems) == (5, ())
    assert attempt.tracked_s == pytest.approx(1.0)
    assert attempt.estimated == person.describe()
    assert meeting.see(*tracked(tall, template, 0, 6)) is None and meeting.conclude() is None


def test_who_is_in_doubt_is_asked_again_after_twice_as_long(tall, template, monkeypatch):
    asked = []

    def answer(self, limits):
        asked.append(len(self.candidates))
        return _person(("a height of 1.10 m",) if len(asked) == 1 else ())

    monkeypatch.setattr(Calibrator, "result", answer)
    meeting = Meeting()
    assert alike(meeting, tall, template, 10) == [None] * 10
    assert meeting.see(*tracked(tall, template, 4, 10)) is not None
    assert asked == [6, 11] and meeting.over


def test_who_stands_still_is_good_enough_to_be_tracked(tall, template):
    """One view of her, clothes included, is nearer to her than the average adult is."""
    meeting = Meeting()
    person = alike(meeting, tall, template, 6)[-1]
    assert person is not None and not person.is_template and person.spread_m < 0.001
    off = abs(person.height.value_m - height(tall.shape)[0])
    assert off < abs(height(np.zeros(1))[0] - height(tall.shape)[0])


def test_attempts_come_at_growing_intervals_and_end(tall, template, monkeypatch):
    monkeypatch.setattr(Calibrator, "result", lambda self, limits: _person(("a height of 1.10 m",)))
    meeting = Meeting(config=MeetingConfig(attempts=3))
    for at in range(40):
        assert meeting.see(*tracked(tall, template, at % 6, at)) is None
    assert [round(a.tracked_s, 1) for a in meeting.attempts] == [1.0, 2.0, 4.0]
    assert all(a.problems == ("a height of 1.10 m",) for a in meeting.attempts)
    assert meeting.over and meeting.conclude() is None and len(meeting.attempts) == 3


def test_only_frames_that_are_tracked_with_one_body_count(tall, template, monkeypatch):
    monkeypatch.setattr(Calibrator, "result", lambda self, limits: _person(()))
    meeting = Meeting()
    for at in range(12):
        meeting.see(*tracked(tall, template, at % 6, at, "lost" if at < 8 else "tracking"))
    assert not meeting.attempts  # eight of twelve frames were lost
    other = load_human(shape=np.array([0.5]))
    for at in range(12, 17):
        assert meeting.see(*tracked(tall, other, at % 6, at)) is None
    assert meeting.see(*tracked(tall, other, 5, 17)) is not None


def test_a_gap_is_not_time_tracked(tall, template, monkeypatch):
    monkeypatch.setattr(Calibrator, "result", lambda self, limits: _person(()))
    meeting = Meeting()
    for n, at in enumerate((0, 1, 50, 51, 100)):
        assert meeting.see(*tracked(tall, template, n, at)) is None
    assert not meeting.attempts


def test_a_recording_that_ends_too_soon_says_so(tall, template):
    meeting = Meeting()
    assert meeting.conclude() is None and not meeting.attempts  # nobody was there
    alike(meeting, tall, template, 3)
    assert meeting.conclude() is None
    assert meeting.attempts[0].problems == ("tracked for 0.4 s; 1 s are needed",)


def test_the_end_of_a_recording_is_the_last_chance(tall, template, monkeypatch):
    answers = [_person(("a height of 1.10 m",)), _person(())]
    monkeypatch.setattr(Calibrator, "result", lambda self, limits: answers.pop(0))
    meeting = Meeting()
    alike(meeting, tall, template, 6)
    assert meeting.conclude() is None and len(meeting.attempts) == 1  # nothing new since
    for n in range(1, 4):
        assert meeting.see(*tracked(tall, template, n, 5 + n)) is None
    assert meeting.conclude() is not None


def test_an_error_is_told_and_not_raised(tall, template, monkeypatch):
    def fail(self, limits):
        raise CalibrationError("the person is not where the track says")

    monkeypatch.setattr(Calibrator, "result", fail)
    meeting = Meeting()
    assert [meeting.see(*tracked(tall, template, n, n)) for n in range(6)] == [None] * 6
    assert meeting.attempts[0].problems == ("the person is not where the track says",)
    assert meeting.attempts[0].estimated == ""


@pytest.mark.parametrize("stated_m", [0.5, 17.8, float("nan")])
def test_an_impossible_height_is_refused_before_anybody_is_met(stated_m):
    with pytest.raises(CalibrationError, match=r"adults of 1.4 to 2.1 m"):
        Meeting(stated_height_m=stated_m)


@pytest.mark.parametrize("field", ["first_s", "growth", "attempts"])
def test_numbers_out_of_bounds_are_named(field):
    with pytest.raises(ConfigError, match=field):
        MeetingConfig(**{field: -1})


def _person(problems):
    limbs = dict.fromkeys(LIMBS, Length(0.3, 0.01))
    shape = np.zeros(10)
    return Person(shape, np.eye(10), {}, Length(1.7, 0.02), limbs, (0, 1, 2), 0.1, 0.01,
                  problems=problems)  # fmt: skip

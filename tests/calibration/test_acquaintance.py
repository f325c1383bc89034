# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.calibration import acquaintance
from kintrack.calibration.acquaintance import Acquaintance, Again
from kintrack.calibration.config import BodyConfig
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.measures import LIMBS, Length
from kintrack.calibration.meeting import Attempt, Meeting
from kintrack.calibration.person import Person
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.human import load_human
from kintrack.reporting import empty_result
from kintrack.segmenter import Region, Watched
from kintrack.sequence.frame import Frame

from .people import CAMERA

PERSON = Person(
    np.full(10, 0.1), np.eye(10), {"chest": 0.02}, Length(1.7, 0.02),
    dict.fromkeys(LIMBS, Length(0.3, 0.01)), (0, 1, 2), 0.1, 0.01,
)  # fmt: skip
NOBODY = replace(PERSON, shape=np.zeros(10), problems=("a height of 1.10 m",))


def frames(n, rms_m=0.010, status="tracking"):
    """Frame, result and human, as often as wanted."""
    human = load_human()
    for at in range(n):
        frame = Frame(at, at / 30.0, CAMERA, np.zeros((2, 2), dtype=np.float32))
        result = empty_result(frame, human.body, status, 0.0)
        yield frame, replace(result, residual_rms_m=rms_m), human, None


def acquainted(config=None, given=None):
    return Acquaintance(config or BodyConfig(), given, T_LEVEL_WORLD_CAMERA, TrackerConfig())


@pytest.fixture
def known_at_the_fifth(monkeypatch):
    """Every meeting knows her at the fifth frame."""
    seen = []

    def see(self, frame, result, human, labels):
        seen.append(frame.index)
        if len(seen) < 5:
            return None
        self.attempts.append(Attempt(frame.index, 1.0, PERSON.describe(), ()))
        return PERSON

    monkeypatch.setattr(Meeting, "see", see)


def met(rms_m=0.010):
    """Somebody who is known after five frames with this residual."""
    who = acquainted()
    with pytest.raises(Again):
        for frame in frames(5, rms_m):
            assert who.person is None
            who.see(*frame)
    return who


def test_once_she_is_known_the_recording_is_tracked_again_with_her(known_at_the_fifth):
    who = met()
    assert who.person is PERSON
    for frame in frames(9):
        who.see(*frame)
    who.conclude()
    told = who.told()
    assert (told["kind"], told["used"]) == ("calibrated", "calibrated")
    assert told["height_m"] == {"value_m": 1.7, "sigma_m": 0.02}
    assert told["limbs_m"]["thigh"]["value_m"] == 0.3
    assert told["attempts"][0]["estimated"] == PERSON.describe()


@pytest.mark.parametrize(
    ("rms_m", "status", "why"),
    [
        (0.012, "tracking", "the surface was 12.0 mm off, 10.0 mm with the template"),
        (0.010, "lost", "0 of 5 frames were tracked, 5 with the template"),
    ],
)
def test_a_body_that_tracks_worse_is_dropped(known_at_the_fifth, rms_m, status, why):
    who = met()
    with pytest.raises(Again):
        for frame in frames(5, rms_m, status):
            assert who.person is PERSON
            who.see(*frame)
    assert who.person is None
    for frame in frames(9):
        who.see(*frame)
    who.conclude()
    assert who.told()["used"] == "template" and who.told()["dropped"] == why


def test_who_is_known_at_the_end_is_tracked_with_too(monkeypatch):
    monkeypatch.setattr(Meeting, "see", lambda *_: None)
    monkeypatch.setattr(Meeting, "conclude", lambda _: PERSON)
    who = acquainted()
    for frame in frames(5):
        who.see(*frame)
    with pytest.raises(Again):
        who.conclude()
    for frame in frames(5):
        who.see(*frame)
    who.conclude()
    assert who.person is PERSON


def test_the_template_is_never_met(monkeypatch):
    monkeypatch.setattr(acquaintance, "Meeting", None)
    who = acquainted(BodyConfig("template"))
    for frame in frames(5):
        who.see(*frame)
    who.conclude()
    assert who.told() == {"kind": "template", "used": "template", "attempts": []}


def test_who_is_given_is_not_met_either(monkeypatch):
    monkeypatch.setattr(acquaintance, "Meeting", None)
    assert acquainted(given=PERSON).told()["used"] == "given"
    doubtful = acquainted(given=NOBODY)
    assert doubtful.person is None
    assert doubtful.told()["used"] == "the template in place of the person given"
    assert doubtful.told()["height_m"]["value_m"] == 1.7


def test_what_contradicts_itself_is_refused():
    with pytest.raises(CalibrationError, match="'template' has no use for a person"):
        acquainted(BodyConfig("template"), PERSON)
    with pytest.raises(CalibrationError, match="'template' has no use for a height of 1.8 m"):
        acquainted(BodyConfig("template", 1.8))
    with pytest.raises(CalibrationError, match="a height of 1.8 m belongs to the calibration"):
        acquainted(BodyConfig(height_m=1.8), PERSON)
    with pytest.raises(CalibrationError, match="adults of 1.4 to 2.1 m"):
        acquainted(BodyConfig(height_m=17.8))


def test_only_the_deformable_body_deforms():
    plain = TrackerConfig()
    assert BodyConfig("calibrated").applied(plain) == plain
    assert BodyConfig("template").applied(plain) == plain
    assert BodyConfig("deformable").applied(plain).deformation.enabled


def test_a_watched_segmenter_says_the_same_and_remembers_it():
    class Numbered:
        name = "numbered"

        def segment(self, frame, region=None):
            return np.full((16, 16), frame.index + (region is not None), dtype=np.uint8)

    watched = Watched(Numbered())
    assert watched.name == "numbered" and watched.last is None
    (first, *_), (second, *_) = frames(2)
    assert watched.segment(first).max() == 0 and watched.last.max() == 0
    assert watched.segment(second, Region((1.0, 1.0), 2.0)).max() == 2 and watched.last.max() == 2

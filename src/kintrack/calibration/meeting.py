# SPDX-License-Identifier: Apache-2.0
"""Getting to know a person while she is tracked: whose frames to keep, when to ask who she is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.calibration.calibrator import Calibrator, check_stated
from kintrack.calibration.config import MeetingConfig
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.person import Person
from kintrack.calibration.recording import person_in
from kintrack.calibration.verdict import ROUGH
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.human import Human
from kintrack.result import FrameResult
from kintrack.sequence.frame import Frame

LONGEST_STEP_S = 0.5
"""Two tracked frames further apart than this are not one stretch of tracking [s]."""


@dataclass(frozen=True)
class Attempt:
    """What one attempt found."""

    frame: int
    """The last frame it knew."""
    tracked_s: float
    """Time tracked until then [s]."""
    estimated: str
    """Height, limbs, and how sure they are; empty if nothing could be estimated."""
    problems: tuple[str, ...]
    """Why that is not used; empty if it is."""


class Meeting:
    """Collects the frames of one person until she is known, or it is given up."""

    def __init__(
        self,
        T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
        config: MeetingConfig | None = None,
        tracker: TrackerConfig | None = None,
        stated_height_m: float | None = None,
    ):
        """Set up a meeting with somebody not seen yet.

        Args:
            T_world_camera: Camera pose; a level camera if not given.
            config: When to ask.
            tracker: Association and pose priors.
            stated_height_m: Height of the person, if somebody knows it [m].

        Raises:
            CalibrationError: if nobody is as tall as stated.
        """
        self.T_world_camera = T_world_camera
        self.config = MeetingConfig() if config is None else config
        self.tracker = TrackerConfig() if tracker is None else tracker
        self.stated_height_m = stated_height_m
        self.attempts: list[Attempt] = []
        self._due_s = self.config.first_s
        self._tracked_s, self._last_s = 0.0, -np.inf
        self._calibrator: Calibrator | None = None
        check_stated(stated_height_m)

    @property
    def over(self) -> bool:
        """True once she is known, or was asked often enough."""
        known = bool(self.attempts) and not self.attempts[-1].problems
        return known or len(self.attempts) >= self.config.attempts

    def see(
        self,
        frame: Frame,
        result: FrameResult,
        human: Human,
        labels: UInt8[ndarray, "r c"] | None = None,
    ) -> Person | None:
        """Take what the tracker made of a frame.

        Args:
            frame: The frame.
            result: Its result; only a person who is tracked and seen counts.
            human: With whom it was tracked; if that changes, all begins anew.
            labels: The frame's labels, if it is labelled.

        Returns:
            The person, once she is known and believed; None until then.
        """
        if self.over or result.status != "tracking" or not result.joint_visible.any():
            return None
        if self._calibrator is None or self._calibrator.human.body is not human.body:
            self._begin_with(human)
        assert self._calibrator is not None
        since_s = frame.timestamp_s - self._last_s
        self._tracked_s += since_s if 0.0 < since_s < LONGEST_STEP_S else 0.0
        self._last_s = frame.timestamp_s
        seen = person_in(frame, result.q, human, self.T_world_camera, labels, self.tracker)
        self._calibrator.add(frame.index, seen, result.q, float(result.joint_visible.mean()))
        return self._ask(frame.index) if self._tracked_s >= self._due_s - 1e-6 else None

    def conclude(self) -> Person | None:
        """Ask once more, since the recording is at its end; None if she is not believed."""
        if self.over or self._calibrator is None:
            return None
        frame = self._calibrator.candidates[-1].index
        if self._tracked_s < self.config.first_s - 1e-6:
            said = f"tracked for {self._tracked_s:.1f} s; {self.config.first_s:g} s are needed"
            self.attempts.append(Attempt(frame, self._tracked_s, "", (said,)))
            return None
        return None if self.attempts and self.attempts[-1].frame == frame else self._ask(frame)

    def _begin_with(self, human: Human) -> None:
        """Forget all frames: another body's poses do not mix with this one's."""
        self._tracked_s, self._last_s = 0.0, -np.inf
        self._calibrator = Calibrator(
            human,
            self.T_world_camera,
            self.config.calibration,
            self.tracker,
            self.stated_height_m,
        )

    def _ask(self, frame: int) -> Person | None:
        """Make an attempt."""
        assert self._calibrator is not None
        self._due_s = self.config.growth * self._tracked_s
        try:
            person = self._calibrator.result(ROUGH)
        except CalibrationError as error:
            self.attempts.append(Attempt(frame, self._tracked_s, "", (str(error),)))
            return None
        said = person.describe()
        self.attempts.append(Attempt(frame, self._tracked_s, said, person.problems))
        if self.over:
            self._calibrator = None
        return None if person.is_template else person

# SPDX-License-Identifier: Apache-2.0
"""Whose body a recording is tracked with: given, the template's, or calibrated on the way."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.calibration.config import BodyConfig
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.meeting import Meeting
from kintrack.calibration.person import Person
from kintrack.config import TrackerConfig
from kintrack.human import Human
from kintrack.result import FrameResult
from kintrack.sequence.frame import Frame

LEAST_TRACKED = 0.95
"""A calibrated body that tracks a smaller share of the frames than the template is dropped."""
MOST_RESIDUAL = 1.1
"""So is one whose median residual is larger than the template's by this factor."""


class Again(Exception):
    """The recording is to be tracked again from its beginning, with another body."""


class Acquaintance:
    """What is known of the person while a recording is tracked once, or once more."""

    def __init__(
        self,
        config: BodyConfig,
        given: Person | None,
        T_world_camera: Float[ndarray, "4 4"],
        tracker: TrackerConfig,
    ):
        """Begin with what is given.

        Args:
            config: Which body.
            given: The person, if she is known.
            T_world_camera: Camera pose.
            tracker: Association and pose priors.

        Raises:
            CalibrationError: if a person or height is given that is of no use, or nobody is as tall
                as stated.
        """
        if config.kind == "template" and (given is not None or config.height_m is not None):
            what = "a person" if given is not None else f"a height of {config.height_m!r} m"
            raise CalibrationError(
                f"body 'template' has no use for {what}: calibrated or deformable has"
            )
        if given is not None and config.height_m is not None:
            raise CalibrationError(
                f"a height of {config.height_m!r} m belongs to the calibration; the person that is "
                "given has one already"
            )
        self.kind = config.kind
        self.person = None if given is None or given.is_template else given
        self.found: Person | None = None
        self._given = given
        self._meeting: Meeting | None = None
        if given is None and config.kind != "template":
            self._meeting = Meeting(T_world_camera, config.meeting, tracker, config.height_m)
        self._before: _Course | None = None
        self._course = _Course()
        self._dropped: str | None = None

    def see(
        self,
        frame: Frame,
        result: FrameResult,
        human: Human,
        labels: UInt8[ndarray, "r c"] | None,
    ) -> None:
        """Take a tracked frame.

        Raises:
            Again: if the body is another one from now on.
        """
        if self._meeting is None or self._dropped is not None:
            return
        if self.found is None:
            self._course.add(result)
            self._use(self._meeting.see(frame, result, human, labels))
        elif self._before is not None and len(self._course) < len(self._before):
            self._course.add(result)
            if len(self._course) == len(self._before):
                self._compare(self._before)

    def conclude(self) -> None:
        """The recording is at its end.

        Raises:
            Again: if the person is known only now.
        """
        if self._meeting is not None and self.found is None:
            self._use(self._meeting.conclude())

    def told(self) -> dict[str, Any]:
        """What a result's summary says of it, in JSON's types."""
        attempts = [] if self._meeting is None else [asdict(a) for a in self._meeting.attempts]
        who = self.person if self._given is None else self._given
        facts: dict[str, Any] = {"kind": self.kind, "used": self._used(), "attempts": attempts}
        if self._dropped is not None:
            facts["dropped"] = self._dropped
        if who is not None:
            facts |= {
                "height_m": who.height._asdict(),
                "limbs_m": {name: length._asdict() for name, length in who.limbs.items()},
            }
        return facts

    def _used(self) -> str:
        if self._given is not None:
            return "the template in place of the person given" if self.person is None else "given"
        return "template" if self.person is None else "calibrated"

    def _use(self, person: Person | None) -> None:
        """Track again with a person, if there is one."""
        if person is None:
            return
        self.found = self.person = person
        self._before, self._course = self._course, _Course()
        raise Again

    def _compare(self, before: _Course) -> None:
        """Keep the person only if she is followed as well as the template was."""
        self._dropped = self._course.worse_than(before)
        if self._dropped is not None:
            self.person = None
            raise Again


class _Course:
    """How tracking went."""

    def __init__(self) -> None:
        self._rms_m: list[float] = []

    def __len__(self) -> int:
        return len(self._rms_m)

    def add(self, result: FrameResult) -> None:
        """Count a frame."""
        tracked = result.status == "tracking"
        self._rms_m.append(result.residual_rms_m if tracked else np.nan)

    def worse_than(self, other: _Course) -> str | None:
        """Why it went worse; None if it did not."""
        rms, was = np.array(self._rms_m), np.array(other._rms_m)
        tracked, had = int(np.isfinite(rms).sum()), int(np.isfinite(was).sum())
        if tracked < LEAST_TRACKED * had:
            return f"{tracked} of {len(rms)} frames were tracked, {had} with the template"
        now_mm, then_mm = 1e3 * np.nanmedian(rms), 1e3 * np.nanmedian(was)
        if now_mm > MOST_RESIDUAL * then_mm:
            return f"the surface was {now_mm:.1f} mm off, {then_mm:.1f} mm with the template"
        return None

# SPDX-License-Identifier: Apache-2.0
"""A new track and its rival, who stands in the same place and faces the other way.

Front and back of a person look alike for one frame: a start that takes one for the other puts every
left joint where the right one is. Whoever is followed with the wrong side forward is followed worse
from frame to frame, since trunk, knees, elbows and feet bend and bulge the other way. So both are
followed for some frames, by the same labels, and the one whose skin fits better stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import KintrackError
from kintrack.joints import JOINT_NAMES
from kintrack.lifecycle import Reading
from kintrack.result import FrameResult
from kintrack.rival_config import RivalConfig
from kintrack.sequence.frame import Frame

if TYPE_CHECKING:
    from kintrack.tracker import Tracker

OTHER_SIDE = {"l": "r", "r": "l"}


class Verdict(NamedTuple):
    """What a duel says after a frame."""

    over: bool
    """Whether it is decided, or has lasted long enough."""
    turned: bool = False
    """Whether the rival stays."""


@dataclass
class Duel:
    """Both tracks of one person since the frame in which the first began."""

    rival: Tracker
    config: RivalConfig
    results: list[FrameResult]
    """The rival's, from that frame on."""
    doubts_m2: list[tuple[float, float]]
    """Of the track and of the rival in every frame in which both could be judged [m^2]."""

    @classmethod
    def between(
        cls, result: FrameResult, rival: Tracker, frame: Frame, config: RivalConfig
    ) -> Duel | None:
        """Let a rival begin where a track has begun.

        Args:
            result: First of the track.
            rival: A tracker that has seen nothing.
            frame: The frame.
            config: How long, and who wins.

        Returns:
            The duel; None if nobody can stand there the other way round.
        """
        try:
            first = rival.begin(frame, turned_round(result.joint_positions_camera_m))
        except KintrackError:
            return None
        return cls(rival, config, [first], []) if rival.tracks else None

    def step(self, frame: Frame, tracks: bool, reading: Reading | None) -> Verdict:
        """Let the rival take the frame that the track has just taken.

        Args:
            frame: The frame.
            tracks: Whether the track still has a pose.
            reading: What the frame said of it.
        """
        self.results.append(self.rival.step(frame))
        other, c = self.rival.reading, self.config
        if not (tracks and self.rival.tracks):
            return Verdict(True, self.rival.tracks and self._ahead())
        if reading is not None and other is not None:
            self.doubts_m2.append((self._doubt_m2(reading), self._doubt_m2(other)))
        late = len(self.results) > c.most_frames
        if len(self.doubts_m2) < c.least_frames:
            return Verdict(late)
        if self._ahead(c.wins_late if late else c.wins):
            return Verdict(True, True)
        return Verdict(late or not self._ahead(c.loses))

    def _ahead(self, factor: float = 1.0) -> bool:
        """Whether the rival's doubt is smaller than so many times the track's."""
        own, others = np.sum(self.doubts_m2, axis=0) if self.doubts_m2 else (0.0, 0.0)
        return bool(others < factor * own)

    def _doubt_m2(self, reading: Reading) -> float:
        """Mean square of how far surface and skin are apart, what is unexplained counted as far."""
        return reading.rms_m**2 + (1.0 - reading.explained) * self.config.unexplained_m**2


def turned_round(joints: Float[ndarray, "j 3"]) -> Float[ndarray, "j 3"]:
    """The joints of somebody who stands in the same pose facing the other way: sides swapped.

    Args:
        joints: One row per joint, order of `JOINT_NAMES`.
    """
    names = [OTHER_SIDE[n[0]] + n[1:] if n[1] == "_" else n for n in JOINT_NAMES]
    return joints[[JOINT_NAMES.index(name) for name in names]]

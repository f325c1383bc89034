# SPDX-License-Identifier: Apache-2.0
"""A track and its rivals: who faces the other way, and who stands on exchanged legs.

Front and back of a person look alike for one frame: a start that takes one for the other puts every
left joint where the right one is, and so does a track that loses somebody who turns. The legs of
somebody in profile are exchanged as easily. Whoever is followed with a wrong side is followed worse
from frame to frame, since trunk, knees, elbows and feet bend and bulge the other way, and crossed
legs end beside the feet that are seen. So all are followed for some frames, by the same labels, and
the one whose skin fits best stays: when a track begins, and when it becomes doubtful.
"""

from __future__ import annotations

import os
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
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

SIDE_BY_SIDE = 2
"""Threads in which rivals are followed beside the track."""
OTHER_SIDE = {"l": "r", "r": "l"}
BELOW_HIP = ("knee", "ankle", "foot")


class Challenge(NamedTuple):
    """Where a rival stands, and by how much he must be better."""

    joints_camera: Float[ndarray, "j 3"]
    """His joints [m], order of `JOINT_NAMES`."""
    wins: float
    """He stays if his doubt is smaller than the track's by this factor."""
    wins_late: float
    """The same once the duel is over, or the track is lost."""


def challenges(result: FrameResult, config: RivalConfig) -> list[Challenge]:
    """Who else could stand where somebody has been found.

    Args:
        result: Pose and what was seen of it.
        config: By how much they must be better.

    Returns:
        Somebody who faces the other way and, unless one of the legs is not seen at all, somebody
        whose legs are exchanged.
    """
    joints, seen = result.joint_positions_camera_m, result.joint_visible
    found = [Challenge(turned_round(joints), config.wins, config.wins_late)]
    legs = [[JOINT_NAMES.index(f"{side}_{name}") for name in BELOW_HIP] for side in "lr"]
    if all(seen[leg].max() >= config.legs_seen for leg in legs):
        found.append(Challenge(crossed_legs(joints), config.legs_win, config.legs_win))
    return found


class Verdict(NamedTuple):
    """What a duel says after a frame."""

    over: bool
    """Whether it is decided, or has lasted long enough."""
    won: bool = False
    """Whether the rival stays."""


@dataclass
class Duel:
    """Both tracks of one person since the frame in which the rival began."""

    rival: Tracker
    challenge: Challenge
    config: RivalConfig
    results: list[FrameResult]
    """The rival's, from that frame on."""
    doubts_m2: list[tuple[float, float]]
    """Of the track and of the rival in every frame in which both could be judged [m^2]."""

    @classmethod
    def begun(
        cls, rival: Tracker, challenge: Challenge, frame: Frame, config: RivalConfig
    ) -> Duel | None:
        """Let a rival begin.

        Args:
            rival: A tracker that has seen nothing.
            challenge: Where he stands.
            frame: The frame in which he does.
            config: How long, and who wins.

        Returns:
            The duel; None if nobody can stand there.
        """
        try:
            first = rival.begin(frame, challenge.joints_camera)
        except KintrackError:
            return None
        return cls(rival, challenge, config, [first], []) if rival.tracks else None

    def step(self, frame: Frame) -> None:
        """Let the rival take a frame, before, after or while the track does."""
        self.results.append(self.rival.step(frame))

    def verdict(self, tracks: bool, reading: Reading | None) -> Verdict:
        """What the frame that both have taken decides.

        Args:
            tracks: Whether the track still has a pose.
            reading: What the frame said of it.
        """
        other, c = self.rival.reading, self.config
        if not (tracks and self.rival.tracks):
            return Verdict(True, self.rival.tracks and self._ahead(self.challenge.wins_late))
        if reading is not None and other is not None:
            self.doubts_m2.append((doubt_m2(reading, c), doubt_m2(other, c)))
        late, judged = len(self.results) > c.most_frames, len(self.doubts_m2)
        if judged < c.least_frames:
            return Verdict(late or (judged >= c.early_frames and not self._ahead(c.loses_early)))
        if self._ahead(self.challenge.wins_late if late else self.challenge.wins):
            return Verdict(True, True)
        return Verdict(late or not self._ahead(c.loses))

    @property
    def advantage(self) -> float:
        """The track's doubt over the rival's; 1 before any frame could be judged."""
        own, others = np.sum(self.doubts_m2, axis=0) if self.doubts_m2 else (1.0, 1.0)
        return float(own / others)

    def _ahead(self, factor: float = 1.0) -> bool:
        """Whether the rival's doubt is smaller than so many times the track's."""
        return bool(self.doubts_m2) and factor * self.advantage > 1.0


@cache
def other_cores() -> ThreadPoolExecutor:
    """Threads for rivals; what they find does not depend on when they do."""
    return ThreadPoolExecutor(max_workers=SIDE_BY_SIDE, thread_name_prefix="kintrack-rival")


os.register_at_fork(after_in_child=other_cores.cache_clear)


class Vigil:
    """Watches one track, and says when it should be doubted."""

    def __init__(self, config: RivalConfig, trusted: bool = False):
        """Begin with a new track, which is to be doubted at once unless it is trusted."""
        self._config = config
        self._latest: deque[float] = deque(maxlen=config.smoothing_frames)
        self._past: deque[tuple[float, float]] = deque()
        self._last_s = -np.inf
        self._owed = not trusted

    def due(self, reading: Reading | None, timestamp_s: float) -> bool:
        """Whether a duel should begin: at first, while doubt has risen, and once it has calmed.

        Args:
            reading: What the frame said of the track; None in its first frame.
            timestamp_s: When [s].
        """
        if reading is not None:
            self._latest.append(doubt_m2(reading, self._config))
            self._past.append((timestamp_s, float(np.mean(self._latest))))
            while timestamp_s - self._past[0][0] > self._config.memory_s:
                self._past.popleft()
        least = min((doubt for _, doubt in self._past), default=np.inf)
        calm = not self._past or self._past[-1][1] <= self._config.alarm * least
        self._owed |= not calm
        if not self._owed or timestamp_s - self._last_s < self._config.again_s:
            return False
        self._last_s, self._owed = timestamp_s, not calm
        return True


def doubt_m2(reading: Reading, config: RivalConfig) -> float:
    """Mean square of how far surface and skin are apart, what is unexplained counted as far [m^2].

    Args:
        reading: What a frame says of a track.
        config: How far.
    """
    return reading.rms_m**2 + (1.0 - reading.explained) * config.unexplained_m**2


def turned_round(joints: Float[ndarray, "j 3"]) -> Float[ndarray, "j 3"]:
    """The joints of somebody who stands in the same pose facing the other way: sides swapped.

    Args:
        joints: One row per joint, order of `JOINT_NAMES`.
    """
    return _with_sides_swapped(joints, [name for name in JOINT_NAMES if name[1] == "_"])


def crossed_legs(joints: Float[ndarray, "j 3"]) -> Float[ndarray, "j 3"]:
    """The joints of somebody whose left leg is where the right one is, hips and the rest kept.

    Args:
        joints: One row per joint, order of `JOINT_NAMES`.
    """
    return _with_sides_swapped(joints, [f"{side}_{name}" for side in "lr" for name in BELOW_HIP])


def _with_sides_swapped(joints: Float[ndarray, "j 3"], which: list[str]) -> Float[ndarray, "j 3"]:
    names = [OTHER_SIDE[n[0]] + n[1:] if n in which else n for n in JOINT_NAMES]
    return joints[[JOINT_NAMES.index(name) for name in names]]

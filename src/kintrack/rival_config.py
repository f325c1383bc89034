# SPDX-License-Identifier: Apache-2.0
"""Every number of the duel between a track and its rival, with its unit."""

from __future__ import annotations

from dataclasses import dataclass

from kintrack.bounds import check_bounds


@dataclass(frozen=True)
class RivalConfig:
    """How long somebody who faces the other way is followed beside a track, and when."""

    least_frames: int = 8
    """Frames in which both are judged before one of them wins."""
    most_frames: int = 20
    """After so many frames it is over; 0 for no rival."""
    wins: float = 0.85
    """The rival stays if its doubt is smaller than the track's by this factor."""
    wins_late: float = 0.9
    """The same once it is over."""
    loses: float = 1.3
    """It goes if its doubt is larger by this factor."""
    unexplained_m: float = 0.025
    """How far off a point counts that the skin does not explain [m]."""

    alarm: float = 1.3
    """A track is suspected again once its doubt has risen by this factor; whoever turns looks odd
    while she does."""
    smoothing_frames: int = 10
    """Frames over which that doubt is averaged."""
    memory_s: float = 3.0
    """And time within which its least value is what it has risen from [s]."""
    again_s: float = 1.0
    """Least time from the beginning of one duel to that of the next [s]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            least_frames=(1, 10_000),
            most_frames=(0, 10_000),
            wins=(0.0, 1.0),
            wins_late=(0.0, 1.0),
            loses=(1.0, 1e6),
            unexplained_m=(0.0, 1.0),
            alarm=(1.0, 1e6),
            smoothing_frames=(1, 10_000),
            memory_s=(0.0, 1e4),
            again_s=(0.0, 1e6),
        )

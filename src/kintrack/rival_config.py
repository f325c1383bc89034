# SPDX-License-Identifier: Apache-2.0
"""Every number of the duels between a track and its rivals, with its unit."""

from __future__ import annotations

from dataclasses import dataclass

from kintrack.bounds import check_bounds


@dataclass(frozen=True)
class RivalConfig:
    """How long somebody with a side exchanged is followed beside a track, and when."""

    least_frames: int = 8
    """Frames in which both are judged before one of them wins."""
    most_frames: int = 20
    """After so many frames it is over; 0 for no rival."""
    wins: float = 0.85
    """Who faces the other way stays if his doubt is smaller than the track's by this factor."""
    wins_late: float = 0.9
    """The same once it is over, or the track is lost."""
    legs_win: float = 0.8
    """The same for exchanged legs, at any time: legs that nothing shows differ by chance."""
    legs_seen: float = 0.1
    """Share of the skin at a knee, an ankle or a foot of both legs that must be seen for them."""
    loses: float = 1.3
    """A rival goes if his doubt is larger by this factor."""
    early_frames: int = 3
    """Frames in which both are judged before a rival can be found hopeless."""
    loses_early: float = 1.6
    """He then goes if his doubt is larger by this factor."""
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
            legs_win=(0.0, 1.0),
            legs_seen=(0.0, 1.0),
            loses=(1.0, 1e6),
            early_frames=(1, 10_000),
            loses_early=(1.0, 1e6),
            unexplained_m=(0.0, 1.0),
            alarm=(1.0, 1e6),
            smoothing_frames=(1, 10_000),
            memory_s=(0.0, 1e4),
            again_s=(0.0, 1e6),
        )

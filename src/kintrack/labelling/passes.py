# SPDX-License-Identifier: Apache-2.0
"""The geometric tracker over a recording, forwards and then backwards in time.

Where the track started late, the way back reaches the frames before. Where both ways have a pose,
they are two opinions on one image: they part where the image alone does not settle the pose.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from jaxtyping import Float
from numpy import ndarray

from kintrack.belief import Belief
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.human import Human
from kintrack.result import FrameResult
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.tracker import Tracker


@dataclass(frozen=True)
class Passes:
    """What both ways through a recording gave."""

    human: Human
    """The person, sized at the start."""
    forward: tuple[FrameResult, ...]
    """Results in time order, N of them."""
    backward: tuple[FrameResult, ...]
    """Results of the way back, in time order too, N of them."""
    turned_at: int | None = None
    """Frame whose pose the way back was given, so that both ways agree by themselves there."""


def track_both_ways(
    sequence: SequenceReader,
    config: TrackerConfig | None = None,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    on_frame: Callable[[Frame, FrameResult], None] = lambda frame, result: None,
) -> Passes:
    """Track forwards, then backwards from the last frame that was tracked well.

    Args:
        sequence: The recording, with nothing in it but the person.
        config: The tracker; the defaults if None.
        T_world_camera: Camera pose.
        on_frame: Called after every frame of either way, 2 N times.

    Returns:
        Both ways; frames behind the last good one come from a fresh start of the way back.
    """
    tracker = Tracker(config, T_world_camera=T_world_camera)
    forward: list[FrameResult] = []
    last: tuple[int, Belief] | None = None
    for frame in sequence:
        forward.append(tracker.step(frame))
        if tracker.belief is not None and tracker.belief.misses == 0:
            last = frame.index, tracker.belief
        on_frame(frame, forward[-1])
    returning = Tracker(tracker.config, tracker.human, T_world_camera)
    backward: list[FrameResult] = []
    for index in reversed(range(len(sequence))):
        frame = sequence.frame(index)
        result = None
        if last is not None and index == last[0]:
            returning.belief = _mirrored(last[1])
            result = forward[index]
        else:
            result = returning.step(replace(frame, timestamp_s=-frame.timestamp_s))
        backward.append(replace(result, timestamp_s=frame.timestamp_s))
        on_frame(frame, backward[-1])
    turned_at = None if last is None else last[0]
    return Passes(returning.human, tuple(forward), tuple(reversed(backward)), turned_at)


def _mirrored(belief: Belief) -> Belief:
    """The belief for a clock that runs backwards."""
    return replace(belief, velocity=-belief.velocity, timestamp_s=-belief.timestamp_s)

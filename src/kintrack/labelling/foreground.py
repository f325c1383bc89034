# SPDX-License-Identifier: Apache-2.0
"""The one person in front of a room, as a mask for every frame.

Recordings whose background was taken out pass through. Otherwise floor and walls go first, then,
before a still camera, what each pixel reads while the person is elsewhere. What remains falls into
pieces that depth steps part; the person is the largest piece of a person's size (before a still
camera: the one that moves most) of the frame where that is clearest, followed from there through
time both ways. Known to fail where the person touches furniture that never shows without him, where
several people touch, and where a person never moves among person-sized things.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.errors import SequenceError
from kintrack.geometry import PinholeCamera
from kintrack.labelling.following import ForegroundConfig, Scene, sampled_depths
from kintrack.labelling.room import Plane, camera_is_still, on_planes, still_background
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.removed import background_removed

__all__ = ["Foreground", "ForegroundConfig", "find_foreground", "only_person"]


SURELY = 0.5
"""Share of the planes' tolerance within which a pixel never takes a label."""


@dataclass(frozen=True)
class Foreground:
    """A mask of the person for every frame of a recording."""

    kind: str
    """How it was found: `removed` (the recording has no background), `still` or `moving` camera."""
    factor: int
    """Every how many pixels of the image the masks have one."""
    size: tuple[int, int]
    """Rows and columns of the masks."""
    masks: tuple[ndarray | None, ...]
    """Packed bits of each frame; None where no person was found."""
    planes: tuple[tuple[Plane, ...], ...]
    """Floor and walls of each frame."""
    config: ForegroundConfig
    """What they were found with."""

    def of(self, frame: Frame) -> Bool[ndarray, "h w"]:
        """Pixels of a frame that may be the person, at the image's size."""
        assert frame.depth_m is not None
        read = frame.depth_m > 0
        if self.kind == "removed":
            return read
        small = self.small(frame.index)
        if small is None:
            return np.zeros(read.shape, dtype=bool)
        if self.factor == 1:
            return small & read
        return _enlarged(small, frame.depth_m, self.factor, self.config.edge_m) & read

    def small(self, index: int) -> Bool[ndarray, "h2 w2"] | None:
        """The mask of a frame at working resolution; None where there is no person."""
        packed = self.masks[index]
        if packed is None:
            return None
        return np.unpackbits(packed, count=self.size[0] * self.size[1]).reshape(self.size) > 0

    def room(self, frame: Frame) -> Bool[ndarray, "h w"]:
        """Pixels surely on the floor or a wall, at the image's size.

        Half the tolerance that found the person: a foot's rim comes back, the floor does not.
        """
        assert frame.depth_m is not None
        planes = self.planes[frame.index] if self.kind != "removed" else ()
        if not planes:
            return np.zeros(frame.depth_m.shape, dtype=bool)
        return on_planes(frame.camera.back_project(frame.depth_m), planes, self.config.room, SURELY)


@dataclass(frozen=True)
class _Alone:
    """A recording of which only the person is left."""

    sequence: SequenceReader
    foreground: Foreground
    name: str
    root: Path
    camera: PinholeCamera

    def __len__(self) -> int:
        return len(self.sequence)

    def __iter__(self) -> Iterator[Frame]:
        return map(self.frame, range(len(self)))

    def frame(self, index: int) -> Frame:
        """The frame with the depth of the person only."""
        frame = self.sequence.frame(index)
        if frame.depth_m is None or self.foreground.kind == "removed":
            return frame
        mask = self.foreground.of(frame)
        if not mask.any():
            return replace(frame, depth_m=None, problem="no person in view")
        return replace(frame, depth_m=np.where(mask, frame.depth_m, np.float32(0)))


def only_person(sequence: SequenceReader, foreground: Foreground) -> SequenceReader:
    """The recording with the depth of the person only; a frame without one has a problem."""
    alone = _Alone(sequence, foreground, sequence.name, sequence.root, sequence.camera)
    return cast(SequenceReader, alone)  # frozen, while the protocol's fields are settable


def find_foreground(
    sequence: SequenceReader,
    config: ForegroundConfig | None = None,
    empty_room: SequenceReader | None = None,
    on_frame: Callable[[], None] = lambda: None,
) -> Foreground:
    """Find the person in every frame.

    Args:
        sequence: The recording.
        config: What counts as a person and as the room; the defaults if None.
        empty_room: A recording of the same still camera with nobody in view.
        on_frame: Called after every frame.

    Returns:
        The masks.

    Raises:
        SequenceError: if no frame is readable, or the empty room has another camera.
    """
    config = ForegroundConfig() if config is None else config
    count = len(sequence)
    factor = -(-sequence.camera.width // config.max_width_px)
    camera = sequence.camera.scaled(factor)
    size = (camera.height, camera.width)
    sampled = sampled_depths(sequence, config.samples, factor)
    if not sampled:
        raise SequenceError(f"{sequence.root}: none of the frames looked at can be read")
    if empty_room is None and np.mean([background_removed(d) for d in sampled]) > 0.5:
        return Foreground("removed", factor, size, (None,) * count, ((),) * count, config)
    still = empty_room is not None or camera_is_still(sampled, config.room)
    background = None
    if empty_room is not None:
        if empty_room.camera != sequence.camera:
            raise SequenceError(f"{empty_room.root} has another camera than {sequence.root}")
        background = still_background(sampled_depths(empty_room, config.samples, factor))
    scene = Scene(sequence, config, camera, factor, still, background, sampled)
    masks, planes = scene.follow(on_frame)
    if still and empty_room is None:
        scene.learn(masks)
        masks, planes = scene.follow(lambda: None)
    packed = tuple(None if mask is None else np.packbits(mask) for mask in masks)
    kind = "still" if still else "moving"
    return Foreground(kind, factor, size, packed, planes, config)


def _enlarged(
    small: Bool[ndarray, "h2 w2"], depth_m: Float[ndarray, "h w"], factor: int, edge_m: float
) -> Bool[ndarray, "h w"]:
    """A mask at the image's size: pixels at the depth of the mask's pixel they belong to."""
    h, w = depth_m.shape
    thin = np.where(small, depth_m[::factor, ::factor], np.nan)
    out = np.zeros((h, w), dtype=bool)
    for dy in (0, 1):
        for dx in (0, 1):
            moved = np.full(thin.shape, np.nan)
            moved[: thin.shape[0] - dy, : thin.shape[1] - dx] = thin[dy:, dx:]
            wide = moved.repeat(factor, axis=0).repeat(factor, axis=1)[:h, :w]
            out |= np.abs(depth_m - wide) < edge_m
    return out

# SPDX-License-Identifier: Apache-2.0
"""The part of a depth image that may belong to the person, as points on a pixel grid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.association.labelling import labels_of_pixels, spread_labels
from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame

ROOM_SHARE = 0.5
"""A room was recorded if at least this share of the pixels has a reading, whosever it is."""


@dataclass(frozen=True)
class Observation:
    """Observed points at working resolution."""

    camera: PinholeCamera
    """Camera of the thinned grid."""
    points_camera: Float[ndarray, "h w 3"]
    """Point of every pixel, camera frame [m]; z = 0 where there is none."""
    region: Bool[ndarray, "h w"]
    """Pixels that may belong to the person."""
    has_background: bool = False
    """True if an empty pixel is the sensor's failure, not free space."""
    labels: UInt8[ndarray, "h w"] | None = None
    """Body part of every pixel, 0 = not the person or no reading; None without a segmenter."""
    second: UInt8[ndarray, "h w"] | None = None
    """What else a pixel's label might be, the same as it first was where that is beyond doubt; None
    if that is not known."""


def observe(
    frame: Frame,
    max_width_px: int,
    background_share: float = 0.1,
    labels: UInt8[ndarray, "*guess r c"] | None = None,
) -> Observation:
    """Back-project a frame, thinned to at most `max_width_px` columns.

    Args:
        frame: A good frame.
        max_width_px: Largest working width [px].
        background_share: A background is assumed if at least this share of the pixels has a reading
            that no label calls hers, or `ROOM_SHARE` has any.
        labels: Label map that covers the whole image, in any size, or two of them, see `Segmenter`;
            None if there is none.

    Returns:
        The observation; its region is every pixel with a reading, or, where there are labels,
        every one that a label calls a part of the person. If there is nothing behind her, what is
        left of a piece that is hers takes the label of what is nearest to it.
    """
    assert frame.depth_m is not None
    factor = -(-frame.camera.width // max_width_px)
    camera = frame.camera.scaled(factor)
    points = camera.back_project(frame.depth_m[::factor, ::factor])
    read = points[..., 2] > 0
    has_background = bool(read.mean() >= ROOM_SHARE)
    if labels is None:
        return Observation(camera, points, read, has_background)
    guesses = labels.reshape(-1, *labels.shape[-2:])
    part, *others = [labels_of_pixels(guess, points[..., 2]) for guess in guesses]
    # the far walls of a room, and what is too near, may have no reading
    has_background |= bool((read & (part == 0)).mean() >= background_share)
    if not has_background:
        part = spread_labels(part, points[..., 2])
    return Observation(camera, points, part > 0, has_background, part, *others)


def within(observation: Observation, box_camera: Float[ndarray, "2 3"]) -> Observation:
    """The observation restricted to points inside an axis-aligned box of the camera frame."""
    inside = _inside(observation.points_camera, observation.region, box_camera)
    return replace(observation, region=inside)


def box_around(vertices_camera: Float[ndarray, "v 3"], margin_m: float) -> Float[ndarray, "2 3"]:
    """Axis-aligned box around some vertices, grown by a margin; lower and upper corner [m]."""
    low, high = vertices_camera.min(axis=0), vertices_camera.max(axis=0)
    return np.stack([low - margin_m, high + margin_m])


@njit(cache=True, nogil=True)
def _inside(points, region, box):
    h, w = region.shape
    out = np.zeros((h, w), dtype=np.bool_)
    for i in range(h):
        for j in range(w):
            if not region[i, j]:
                continue
            inside = True
            for k in range(3):
                if points[i, j, k] < box[0, k] or points[i, j, k] > box[1, k]:
                    inside = False
            out[i, j] = inside
    return out

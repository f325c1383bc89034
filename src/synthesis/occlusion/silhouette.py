# SPDX-License-Identifier: Apache-2.0
"""Where the person is in a recording: a mask and a distance per frame."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame
from kintrack.sequence.removed import background_removed

LEAST_PIXELS = 50
"""Fewest pixels that make a person."""
NEAREST_PERCENTILE = 5.0
"""Which of the frames' distances counts as the person's nearest place."""


@dataclass(frozen=True)
class Silhouette:
    """The person of one frame."""

    mask: Bool[ndarray, "h w"]
    """True where the person is seen."""
    depth_m: Float[ndarray, "h w"]
    """Depth of the person [m]; where the sensor has no reading, the frame's median."""


def person_mask(frame: Frame) -> Bool[ndarray, "h w"]:
    """Pixels of the person: by true labels, or all readings where the background was removed.

    Args:
        frame: A good frame.

    Raises:
        SceneError: if there are neither labels nor an empty background.
    """
    assert frame.depth_m is not None
    if frame.labels is not None:
        height, width = frame.depth_m.shape
        return cv2.resize(frame.labels, (width, height), interpolation=cv2.INTER_NEAREST) > 0
    read = frame.depth_m > 0
    if not background_removed(frame.depth_m):
        raise SceneError(
            f"frame {frame.index} has a background ({100 * read.mean():.0f} % of its pixels have a "
            f"reading) and no labels, so the person is not known; write labels with "
            f"`kintrack label` first"
        )
    return read


def silhouette(frame: Frame, step: int = 1) -> Silhouette | None:
    """The person of a frame, every `step`-th pixel; None for a bad frame or without a person.

    Args:
        frame: The frame.
        step: Thinning along both axes.
    """
    if frame.depth_m is None:
        return None
    mask = person_mask(frame)[::step, ::step]
    depth = np.asarray(frame.depth_m[::step, ::step], dtype=float)
    read = mask & (depth > 0)
    if read.sum() * step**2 < LEAST_PIXELS:
        return None
    return Silhouette(mask, np.where(depth > 0, depth, np.median(depth[read])))


def nearest_m(silhouettes: Iterable[Silhouette]) -> float:
    """How near the person comes [m]: low percentile over frames of the median depth.

    Raises:
        SceneError: if nobody is in any frame.
    """
    medians = [float(np.median(s.depth_m[s.mask])) for s in silhouettes]
    if not medians:
        raise SceneError("no person in any frame; somebody must be in the image")
    return float(np.percentile(medians, NEAREST_PERCENTILE))


def hidden_share(person: Silhouette, other_m: Float[ndarray, "h w"]) -> float:
    """Share of the person's pixels with something nearer before them, 0..1.

    Args:
        person: The person.
        other_m: Depth of what may hide her [m], 0 = nothing, same shape.
    """
    hidden = (other_m > 0) & (other_m < person.depth_m)
    return float(hidden[person.mask].mean())


def hidden_joints(
    joints_camera: Float[ndarray, "j 3"], camera: PinholeCamera, other_m: Float[ndarray, "h w"]
) -> Bool[ndarray, " j"]:
    """Which joint centres lie behind something else; those outside the image do not.

    Args:
        joints_camera: Joint centres [m], shape (J, 3); NaN for unknown ones.
        camera: Camera of `other_m`.
        other_m: Depth of what may hide them [m], 0 = nothing.
    """
    out = np.zeros(len(joints_camera), dtype=bool)
    for j, joint in enumerate(joints_camera):
        if not (np.isfinite(joint).all() and joint[2] > 0):
            continue
        u, v = np.rint(camera.project(joint)).astype(int)
        if 0 <= u < camera.width and 0 <= v < camera.height:
            out[j] = 0 < other_m[v, u] < joint[2]
    return out

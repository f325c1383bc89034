# SPDX-License-Identifier: Apache-2.0
"""What one fitted frame shows for and against itself; `keeping.py` decides upon these numbers."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.body import Body
from kintrack.geometry import PinholeCamera
from kintrack.labelling.transfer import Transfer

SILHOUETTE_M = 0.03
"""Skin this far beside the labelled pixels is no evidence of a misfit [m]."""
PAST_M = 0.10
"""The camera looks past skin that lies this much nearer than what it sees [m]."""
AT_LIMIT_RAD = 0.01
"""A hinge this close to its limit counts as stopped by it [rad]."""


@dataclass(frozen=True)
class Coverage:
    """How the image and the skin explain each other, both ways."""

    person_px: int
    """Labelled pixels."""
    explained: float
    """Share of the foreground pixels near the skin, 0 to 1."""
    unexplained_m2: float
    """Area of the largest connected patch of foreground far from the skin [m^2]."""
    supported: float
    """Share of the visible skin that has labelled pixels at it, 0 to 1."""
    unsupported_m2: float
    """Area of the largest connected patch of skin that the camera looks past [m^2]."""
    hidden: float
    """Share of the visible skin with something nearer in front of it, 0 to 1."""
    unread: float
    """Share of the visible skin where the sensor failed, 0 to 1."""


def coverage(
    transfer: Transfer,
    depth_m: Float[ndarray, "h w"],
    foreground: Bool[ndarray, "h w"],
    camera: PinholeCamera,
    empty_is_free: bool,
) -> Coverage:
    """Compare labels, skin and depth of a frame.

    Args:
        transfer: Labels and the skin they come from.
        depth_m: The whole depth image [m], shape (H, W).
        foreground: Pixels that may well be the person.
        camera: Camera of the depth image.
        empty_is_free: True if the background was taken out of the recording, so that a pixel
            without reading is free space and not the sensor's failure.

    Returns:
        Shares and areas; areas are those of the surface as if it faced the camera.
    """
    depth = np.asarray(depth_m, dtype=float)
    labelled = transfer.labels > 0
    skin_z = transfer.skin.points_camera[..., 2]
    painted = skin_z > 0
    beside = cv2.distanceTransform((~labelled).astype(np.uint8), cv2.DIST_L2, 5)
    apart = painted & (beside * skin_z / camera.fx > SILHOUETTE_M)
    read = depth > 0
    past = apart & np.where(read, depth > skin_z + PAST_M, empty_is_free)
    covered = painted & read & (depth < skin_z - PAST_M) & ~labelled
    known = painted & (read | empty_is_free)
    pixel_m2 = 1.0 / (camera.fx * camera.fy)
    lost = foreground & ~transfer.explained
    return Coverage(
        person_px=int(labelled.sum()),
        explained=1.0 - _share(lost, foreground),
        unexplained_m2=_largest(lost, depth**2 * pixel_m2),
        supported=1.0 - _share(apart & known, known),
        unsupported_m2=_largest(past, skin_z**2 * pixel_m2),
        hidden=_share(covered, painted),
        unread=_share(painted & ~known & apart, painted),
    )


def hinges_at_limit(body: Body, q: Float[ndarray, " nq"]) -> int:
    """How many hinges that can move both ways are stopped by a limit."""
    lower, upper = body.lower[6:], body.upper[6:]
    stopped = (q[7:] < lower + AT_LIMIT_RAD) | (q[7:] > upper - AT_LIMIT_RAD)
    return int(np.count_nonzero(stopped))


def share_outside(vertices_camera: Float[ndarray, "v 3"], camera: PinholeCamera) -> float:
    """Share of the skin's vertices that lie outside the image, 0 to 1."""
    before = vertices_camera[:, 2] > 0.05
    u, v = camera.project(np.where(before[:, None], vertices_camera, 1.0)).T
    inside = before & (u >= 0) & (v >= 0) & (u <= camera.width - 1) & (v <= camera.height - 1)
    return 1.0 - float(inside.mean())


def _share(part: Bool[ndarray, "h w"], whole: Bool[ndarray, "h w"]) -> float:
    return int(np.count_nonzero(part)) / max(int(np.count_nonzero(whole)), 1)


def _largest(mask: Bool[ndarray, "h w"], area_m2: Float[ndarray, "h w"]) -> float:
    """Area of the largest 8-connected patch [m^2]; 0 if there is none."""
    count, patch = cv2.connectedComponents(mask.astype(np.uint8), connectivity=8)
    if count < 2:
        return 0.0
    return float(np.bincount(patch[mask], weights=area_m2[mask], minlength=count)[1:].max())

# SPDX-License-Identifier: Apache-2.0
"""From a fitted skin to a label for every pixel [Wan19, 7].

A pixel takes the label of the nearest place of the visible skin, if that place is near enough. The
visible skin is the skin rasterised at the image's own resolution, so it is as dense as the pixels
and holds no far side; it is searched in the window of pixels in which a near place must lie.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.geometry import LABELS, PinholeCamera
from kintrack.raster import rasterise
from kintrack.skin import Skin, vertex_normals

NOISE_PER_M = 1.425e-3
"""Standard deviation of a Kinect v1's depth over the squared depth [1/m] (Khoshelham & Elberink,
Sensors 12(2), 2012); also covers the steps of its disparity and is generous to better cameras."""


@dataclass(frozen=True)
class TransferConfig:
    """Which pixels are the person's."""

    outside_m: float = 0.07
    """How far outside the skin a pixel may lie: clothes and hair [m]."""
    inside_m: float = 0.04
    """How far inside the skin a pixel may lie: the fit's own error [m]."""
    room_m: float = 0.025
    """The same, both ways, for pixels that the removal of the room took away [m]: soles and what
    touches furniture come back, the floor around a foot does not."""
    noise_sigmas: float = 2.0
    """Standard deviations of depth noise that are added to each of these."""
    hole_agreement: float = 0.6
    """Share of the labelled pixels around a hole that must have the skin's label there."""
    hole_support: float = 0.5
    """Share of the pixels around a hole that must be labelled."""
    hole_radius_px: int = 3
    """Half width of the window around a hole [px]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            outside_m=(0, 10),
            inside_m=(0, 10),
            room_m=(0, 10),
            noise_sigmas=(0, 10),
            hole_agreement=(0.01, 1),
            hole_support=(0.01, 1),
            hole_radius_px=(0, 20),
        )


@dataclass(frozen=True)
class VisibleSkin:
    """The skin as an image."""

    points_camera: Float[ndarray, "h w 3"]
    """Place on the skin that the pixel sees, camera frame [m]; z = 0 where it sees none."""
    normals_camera: Float[ndarray, "h w 3"]
    """Outward unit normal there."""
    labels: UInt8[ndarray, "h w"]
    """Body part there; 0 where there is none."""


@dataclass(frozen=True)
class Transfer:
    """Labels of a frame, with what the drop rule asks."""

    labels: UInt8[ndarray, "h w"]
    """Part of every pixel, 0 = background."""
    skin: VisibleSkin
    """The skin they were taken from."""
    explained: Bool[ndarray, "h w"]
    """Foreground pixels that lie near the skin."""


def visible_skin(
    skin: Skin, vertices_camera: Float[ndarray, "v 3"], camera: PinholeCamera
) -> VisibleSkin:
    """Rasterise the skin with places, normals and labels.

    Args:
        skin: Faces and labels.
        vertices_camera: Its vertices, camera frame [m], shape (V, 3).
        camera: Camera of the depth image.

    Returns:
        Images of the camera's size; a pixel's label is that of the face's nearest corner.
    """
    depth, face = rasterise(np.ascontiguousarray(vertices_camera), skin.faces, camera)
    points = camera.back_project(np.where(face >= 0, depth, 0.0))
    normals = vertex_normals(vertices_camera, skin.faces)
    labels, at_pixel = _painted(points, face, skin.faces, vertices_camera, normals, skin.labels)
    return VisibleSkin(points, at_pixel, labels)


def transfer_labels(
    depth_m: Float[ndarray, "h w"],
    foreground: Bool[ndarray, "h w"],
    room: Bool[ndarray, "h w"],
    skin: VisibleSkin,
    camera: PinholeCamera,
    config: TransferConfig,
) -> Transfer:
    """Label every pixel of a depth image by a fitted skin.

    Args:
        depth_m: The whole depth image [m], 0 = no reading, shape (H, W).
        foreground: Pixels that may well be the person.
        room: Pixels that lie on the floor or a wall and never take a label.
        skin: The fitted skin seen by the same camera.
        camera: Camera of the depth image.
        config: Tolerances.

    Returns:
        The labels, and which of the foreground the skin explains.
    """
    labels = _nearest(
        np.asarray(depth_m, dtype=np.float64),
        foreground,
        room,
        skin.points_camera,
        skin.normals_camera,
        skin.labels,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        config.outside_m,
        config.inside_m,
        config.room_m,
        config.noise_sigmas * NOISE_PER_M,
    )
    explained = (labels > 0) & foreground
    if config.hole_radius_px:
        labels = _filled(
            labels,
            np.asarray(depth_m) > 0,
            skin.labels,
            config.hole_radius_px,
            config.hole_agreement,
            config.hole_support,
            len(LABELS),
        )
    return Transfer(labels, skin, explained)


@njit(cache=True)
def _painted(points, face, faces, vertices, normals, labels):
    h, w = face.shape
    out = np.zeros((h, w), dtype=np.uint8)
    normal = np.zeros((h, w, 3))
    for i in range(h):
        for j in range(w):
            f = face[i, j]
            if f < 0:
                continue
            best = np.inf
            for k in faces[f]:
                d = 0.0
                for c in range(3):
                    d += (vertices[k, c] - points[i, j, c]) ** 2
                if d < best:
                    best = d
                    out[i, j] = labels[k]
                    normal[i, j] = normals[k]
    return out, normal


@njit(cache=True)
def _nearest(
    depth, foreground, room, skin, normals, painted, fx, fy, cx, cy, outside, inside, near, noise
):
    """Label of the nearest skin pixel in 3-D; a window is searched in growing rings."""
    h, w = depth.shape
    out = np.zeros((h, w), dtype=np.uint8)
    for i in range(h):
        for j in range(w):
            z = depth[i, j]
            if z <= 0.0 or room[i, j]:
                continue
            sigma = noise * z * z
            tall = near if not foreground[i, j] else outside
            deep = near if not foreground[i, j] else inside
            reach = max(tall, deep) + sigma
            x, y = (j - cx) / fx * z, (i - cy) / fy * z
            half = int(np.ceil(reach * max(fx, fy) / z))
            best = reach * reach
            bi, bj = -1, -1
            for r in range(half + 1):
                if (r - 1) * z / max(fx, fy) * 0.8 > np.sqrt(best):
                    break
                step = 1 if r < 6 else 2
                if r > 6 and r % 2:
                    continue
                for a in range(i - r, i + r + 1):
                    if a < 0 or a >= h:
                        continue
                    edge = a == i - r or a == i + r
                    stride = step if edge else 2 * r
                    if stride == 0:
                        stride = 1
                    for b in range(j - r, j + r + 1, stride):
                        if b < 0 or b >= w or painted[a, b] == 0:
                            continue
                        d = (
                            (skin[a, b, 0] - x) ** 2
                            + (skin[a, b, 1] - y) ** 2
                            + (skin[a, b, 2] - z) ** 2
                        )
                        if d < best:
                            best, bi, bj = d, a, b
            if bi < 0:
                continue
            s = (
                normals[bi, bj, 0] * (x - skin[bi, bj, 0])
                + normals[bi, bj, 1] * (y - skin[bi, bj, 1])
                + normals[bi, bj, 2] * (z - skin[bi, bj, 2])
            )
            if np.sqrt(best) <= (tall if s >= 0.0 else deep) + sigma:
                out[i, j] = painted[bi, bj]
    return out


@njit(cache=True)
def _filled(labels, read, painted, radius, agreement, support, count):
    h, w = labels.shape
    out = labels.copy()
    votes = np.zeros(count)
    for i in range(h):
        for j in range(w):
            if read[i, j] or painted[i, j] == 0:
                continue
            votes[:] = 0.0
            total = 0
            for a in range(max(0, i - radius), min(h, i + radius + 1)):
                for b in range(max(0, j - radius), min(w, j + radius + 1)):
                    votes[labels[a, b]] += 1.0
                    total += 1
            labelled = total - votes[0]
            if labelled >= support * total and votes[painted[i, j]] >= agreement * labelled:
                out[i, j] = painted[i, j]
    return out

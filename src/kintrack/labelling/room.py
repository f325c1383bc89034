# SPDX-License-Identifier: Apache-2.0
"""What of a depth image is the room: its floor and walls, and the background of a still camera."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.geometry import PinholeCamera
from kintrack.labelling.transfer import NOISE_PER_M


@dataclass(frozen=True)
class RoomConfig:
    """What counts as the room."""

    plane_m: float = 0.02
    """Points this near a plane belong to it [m]; twice the depth noise is added."""
    min_plane_m2: float = 0.8
    """Least surface of a floor or wall in view [m^2]; a person shows as much, but not flat."""
    min_share: float = 0.05
    """Least share of the readings on a floor or wall; what is seen edge on has less."""
    max_beyond: float = 0.1
    """Largest share of the image behind a floor or wall, as through a door; a table has more."""
    min_distance_m: float = 0.6
    """Least distance of the camera from a floor or wall [m]; nearer planes are seen edge on and
    found by chance."""
    planes: int = 4
    """Most planes looked for."""
    trials: int = 300
    """Random triples of points tried for each plane."""
    margin_m: float = 0.05
    """Least distance before the still background [m]; three times the depth noise is added."""
    still_share: float = 0.5
    """Share of the pixels that must keep their depth for the camera to count as still."""
    seed: int = 0
    """Seed of the random triples."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            planes=(0, 20),
            trials=(0, 10_000),
            seed=(0, 2**32 - 1),
            **dict.fromkeys(("plane_m", "min_plane_m2", "min_distance_m", "margin_m"), (1e-4, 100)),
            **dict.fromkeys(("max_beyond", "still_share", "min_share"), (0, 1)),
        )


@dataclass(frozen=True)
class Plane:
    """A flat part of the room, n . p = offset, with the camera on the side of larger values."""

    normal_camera: Float[ndarray, " 3"]
    """Unit normal towards the camera."""
    offset_m: float
    """n . p of its points [m], not above 0."""

    def height(self, points_camera: Float[ndarray, "*n 3"]) -> Float[ndarray, " *n"]:
        """Distance of points from the plane, positive on the camera's side [m]."""
        return points_camera @ self.normal_camera - self.offset_m


def room_planes(
    points_camera: Float[ndarray, "h w 3"], camera: PinholeCamera, config: RoomConfig
) -> tuple[Plane, ...]:
    """Floor and walls by RANSAC (Fischler & Bolles 1981), largest surface first.

    A plane counts if it shows enough surface and hardly anything lies behind it.

    Args:
        points_camera: Points, camera frame [m], z = 0 where there is none.
        camera: Camera of the points' grid.
        config: What counts as a plane of the room.

    Returns:
        At most `config.planes` planes; the same for the same points.
    """
    rng = np.random.default_rng(config.seed)
    points = points_camera[points_camera[..., 2] > 0]
    points = points[:: max(1, len(points) // 6000)]
    if len(points) == 0:
        return ()
    whole = np.count_nonzero(points_camera[..., 2]) / len(points) / (camera.fx * camera.fy)
    left = np.ones(len(points), dtype=bool)
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    tolerance = config.plane_m + 2 * NOISE_PER_M * points[:, 2] ** 2
    found: list[Plane] = []
    for _ in range(config.planes):
        best, most = None, config.min_plane_m2
        index = np.flatnonzero(left)
        if len(index) < 50:
            break
        few = index[:: max(1, len(index) // 1200)]
        for triple in points[rng.choice(index, (config.trials, 3))]:
            plane = _through(triple)
            if plane is None or plane.offset_m > -config.min_distance_m:
                continue
            near = np.abs(plane.height(points[few])) < tolerance[few]
            facing = np.abs(rays[few][near] @ plane.normal_camera)
            area = whole * len(index) / len(few)
            area *= float((points[few][near, 2] ** 2 / np.maximum(facing, 0.2)).sum())
            if near.sum() * len(index) < config.min_share * len(points) * len(few):
                continue
            if area > most and _bounds(plane, points, tolerance, config):
                best, most = plane, area
        if best is None:
            break
        best = _refined(best, points[left], tolerance[left])
        found.append(best)
        left &= best.height(points) > tolerance
    return tuple(found)


def on_planes(
    points_camera: Float[ndarray, "h w 3"],
    planes: Sequence[Plane],
    config: RoomConfig,
    strictness: float = 1.0,
) -> Bool[ndarray, "h w"]:
    """Pixels on or behind one of the planes; a strictness of 0.5 halves the tolerance."""
    z = points_camera[..., 2]
    tolerance = strictness * (config.plane_m + 2 * NOISE_PER_M * z**2)
    out = np.zeros(z.shape, dtype=bool)
    for plane in planes:
        out |= plane.height(points_camera) < tolerance
    return out & (z > 0)


def still_background(
    depths_m: Iterable[Float[ndarray, "h w"]],
) -> Float[ndarray, "h w"]:
    """Far side of what each pixel reads over time: its 90th percentile [m], 0 where it never does.

    Args:
        depths_m: Depth images of a still camera [m]; where something is known to be no background,
            0 as for no reading.
    """
    stack = np.stack([np.where(depth > 0, depth, np.nan) for depth in depths_m]).astype(np.float32)
    count = np.isfinite(stack).sum(axis=0)
    ordered = np.sort(stack, axis=0)  # NaN last
    place = np.clip(np.ceil(0.9 * count) - 1, 0, None).astype(int)
    far = np.take_along_axis(ordered, place[None], axis=0)[0]
    return np.where(count >= 1, far, 0.0)


def camera_is_still(depths_m: Sequence[Float[ndarray, "h w"]], config: RoomConfig) -> bool:
    """True if most pixels keep their depth over the recording, edges of things included.

    Args:
        depths_m: A few depth images over the whole recording [m].
        config: Which share of the pixels.
    """
    stack = np.stack(depths_m).astype(np.float32)
    stack[stack <= 0] = np.nan
    seen = np.isfinite(stack).mean(axis=0) >= 0.6
    if np.count_nonzero(seen) == 0:
        return False
    middle = np.nanmedian(stack[:, seen], axis=0)
    kept = np.abs(stack[:, seen] - middle) < 0.02 + 3 * NOISE_PER_M * middle**2
    return bool((kept.sum(axis=0) >= 0.8 * np.isfinite(stack[:, seen]).sum(axis=0)).mean()
                >= config.still_share)  # fmt: skip


def _through(triple: Float[ndarray, "3 3"]) -> Plane | None:
    normal = np.cross(triple[1] - triple[0], triple[2] - triple[0])
    length = float(np.linalg.norm(normal))
    if length < 1e-3:
        return None
    normal /= length
    offset = float(normal @ triple[0])
    return Plane(normal, offset) if offset <= 0 else Plane(-normal, -offset)


def _bounds(plane: Plane, points: ndarray, tolerance: ndarray, config: RoomConfig) -> bool:
    return bool((plane.height(points) < -0.1 - tolerance).mean() <= config.max_beyond)


def _refined(plane: Plane, points: ndarray, tolerance: ndarray) -> Plane:
    """Least squares through the plane's points, twice."""
    for _ in range(2):
        near = points[np.abs(plane.height(points)) < tolerance]
        centre = near.mean(axis=0)
        normal = np.linalg.eigh(np.cov((near - centre).T))[1][:, 0]
        offset = float(normal @ centre)
        plane = Plane(normal, offset) if offset <= 0 else Plane(-normal, -offset)
    return plane

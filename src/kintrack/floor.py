# SPDX-License-Identifier: Apache-2.0
"""The floor that a person stands on, found in the depth image: where feet that nobody sees must be.

Among the background's points whose surroundings are level, three at a time are drawn (Fischler &
Bolles 1981); the plane with most points on it and hardly any below it is the floor, if the body's
lower foot stands on it. A table is none: there is something below it, or the person's feet are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.body import run_kinematics
from kintrack.floor_config import FloorConfig
from kintrack.geometry import transform_points
from kintrack.human import Human
from kintrack.skin import skinned_vertices

STRIDE_PX, BASELINE_PX = 5, 6
"""Every how many pixels one is looked at, and how far on each side its surroundings reach."""
DRAWS, SEED = 80, 0
"""Planes that are tried, always with the same draws."""
FARTHEST_M = 6.0
"""Readings further away say little of a plane [m]."""
NOISE_M, NOISE_1_M = 0.012, 0.005
"""A point is on a plane that is nearer than the one and the other times depth squared."""
BELOW_M, BELOW_SHARE = 0.08, 0.04
"""At most such a share of points may lie further below a floor than this and twice its noise."""
LOW_COST = 3.0
"""A point below a plane speaks against it as so many on it speak for it."""
LEAST_SHARE, LEAST_POINTS = 0.06, 60
"""A floor has at least this share of the background's points, and so many of them."""
SOLE_M = 0.015
"""A sole is what lies no higher than this above a foot's lowest point [m]."""


@dataclass(frozen=True)
class Floor:
    """The plane n . x = h of the world frame."""

    normal: Float[ndarray, " 3"]
    """n, a unit vector that points up."""
    height_m: float
    """h [m]."""

    def above_m(self, points_world: Float[ndarray, "n 3"]) -> Float[ndarray, " n"]:
        """How far points are above it [m]."""
        return points_world @ self.normal - self.height_m


@dataclass(frozen=True)
class Ground:
    """What a tracker knows of the floor."""

    floor: Floor | None = None
    """The floor; None where none was found, or the last one is too old."""
    looked_s: float = -np.inf
    """When it was looked for last [s]."""
    found_s: float = -np.inf
    """When it was found last [s]."""

    def due(self, now_s: float, config: FloorConfig) -> bool:
        """Whether it should be looked for."""
        return not 0.0 <= now_s - self.looked_s < config.every_s

    def looked(
        self,
        observation: Observation,
        T_world_camera: Float[ndarray, "4 4"],
        soles_world: Float[ndarray, "2 s 3"],
        now_s: float,
        config: FloorConfig,
    ) -> Ground:
        """Look for the floor in a frame in which the body has been fitted.

        Args:
            observation: Labelled points.
            T_world_camera: Camera pose.
            soles_world: Both soles of the body [m].
            now_s: Now [s].
            config: How near the lower foot must be.
        """
        found = floor_under(observation, T_world_camera, soles_world, config)
        if found is not None:
            return Ground(found, now_s, now_s)
        kept = self.floor if 0.0 <= now_s - self.found_s < config.kept_s else None
        return replace(self, floor=kept, looked_s=now_s)


def soles_of(human: Human) -> Int[ndarray, "2 4"]:
    """Vertices under the left and the right foot: two at the heel, two at the toes."""
    skin = human.skin
    vertices = skinned_vertices(run_kinematics(human.body, human.body.neutral()), skin)
    soles = []
    for side in "lr":
        own = np.flatnonzero(skin.links[:, 0] == skin.link_names.index(f"{side}_foot"))
        own = own[vertices[own, 2] < vertices[own, 2].min() + SOLE_M]
        along = own[np.argsort(vertices[own, 0], kind="stable")]
        soles.append(along[[0, 1, -2, -1]])
    return np.array(soles)


def floor_under(
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    soles_world: Float[ndarray, "2 s 3"],
    config: FloorConfig,
) -> Floor | None:
    """The floor of a frame, if the lower foot of a body stands on it.

    Args:
        observation: Labelled points.
        T_world_camera: Camera pose.
        soles_world: Both soles of the body [m].
        config: How near the lower foot must be.
    """
    floor = find_floor(observation, T_world_camera, config.tilt_deg)
    if floor is None:
        return None
    lowest = min(float(floor.above_m(sole).mean()) for sole in soles_world)
    return floor if abs(lowest) < config.stands_m else None


def find_floor(
    observation: Observation, T_world_camera: Float[ndarray, "4 4"], tilt_deg: float
) -> Floor | None:
    """The lowest large level plane of the background.

    Args:
        observation: Points, labelled: what is of a person is no floor.
        T_world_camera: Camera pose; its notion of up may be wrong by `tilt_deg`.
        tilt_deg: How far from up a floor's normal may be [deg].

    Returns:
        The plane; None if there is none or the image is not labelled.
    """
    if observation.labels is None:
        return None
    points, level, depth = _background(observation, T_world_camera, tilt_deg)
    candidates = np.flatnonzero(level)
    least = max(LEAST_POINTS, LEAST_SHARE * len(points))
    if len(candidates) < least:
        return None
    draws = np.random.default_rng(SEED).random((DRAWS, 3))
    corners = points[candidates[(draws * len(candidates)).astype(int)]]  # (D, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(length, 1e-9)[:, None] * np.sign(normals[:, 2:] + 1e-12)
    upright = (normals[:, 2] > np.cos(np.radians(tilt_deg))) & (length > 1e-3)
    normals, corners = normals[upright], corners[upright]
    noise = NOISE_M + NOISE_1_M * depth**2
    heights = np.einsum("dj,dj->d", normals, corners.mean(axis=1))
    above = points @ normals.T - heights  # (N, D)
    low = (above < -(BELOW_M + 2.0 * noise)[:, None]).sum(axis=0)
    on = ((np.abs(above) < noise[:, None]) & level[:, None]).sum(axis=0)
    score = np.where((low > BELOW_SHARE * len(points)) | (on < least), -np.inf, on - LOW_COST * low)
    if not np.isfinite(score).any():
        return None
    best = int(score.argmax())
    return _refined(points[level], noise[level], Floor(normals[best], float(heights[best])))


def _background(
    observation: Observation, T_world_camera: ndarray, tilt_deg: float
) -> tuple[Float[ndarray, "n 3"], Bool[ndarray, " n"], Float[ndarray, " n"]]:
    """Points that are nobody's, whether their surroundings are level, and their depth."""
    grid, b = observation.points_camera, BASELINE_PX
    z = grid[..., 2]
    assert observation.labels is not None
    usable = (z > 0) & (z < FARTHEST_M) & (observation.labels == 0)
    inner = np.s_[b:-b:STRIDE_PX, b:-b:STRIDE_PX]
    h, w = z.shape
    rows, columns = np.arange(b, h - b, STRIDE_PX), np.arange(b, w - b, STRIDE_PX)
    here = usable[inner]
    down, up = grid[rows + b][:, columns], grid[rows - b][:, columns]
    right, left = grid[rows][:, columns + b], grid[rows][:, columns - b]
    around = (down[..., 2] > 0) & (up[..., 2] > 0) & (right[..., 2] > 0) & (left[..., 2] > 0)
    # with y down and z forward, right x down points away from the camera
    normal = np.cross(down - up, right - left) @ T_world_camera[:3, :3].T
    upright = normal[..., 2] > np.cos(np.radians(tilt_deg + 10.0)) * np.linalg.norm(normal, axis=-1)
    points = transform_points(T_world_camera, grid[inner][here])
    return points, (around & upright)[here], z[inner][here]


def _refined(points: ndarray, noise: ndarray, floor: Floor) -> Floor:
    """The plane of least squares through what lies on a plane, weighted by noise."""
    for _ in range(2):
        on = np.abs(floor.above_m(points)) < 2.0 * noise
        weights = noise[on] ** -2.0
        middle = weights @ points[on] / weights.sum()
        spread = (points[on] - middle) * np.sqrt(weights)[:, None]
        normal = np.linalg.svd(spread, full_matrices=False)[2][2]
        normal = normal * np.sign(normal[2])
        floor = Floor(normal, float(normal @ middle))
    return floor

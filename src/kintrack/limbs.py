# SPDX-License-Identifier: Apache-2.0
"""Limb search: when part of the person is left unexplained, try other places for each limb.

Vertex association follows small motions. A fast arm can leave its skin behind, which then rests on
the trunk and never comes back. So each limb keeps a library of configurations, spread evenly over
its joint limits and freed of those inside the trunk, as points in its parent's frame. A search
scores them all against the observation:

gain  = area of the points that the rest of the body leaves unexplained and the limb would explain
loss  = area of limb where the camera looks through it, or a third of it where it would be hidden

The best one replaces the current configuration only if it scores clearly better than that.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray
from scipy.spatial import cKDTree
from scipy.stats import qmc

from kintrack.association.observation import Observation
from kintrack.association.window import sample_region
from kintrack.body import BodyState, run_kinematics
from kintrack.config import LimbConfig
from kintrack.fit import View
from kintrack.geometry import transform_points
from kintrack.human import Human
from kintrack.skin import Skin, skinned_vertices, vertex_normals

LIMBS = (
    (3, "chest", ("r_clavicle", "r_shoulder", "r_elbow", "r_forearm", "r_wrist")),
    (4, "chest", ("l_clavicle", "l_shoulder", "l_elbow", "l_forearm", "l_wrist")),
    (5, "pelvis", ("r_hip", "r_knee", "r_ankle")),
    (6, "pelvis", ("l_hip", "l_knee", "l_ankle")),
)
"""Label of each limb, the link it hangs on, and the joints that move it."""
SEARCHED = ("shoulder", "elbow", "hip", "knee")
"""Joints that the library varies; the others stay as they are."""


@dataclass(frozen=True)
class Limb:
    """One limb's library of configurations."""

    label: int
    """Body part."""
    parent: int
    """Index of the link that the library's points are fixed to."""
    dofs: Int[ndarray, " d"]
    """Velocity components that the library varies."""
    angles_rad: Float[ndarray, "m d"]
    """Hinge angles of every configuration."""
    vertex: Int[ndarray, " n"]
    """Skin vertices that stand for the limb."""
    points_parent: Float[ndarray, "m n 3"]
    """Those vertices in every configuration, parent link frame [m]."""
    area_m2: float
    """Half the limb's skin area, what a camera can see of it at most [m^2]."""


def build_limbs(human: Human, config: LimbConfig) -> tuple[Limb, ...]:
    """Libraries of all four limbs for a person.

    Args:
        human: Body and skin.
        config: Sizes and seed.

    Returns:
        One library per row of `LIMBS`.
    """
    rows = LIMBS if config.candidates else ()
    return tuple(_build(human, config, *row) for row in rows)


def _build(human: Human, config: LimbConfig, label: int, parent: str, joints) -> Limb:
    body, skin = human.body, human.skin
    names = [name for name in list(body.model.names)[2:] if name.startswith(joints)]
    searched = [name for name in names if name.split("_")[1] in SEARCHED]
    dofs = np.array([body.dof(name) for name in searched])
    draw = qmc.Sobol(len(dofs), seed=config.seed).random(config.candidates)
    angles = qmc.scale(draw, body.lower[dofs], body.upper[dofs])
    own = np.flatnonzero(skin.labels == label)
    vertex = own[np.linspace(0, len(own) - 1, config.points).astype(int)]
    link = body.link_names.index(parent)
    neutral = body.neutral()
    rest = skinned_vertices(run_kinematics(body, neutral), skin)
    inside = _trunk_test(rest, skin)
    points = np.empty((len(angles), len(vertex), 3))
    kept = np.ones(len(angles), dtype=bool)
    for i, row in enumerate(angles):
        q = neutral.copy()
        q[dofs + 1] = row
        state = run_kinematics(body, q)
        world = skinned_vertices(state, skin)[vertex]
        kept[i] = not inside(world)
        T = state.Ts_world_link[link]
        points[i] = (world - T[:3, 3]) @ T[:3, :3]
    a, b, c = (rest[skin.faces[:, k]] for k in range(3))
    face_area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    area = 0.5 * face_area[(skin.labels[skin.faces] == label).all(axis=1)].sum()
    return Limb(label, link, dofs, angles[kept], vertex, points[kept], float(area))


def _trunk_test(rest: Float[ndarray, "v 3"], skin: Skin) -> Callable[[ndarray], bool]:
    """A test whether over a tenth of some points lie deeper than 3 cm inside the trunk."""
    torso = skin.labels == 2
    tree = cKDTree(rest[torso])
    normals = vertex_normals(rest, skin.faces)[torso]

    def inside(points: ndarray) -> bool:
        nearest = tree.query(points)[1]
        depth = np.einsum("ij,ij->i", points - tree.data[nearest], normals[nearest])
        return bool((depth < -0.03).mean() > 0.1)

    return inside


def search_limbs(
    human: Human,
    limbs: tuple[Limb, ...],
    state: BodyState,
    view: View,
    observation: Observation,
    T_camera_world: Float[ndarray, "4 4"],
    config: LimbConfig,
) -> Float[ndarray, " nq"] | None:
    """Better configurations for limbs that have left their data.

    Args:
        human: Body and skin.
        limbs: Libraries from `build_limbs`.
        state: Fitted body.
        view: Its skin seen by the camera.
        observation: What was observed.
        T_camera_world: Camera pose, inverted.
        config: Thresholds.

    Returns:
        The configuration with limbs replaced, or None if nothing scores better.
    """
    points = sample_region(observation, config.pixels)
    if len(points) == 0:
        return None
    camera = observation.camera
    step_area = np.count_nonzero(observation.region) / len(points)
    areas = points[:, 2] ** 2 / (camera.fx * camera.fy) * step_area
    rays = view.vertices_camera / np.linalg.norm(view.vertices_camera, axis=1, keepdims=True)
    facing = np.einsum("ij,ij->i", view.normals_camera, rays) < 0.0
    q, changed = state.q.copy(), False
    claimed = np.zeros(len(points), dtype=bool)
    for limb in limbs:
        rest = view.vertices_camera[facing & (human.skin.labels != limb.label)]
        away = cKDTree(rest).query(points, distance_upper_bound=config.explained_m)[0]
        free = ~np.isfinite(away) & ~claimed
        if areas[free].sum() < config.trigger_m2:
            continue
        T = T_camera_world @ state.Ts_world_link[limb.parent]
        flat = transform_points(T, limb.points_parent.reshape(-1, 3))
        candidates = np.concatenate(
            [view.vertices_camera[limb.vertex][None], flat.reshape(limb.points_parent.shape)]
        )
        scores = _score(
            candidates, points[free], areas[free], limb.area_m2 / len(limb.vertex),
            observation.points_camera, observation.region,
            camera.fx, camera.fy, camera.cx, camera.cy, config.explained_m,
        )
        best = int(np.argmax(scores[1:]))
        if scores[best + 1] > scores[0] + config.trigger_m2:
            q[limb.dofs + 1] = limb.angles_rad[best]
            claimed |= free & np.isfinite(
                cKDTree(candidates[best + 1]).query(
                    points, distance_upper_bound=config.explained_m
                )[0]
            )
            changed = True
    return q if changed else None


@njit(cache=True)
def _score(candidates, points, areas, point_area, observed, region, fx, fy, cx, cy, tau):
    m, n = candidates.shape[0], candidates.shape[1]
    h, w = region.shape
    out = np.zeros(m)
    for i in range(m):
        for k in range(points.shape[0]):
            best = tau * tau
            for j in range(n):
                dx = candidates[i, j, 0] - points[k, 0]
                dy = candidates[i, j, 1] - points[k, 1]
                dz = candidates[i, j, 2] - points[k, 2]
                d = dx * dx + dy * dy + dz * dz
                if d < best:
                    best = d
            out[i] += areas[k] * (1.0 - best / (tau * tau))
        for j in range(n):
            z = candidates[i, j, 2]
            if z <= 0.05:
                out[i] -= point_area
                continue
            u = int(np.floor(fx * candidates[i, j, 0] / z + cx + 0.5))
            v = int(np.floor(fy * candidates[i, j, 1] / z + cy + 0.5))
            if u < 0 or v < 0 or u >= w or v >= h:
                continue
            if not region[v, u] or observed[v, u, 2] > z + 1.5 * tau:
                out[i] -= point_area
            elif observed[v, u, 2] < z - 2.0 * tau:
                out[i] -= 0.33 * point_area
    return out

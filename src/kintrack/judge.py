# SPDX-License-Identifier: Apache-2.0
"""How well a posed skin and an observation explain each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.alignment import View
from kintrack.association.hiding import hidden_vertices
from kintrack.association.observation import Observation
from kintrack.association.window import associate, sample_region
from kintrack.config import JudgeConfig, OcclusionConfig
from kintrack.geometry import LABELS

NEARER_M = OcclusionConfig().nearer_m
"""What is this much nearer than the skin hides it [m]."""
NEAR_M = 0.12
"""Skin lies on a pixel whose depth differs less than this [m]."""
SAMPLES = 600
"""About how many observed points are asked whether the skin explains them."""


@dataclass(frozen=True)
class Agreement:
    """Coverage in both directions."""

    explained: float
    """Share of the observed region that lies near the visible skin, 0 to 1."""
    supported: float
    """Share of the visible skin that has an observed point near it, 0 to 1; skin behind something
    else is not asked."""
    seen: float
    """Share of all skin that the camera would see which has an observed point near it, 0 to 1."""
    vertex_supported: Bool[ndarray, " v"]
    """Visible vertices with an observed point near them."""


def agreement(view: View, observation: Observation, explained_m: float) -> Agreement:
    """Compare a view of the skin with what was observed.

    Args:
        view: The skin seen by the camera.
        observation: Region that may be the person.
        explained_m: Distance that counts as near [m].

    Returns:
        Shares, 0 where there is nothing to compare.
    """
    pairs = associate(
        observation,
        view.vertices_camera,
        view.visible,
        explained_m,
        explained_m,
        SAMPLES,
        view.labels,
    )
    supported = np.zeros(len(view.visible), dtype=bool)
    supported[pairs.vertex[: pairs.from_skin]] = True
    hidden = hidden_vertices(observation, view.vertices_camera, view.visible, view.labels, NEARER_M)
    asked = len(sample_region(observation, SAMPLES)[0])
    return Agreement(
        explained=(len(pairs.vertex) - pairs.from_skin) / max(asked, 1),
        supported=pairs.from_skin / max(int((view.visible & (supported | ~hidden)).sum()), 1),
        seen=pairs.from_skin / max(int(view.visible.sum()), 1),
        vertex_supported=supported,
    )


def distance_between(view: View, observation: Observation, most_m: float) -> float:
    """Mean distance between visible skin and observation, both ways, each capped [m].

    Skin behind something nearer is left out.

    Args:
        view: The skin seen by the camera.
        observation: Region that may be the person.
        most_m: Cap of every distance [m].

    Returns:
        Mean of the two directions' means; the cap where there is nothing to compare.
    """
    points, _ = sample_region(observation, 1500)
    hidden = hidden_vertices(observation, view.vertices_camera, view.visible, view.labels, NEARER_M)
    skin = view.vertices_camera[view.visible & ~hidden]
    if len(points) == 0 or len(skin) == 0:
        return most_m
    to_skin = np.minimum(cKDTree(skin).query(points)[0], most_m)
    to_points = np.minimum(cKDTree(points).query(skin)[0], most_m)
    return 0.5 * float(to_skin.mean() + to_points.mean())


def acceptable(agreed: Agreement, rms_m: float, config: JudgeConfig) -> bool:
    """True if a frame counts as tracking by residual and coverage."""
    return (
        rms_m <= config.max_rms_m
        and agreed.explained >= config.min_explained
        and agreed.supported >= config.min_supported
    )


def joint_visibility(
    view: View,
    supported: Bool[ndarray, " v"],
    joint_positions_camera: Float[ndarray, "j 3"],
    radius_m: float = 0.13,
    shell_m: float = 0.05,
) -> Float[ndarray, " j"]:
    """Share of the camera-facing skin around each joint that was observed, shape (J,).

    Args:
        view: The skin seen by the camera.
        supported: Vertices with an observed point near them.
        joint_positions_camera: Joint centres [m].
        radius_m: Skin this near is around a joint [m].
        shell_m: Around a joint that lies deeper, what is this much further than the nearest [m].
    """
    rays = view.vertices_camera / np.linalg.norm(view.vertices_camera, axis=1, keepdims=True)
    facing = np.einsum("ij,ij->i", view.normals_camera, rays) < -0.15
    d2 = (
        (view.vertices_camera**2).sum(axis=1)
        - 2 * joint_positions_camera @ view.vertices_camera.T
        + (joint_positions_camera**2).sum(axis=1)[:, None]
    )
    nearest = np.sqrt(np.maximum(np.where(facing, d2, np.inf).min(axis=1), 0.0))
    near = (d2 < np.maximum(radius_m, nearest + shell_m)[:, None] ** 2) & facing
    return (near & supported).sum(axis=1) / np.maximum(near.sum(axis=1), 1)


def label_counts(view: View, observation: Observation) -> Int[ndarray, "7 7"]:
    """How many visible vertices of label i lie on pixels of label j.

    Args:
        view: The skin seen by the camera.
        observation: Labelled points, sides as the network gave them.

    Returns:
        `counts[model, pixel]`; vertices with nothing near them are not counted.
    """
    if observation.labels is None:
        return np.zeros((len(LABELS), len(LABELS)), dtype=np.int64)
    camera = observation.camera
    return _count(
        view.vertices_camera[view.visible],
        view.labels[view.visible],
        observation.points_camera[..., 2],
        observation.labels,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        len(LABELS),
    )


def label_agreement(counts: Int[ndarray, "7 7"]) -> float:
    """Share of skin on any person's pixels that lies on pixels of its own part; NaN for none."""
    on_person = counts[1:, 1:]
    total = int(on_person.sum())
    return float(np.trace(on_person) / total) if total else float("nan")


@njit(cache=True, nogil=True)
def _count(skin, part, z, labels, fx, fy, cx, cy, kinds):
    out = np.zeros((kinds, kinds), dtype=np.int64)
    h, w = z.shape
    for i in range(skin.shape[0]):
        u = int(np.floor(fx * skin[i, 0] / skin[i, 2] + cx + 0.5))
        r = int(np.floor(fy * skin[i, 1] / skin[i, 2] + cy + 0.5))
        if u < 0 or r < 0 or u >= w or r >= h or labels[r, u] >= kinds:
            continue
        if z[r, u] > 0.0 and abs(z[r, u] - skin[i, 2]) < NEAR_M:
            out[part[i], labels[r, u]] += 1
    return out

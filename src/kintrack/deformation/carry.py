# SPDX-License-Identifier: Apache-2.0
"""Offsets from the tracking skin to the finer skin for display."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.body import Body, run_kinematics
from kintrack.skin import Skin, skinned_vertices, vertex_normals

NEIGHBOURS = 4
"""Vertices that a carried offset is mixed from."""
TURNED_M = 0.1
"""Two vertices with opposite normals count as twice this apart, so that fingers and thighs do not
borrow from each other [m]."""
NEAR_M = 0.002
"""Below this distance neighbours count alike [m]."""


def carried(
    body: Body, source: Skin, target: Skin, values: Float[ndarray, "*n v"]
) -> Float[ndarray, "*n w"]:
    """Values of one skin's vertices at another skin's vertices, in bind pose the nearest.

    Args:
        body: The body of both.
        source: Skin with V vertices.
        target: Skin with W vertices.
        values: One value per vertex of the source, shape (..., V).

    Returns:
        Means of the nearest vertices, weighted by inverse square distance, shape (..., W).
    """
    vertex, weight = _mixture(_places(body, source), _places(body, target))
    return np.asarray((values[..., vertex] * weight).sum(axis=-1))


def _places(body: Body, skin: Skin) -> Float[ndarray, "v 6"]:
    vertices = skinned_vertices(run_kinematics(body, body.neutral()), skin)
    return np.hstack([vertices, TURNED_M * vertex_normals(vertices, skin.faces)])


def _mixture(
    source: Float[ndarray, "v 6"], target: Float[ndarray, "w 6"]
) -> tuple[Int[ndarray, "w k"], Float[ndarray, "w k"]]:
    distance, vertex = map(np.asarray, cKDTree(source).query(target, k=NEIGHBOURS))
    weight = 1.0 / (distance**2 + NEAR_M**2)
    return vertex, weight / weight.sum(axis=1, keepdims=True)

# SPDX-License-Identifier: Apache-2.0
"""Observed points should lie on the skin: point-to-plane with a share of point-to-point.

With d_i = s_i(q) - p_i, normal n_i and robust weight w_i frozen, the cost of a pair is
w_i ((n_i . d_i)^2 + alpha |d_i|^2) / (2 c sigma^2). The quadratic form n n^T + alpha I has the
root A_i = sqrt(alpha) I + (sqrt(1 + alpha) - sqrt(alpha)) n_i n_i^T, so r_i = A_i d_i (3 rows).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.body import BodyState
from kintrack.config import SurfaceConfig
from kintrack.errors import AssociationError
from kintrack.geometry import robust_scale, tukey_weights
from kintrack.residuals.linearization import Linearization
from kintrack.skin import Skin, skinned_vertices, vertex_jacobians


@dataclass(frozen=True)
class SurfaceResidual:
    """Pairs of vertices and points with frozen normals and weights."""

    skin: Skin
    """The skin."""
    vertex: Int[ndarray, " n"]
    """Vertex of each pair."""
    points_world: Float[ndarray, "n 3"]
    """Observed point of each pair [m]."""
    roots: Float[ndarray, "n 3 3"]
    """A_i of the module's equation."""
    weights: Float[ndarray, " n"]
    """w_i / (c sigma^2) [1/m^2]."""
    scale_m: float
    """Robust standard deviation sigma of the point-to-plane residuals [m]."""
    inliers: int
    """Pairs whose robust weight is above one half."""
    rms_m: float
    """Root mean square point-to-plane residual of the inliers [m]."""

    def _offsets(self, state: BodyState) -> Float[ndarray, "n 3"]:
        return skinned_vertices(state, self.skin)[self.vertex] - self.points_world

    def linearize(self, state: BodyState) -> Linearization:
        """r = A_i d_i, rows of one pair together, shape (3 N,) [m]."""
        r = _apply(self.roots, self._offsets(state))
        J = _apply_rows(self.roots, vertex_jacobians(state, self.skin, self.vertex))
        return Linearization(r.ravel(), J.reshape(r.size, -1), np.repeat(self.weights, 3))

    def cost(self, state: BodyState) -> float:
        """0.5 sum_i w_i |A_i d_i|^2."""
        r = _apply(self.roots, self._offsets(state))
        return 0.5 * float(self.weights @ (r * r).sum(axis=1))


def surface_residual(
    skin: Skin,
    vertex: Int[ndarray, " n"],
    points_world: Float[ndarray, "n 3"],
    vertices_world: Float[ndarray, "v 3"],
    normals_world: Float[ndarray, "v 3"],
    config: SurfaceConfig,
) -> SurfaceResidual:
    """Freeze normals and Tukey weights at the current skin.

    Args:
        skin: The skin.
        vertex: Vertex of each pair.
        points_world: Observed point of each pair [m].
        vertices_world: All vertices now [m].
        normals_world: Their unit normals.
        config: Weights and scale bounds.

    Returns:
        The term.

    Raises:
        AssociationError: if there is no pair.
    """
    if len(vertex) == 0:
        raise AssociationError("no observed point lies near the skin")
    n = normals_world[vertex]
    d = vertices_world[vertex] - points_world
    plane = np.einsum("ij,ij->i", n, d)
    scale = float(np.clip(robust_scale(plane), config.scale_floor_m, config.scale_ceiling_m))
    robust = tukey_weights(plane, scale)
    alpha = config.point_weight
    gain = np.sqrt(1 + alpha) - np.sqrt(alpha)
    roots = gain * n[:, :, None] * n[:, None, :] + np.sqrt(alpha) * np.eye(3)
    inlier = robust > 0.5
    return SurfaceResidual(
        skin=skin,
        vertex=vertex,
        points_world=points_world,
        roots=roots,
        weights=robust / (config.correlation * scale**2),
        scale_m=scale,
        inliers=int(inlier.sum()),
        rms_m=float(np.sqrt(np.mean(plane[inlier] ** 2))) if inlier.any() else float("nan"),
    )


@njit(cache=True)
def _apply(A, d):
    out = np.empty_like(d)
    for i in range(d.shape[0]):
        for r in range(3):
            out[i, r] = A[i, r, 0] * d[i, 0] + A[i, r, 1] * d[i, 1] + A[i, r, 2] * d[i, 2]
    return out


@njit(cache=True)
def _apply_rows(A, J):
    out = np.empty_like(J)
    for i in range(J.shape[0]):
        for r in range(3):
            for k in range(J.shape[2]):
                out[i, r, k] = (
                    A[i, r, 0] * J[i, 0, k] + A[i, r, 1] * J[i, 1, k] + A[i, r, 2] * J[i, 2, k]
                )
    return out

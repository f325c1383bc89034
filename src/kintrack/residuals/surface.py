# SPDX-License-Identifier: Apache-2.0
"""Observed points should lie on the skin: point-to-plane with a share of point-to-point.

With d_i = s_i(q) - p_i, normal n_i and robust weight w_i frozen, the cost of a pair is
w_i ((n_i . d_i)^2 + alpha |d_i|^2) / (2 c sigma^2). The quadratic form n n^T + alpha I has the
root A_i = sqrt(alpha) I + (sqrt(1 + alpha) - sqrt(alpha)) n_i n_i^T, so r_i = A_i d_i (3 rows).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.body import BodyState
from kintrack.errors import AssociationError
from kintrack.geometry import huber_weights, robust_scale, tukey_weights
from kintrack.objective_config import SurfaceConfig
from kintrack.residuals.linearization import Linearization, Quadratic, Residual
from kintrack.skin import Skin, skinned_vertices, vertex_jacobians


@dataclass(frozen=True)
class SurfaceResidual(Residual):
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

    def joined(self, other: SurfaceResidual) -> SurfaceResidual:
        """The pairs of both terms as one, with this one's scale, inliers and RMS."""
        return replace(
            self,
            vertex=np.concatenate([self.vertex, other.vertex]),
            points_world=np.concatenate([self.points_world, other.points_world]),
            roots=np.concatenate([self.roots, other.roots]),
            weights=np.concatenate([self.weights, other.weights]),
        )

    def linearize(self, state: BodyState) -> Linearization:
        """Rows A_i d_i, the three of one pair together, shape (3 N,) [m]."""
        r = _apply(self.roots, self._offsets(state))
        J = _apply_rows(self.roots, vertex_jacobians(state, self.skin, self.vertex))
        return Linearization(r.ravel(), J.reshape(r.size, -1), np.repeat(self.weights, 3))

    def quadratic(self, state: BodyState) -> Quadratic:
        """J^T W J by way of the links, without forming J.

        A vertex moves by sum_b w_b [I, -[x_b]x] J_b, J_b the motion of link b, so
        H = sum_bc J_b^T M_bc J_c with 6x6 blocks M_bc summed over the pairs.
        """
        body = state.body
        rows = (self.skin.links[self.vertex], self.skin.weights[self.vertex])
        points = self.skin.points_link[self.vertex]
        M, h, cost = _link_blocks(
            state.Ts_world_link, *rows, points, self.points_world, self.roots, self.weights
        )
        J = (body.support[:, None, :] * state.J_world[None]).reshape(-1, body.nv)
        n = len(J)
        return Quadratic(J.T @ (M.transpose(0, 2, 1, 3).reshape(n, n) @ J), h.reshape(n) @ J, cost)

    def cost(self, state: BodyState) -> float:
        """0.5 sum_i w_i |A_i d_i|^2."""
        skin, v = self.skin, self.vertex
        return _cost(
            state.Ts_world_link,
            skin.links,
            skin.weights,
            skin.points_link,
            v,
            self.points_world,
            self.roots,
            self.weights,
        )


def surface_residual(
    skin: Skin,
    vertex: Int[ndarray, " n"],
    points_world: Float[ndarray, "n 3"],
    vertices_world: Float[ndarray, "v 3"],
    normals_world: Float[ndarray, "v 3"],
    config: SurfaceConfig,
    least_scale_m: float = 0.0,
) -> SurfaceResidual:
    """Freeze normals and Tukey weights at the current skin.

    Args:
        skin: The skin.
        vertex: Vertex of each pair.
        points_world: Observed point of each pair [m].
        vertices_world: All vertices now [m].
        normals_world: Their unit normals.
        config: Weights and scale bounds.
        least_scale_m: Keeps far pairs in play while the gate is still wide [m].

    Returns:
        The term.

    Raises:
        AssociationError: if there is no pair.
    """
    if len(vertex) == 0:
        raise AssociationError("no observed point lies near the skin")
    n = normals_world[vertex]
    plane = np.einsum("ij,ij->i", n, vertices_world[vertex] - points_world)
    scale = float(np.clip(robust_scale(plane), config.scale_floor_m, config.scale_ceiling_m))
    scale = max(scale, least_scale_m)
    robust = tukey_weights(plane, scale)
    inlier = robust > 0.5
    return SurfaceResidual(
        skin=skin,
        vertex=vertex,
        points_world=points_world,
        roots=plane_roots(n, config.point_weight),
        weights=robust / (config.correlation * scale**2),
        scale_m=scale,
        inliers=int(inlier.sum()),
        rms_m=float(np.sqrt(np.mean(plane[inlier] ** 2))) if inlier.any() else float("nan"),
    )


def silhouette_residual(
    skin: Skin,
    vertex: Int[ndarray, " n"],
    points_world: Float[ndarray, "n 3"],
    vertices_world: Float[ndarray, "v 3"],
    config: SurfaceConfig,
) -> SurfaceResidual:
    """Draw vertices along the line to their silhouette point, with Huber weights.

    Args:
        skin: The skin.
        vertex: Vertex of each pair.
        points_world: Silhouette point of each pair [m].
        vertices_world: All vertices now [m].
        config: Weight and scale.

    Returns:
        The term, possibly without pairs.
    """
    d = vertices_world[vertex] - points_world
    length = np.linalg.norm(d, axis=1)
    scale = config.scale_ceiling_m
    robust = huber_weights(length, scale)
    return SurfaceResidual(
        skin=skin,
        vertex=vertex,
        points_world=points_world,
        roots=plane_roots(d / np.maximum(length, 1e-9)[:, None], 0.0),
        weights=config.silhouette_weight * robust / (config.correlation * scale**2),
        scale_m=scale,
        inliers=len(vertex),
        rms_m=float("nan"),
    )


def plane_roots(n: Float[ndarray, "n 3"], alpha: float) -> Float[ndarray, "n 3 3"]:
    """A_i of the module's equation for unit normals n_i."""
    return _fill_roots(n, np.sqrt(alpha), np.sqrt(1 + alpha) - np.sqrt(alpha))


@njit(cache=True, nogil=True)
def _fill_roots(n, base, gain):
    out = np.empty((n.shape[0], 3, 3))
    for i in range(n.shape[0]):
        for r in range(3):
            for c in range(3):
                out[i, r, c] = gain * n[i, r] * n[i, c]
            out[i, r, r] += base
    return out


@njit(cache=True, nogil=True)
def _apply(A, d):
    out = np.empty_like(d)
    for i in range(d.shape[0]):
        for r in range(3):
            out[i, r] = A[i, r, 0] * d[i, 0] + A[i, r, 1] * d[i, 1] + A[i, r, 2] * d[i, 2]
    return out


@njit(cache=True, nogil=True)
def _apply_rows(A, J):
    out = np.empty_like(J)
    for i in range(J.shape[0]):
        for r in range(3):
            for k in range(J.shape[2]):
                out[i, r, k] = (
                    A[i, r, 0] * J[i, 0, k] + A[i, r, 1] * J[i, 1, k] + A[i, r, 2] * J[i, 2, k]
                )
    return out


@njit(cache=True, nogil=True)
def _cost(Ts, links, skin_weights, points, vertex, observed, A, weights):
    total = 0.0
    d = np.empty(3)
    for i in range(vertex.shape[0]):
        if weights[i] == 0.0:
            continue
        k = vertex[i]
        for r in range(3):
            d[r] = -observed[i, r]
        for b in range(4):
            w = skin_weights[k, b]
            if w == 0.0:
                continue
            T = Ts[links[k, b]]
            p = points[k, b]
            for r in range(3):
                d[r] += w * (T[r, 0] * p[0] + T[r, 1] * p[1] + T[r, 2] * p[2] + T[r, 3])
        for r in range(3):
            e = A[i, r, 0] * d[0] + A[i, r, 1] * d[1] + A[i, r, 2] * d[2]
            total += weights[i] * e * e
    return 0.5 * total


@njit(cache=True, nogil=True)
def _link_blocks(Ts, links, skin_weights, points, observed, A, weights):
    """M_bc (L, L, 6, 6), the links' gradient h (L, 6) and the cost, summed over the pairs."""
    count = Ts.shape[0]
    M = np.zeros((count, count, 6, 6))
    h = np.zeros((count, 6))
    cost = 0.0
    x = np.empty((4, 3))
    K = np.empty((4, 3, 6))
    d = np.empty(3)
    e = np.empty(3)
    for i in range(links.shape[0]):
        if weights[i] == 0.0:
            continue
        for r in range(3):
            d[r] = -observed[i, r]
        for b in range(4):
            w = skin_weights[i, b]
            if w == 0.0:
                continue
            T = Ts[links[i, b]]
            p = points[i, b]
            for r in range(3):
                x[b, r] = T[r, 0] * p[0] + T[r, 1] * p[1] + T[r, 2] * p[2] + T[r, 3]
                d[r] += w * x[b, r]
        for r in range(3):
            e[r] = A[i, r, 0] * d[0] + A[i, r, 1] * d[1] + A[i, r, 2] * d[2]
            cost += 0.5 * weights[i] * e[r] * e[r]
        for b in range(4):
            w = skin_weights[i, b]
            if w == 0.0:
                continue
            for r in range(3):
                a0, a1, a2 = w * A[i, r, 0], w * A[i, r, 1], w * A[i, r, 2]
                K[b, r, 0], K[b, r, 1], K[b, r, 2] = a0, a1, a2
                K[b, r, 3] = x[b, 1] * a2 - x[b, 2] * a1
                K[b, r, 4] = x[b, 2] * a0 - x[b, 0] * a2
                K[b, r, 5] = x[b, 0] * a1 - x[b, 1] * a0
        for b in range(4):
            if skin_weights[i, b] == 0.0:
                continue
            lb = links[i, b]
            for m in range(6):
                h[lb, m] += weights[i] * (K[b, 0, m] * e[0] + K[b, 1, m] * e[1] + K[b, 2, m] * e[2])
            for c in range(4):
                if skin_weights[i, c] == 0.0 or links[i, c] < lb:
                    continue
                block = M[lb, links[i, c]]
                for m in range(6):
                    k0, k1, k2 = (
                        weights[i] * K[b, 0, m],
                        weights[i] * K[b, 1, m],
                        weights[i] * K[b, 2, m],
                    )
                    for n in range(6):
                        block[m, n] += k0 * K[c, 0, n] + k1 * K[c, 1, n] + k2 * K[c, 2, n]
    for a in range(count):
        for b in range(a + 1, count):
            for m in range(6):
                for n in range(6):
                    M[b, a, n, m] = M[a, b, m, n]
    return M, h, cost

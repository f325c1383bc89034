# SPDX-License-Identifier: Apache-2.0
"""How sure every joint is.

The inverse of the solver's matrix H takes every pair for an independent witness. Pairs of one link
are not: clothes and a body of another size shift them all. With a shift b_l of standard deviation
`shared_m` per link and axis, the solution moves by H^-1 G_l b_l, G_l = sum_i w_i J_i^T A_i^T A_i,
so (the sandwich of Huber 1967)

    C = H^-1 + shared^2 sum_l (H^-1 G_l) (H^-1 G_l)^T,    C_joint = s^2 (J C J^T + floor^2 I).

Neither knows that a limb of which little is seen may have been given the wrong pixels, or none. So
a joint around which the share v of the skin is seen is taken to be s = v + (1 - v) unseen times as
far off.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numba import njit
from numpy import ndarray

from kintrack.body import BodyState, joint_jacobians
from kintrack.config import ConfidenceConfig
from kintrack.residuals.surface import SurfaceResidual


def joint_covariances(
    state: BodyState,
    covariance: Float[ndarray, "nv nv"],
    surface: SurfaceResidual | None,
    visible: Float[ndarray, " j"],
    config: ConfidenceConfig,
) -> Float[ndarray, "j 3 3"]:
    """Covariances of the joint centres, world frame.

    Args:
        state: Body at the solution.
        covariance: Inverse of the solver's matrix there.
        surface: Pairs of the last round; None if the pose is a prediction.
        visible: Share of the skin near each joint that was seen, 0 to 1.
        config: Shared error, floor, and what is unseen.

    Returns:
        Covariances [m^2], shape (J, 3, 3).
    """
    if surface is not None:
        shift = covariance @ _shared_gradients(state, surface)
        covariance = covariance + config.shared_m**2 * (shift @ shift.T)
    J = joint_jacobians(state)
    known = J @ covariance @ J.transpose(0, 2, 1) + config.floor_m**2 * np.eye(3)
    scale = visible + (1.0 - visible) * config.unseen
    return scale[:, None, None] ** 2 * known


def _shared_gradients(state: BodyState, surface: SurfaceResidual) -> Float[ndarray, "nv m"]:
    """The columns of all G_l, shape (nv, 3 L)."""
    skin, vertex = surface.skin, surface.vertex
    blocks = _shared_blocks(
        state.Ts_world_link,
        skin.links[vertex],
        skin.weights[vertex],
        skin.points_link[vertex],
        surface.roots,
        surface.weights,
    )
    J = state.body.support[:, None, :] * state.J_world[None]
    G = np.tensordot(J, blocks, ([0, 1], [1, 2]))
    return G.reshape(state.body.nv, -1)


@njit(cache=True, nogil=True)
def _shared_blocks(Ts, links, skin_weights, points, A, weights):
    """Force and torque on link b of a unit shift of the pairs of link l, (L, L, 6, 3)."""
    count = Ts.shape[0]
    out = np.zeros((count, count, 6, 3))
    x = np.empty(3)
    m = np.empty(3)
    for i in range(links.shape[0]):
        if weights[i] == 0.0:
            continue
        own = links[i, 0]
        for b in range(4):
            w = weights[i] * skin_weights[i, b]
            if w == 0.0:
                continue
            T, p, block = Ts[links[i, b]], points[i, b], out[own, links[i, b]]
            for r in range(3):
                x[r] = T[r, 0] * p[0] + T[r, 1] * p[1] + T[r, 2] * p[2] + T[r, 3]
            for c in range(3):
                for r in range(3):
                    m[r] = w * (
                        A[i, 0, r] * A[i, 0, c] + A[i, 1, r] * A[i, 1, c] + A[i, 2, r] * A[i, 2, c]
                    )
                    block[r, c] += m[r]
                block[3, c] += x[1] * m[2] - x[2] * m[1]
                block[4, c] += x[2] * m[0] - x[0] * m[2]
                block[5, c] += x[0] * m[1] - x[1] * m[0]
    return out

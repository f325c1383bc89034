# SPDX-License-Identifier: Apache-2.0
"""The terms of the objective as parameters of one nonlinear programme, without any loss.

Skinning is linear in the link poses: with T the links' 3x4 poses side by side, vertex i is T b_i,
where b_i holds w_ib (x_ib, 1) at the places of its links. So with the pairs, normals and weights
of a round frozen, the surface term is a quadratic function of t = vec(T),

    0.5 sum_i w_i |A_i (T b_i - p_i)|^2 = 0.5 t^T Q t + g^T t + c,

whose Q, g and c are sums over the pairs: exact for any number of them, and an evaluation costs the
same for 40 as for 4000. A joint centre is such a vertex too. Priors are quadratic in the root's
differences from where it is expected and the hinge angles. Places are told from the body's root,
which keeps rounding small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float
from numba import njit
from numpy import ndarray

from kintrack.body import Body, BodyState
from kintrack.errors import ConfigError
from kintrack.residuals.joints import JointResidual
from kintrack.residuals.linearization import Residual
from kintrack.residuals.prior import TangentPrior
from kintrack.residuals.surface import SurfaceResidual
from kintrack.residuals.targets import TargetResidual
from kintrack.solver.symbolic_body import joint_origins


@dataclass(frozen=True)
class Parameters:
    """Everything but the step, in the order in which the programme takes it.

    The cost is 0.5 t^T Q t + g^T t over the link poses t and the same over the tangent features
    z = (root differences, hinge angles), plus a constant.
    """

    q: Float[ndarray, " nq"]
    """Configuration that the step starts from, its root moved to the origin."""
    origins_m: Float[ndarray, "3 h"]
    """Joint origins: the person's size."""
    places: Float[ndarray, "7 k"]
    """Expected root placements, told from the root."""
    surface_Q: Float[ndarray, " b"]
    """Quadratic part over the link poses: the places of `pose_pattern`, column by column."""
    surface_g: Float[ndarray, " t"]
    """Linear part over the link poses."""
    prior_Q: Float[ndarray, "z z"]
    """Quadratic part over the tangent features."""
    prior_g: Float[ndarray, " z"]
    """Linear part over the tangent features."""
    constant: Float[ndarray, ""]
    """Cost that no step changes."""

    def packed(self) -> Float[ndarray, " p"]:
        """All fields in one vector, column by column as CasADi counts."""
        return np.concatenate([np.ravel(getattr(self, f.name), order="F") for f in fields(self)])


def bonds(residuals: Sequence[Residual], links: int) -> Bool[ndarray, "l l"]:
    """True where some vertex of the surface terms' skins hangs on both links."""
    together = np.eye(links, dtype=bool)
    for residual in residuals:
        if isinstance(residual, SurfaceResidual):
            _bond(together, residual.skin.links, residual.skin.weights)
    return together


def pose_pattern(together: Bool[ndarray, "l l"]) -> Bool[ndarray, "t t"]:
    """True where Q can differ from zero, link poses column by column (12 numbers a link)."""
    return np.kron(together, np.ones((12, 12), dtype=bool))


def parameters(
    state: BodyState, residuals: Sequence[Residual], together: Bool[ndarray, "l l"]
) -> Parameters:
    """Sum the terms up.

    Args:
        state: Where the step starts.
        residuals: Surface, joint and tangent terms, any number of each.
        together: `bonds` of the terms.

    Returns:
        The parameters; there is one expected place at least.

    Raises:
        ConfigError: if a term is of a kind that the programme does not know.
    """
    body, root_m = state.body, state.q[:3]
    n = 12 * len(body.link_names)
    Q, g, constant = np.zeros((n, n)), np.zeros(n), 0.0
    priors: list[TangentPrior] = []
    for residual in residuals:
        if isinstance(residual, SurfaceResidual):
            constant += _add_surface(Q, g, residual, root_m)
        elif isinstance(residual, JointResidual):
            constant += _add_joints(Q, g, residual, body, root_m)
        elif isinstance(residual, TargetResidual):
            constant += _add_joints(Q, g, residual.frozen(state), body, root_m)
        elif isinstance(residual, TangentPrior):
            priors.append(residual)
        else:
            raise ConfigError(
                f"term {type(residual).__name__}: the IPOPT solver takes SurfaceResidual, "
                "JointResidual, TargetResidual and TangentPrior"
            )
    places, prior_Q, prior_g, prior_constant = _sum_priors(priors, body, root_m)
    q = state.q.copy()
    q[:3] = 0.0
    return Parameters(
        q=q,
        origins_m=joint_origins(body),
        places=places,
        surface_Q=(np.triu(Q) + np.triu(Q, 1).T)[pose_pattern(together)],
        surface_g=g,
        prior_Q=prior_Q,
        prior_g=prior_g,
        constant=np.array(constant + prior_constant),
    )


def _add_surface(Q: ndarray, g: ndarray, term: SurfaceResidual, root_m: ndarray) -> float:
    """Add the pairs of a surface term; its constant.

    The skin's weights sum to 1 but for rounding, which is carried along.
    """
    skin, v = term.skin, term.vertex
    points = term.points_world - skin.weights[v].sum(axis=1)[:, None] * root_m
    rows = skin.links[v], skin.weights[v], skin.points_link[v]
    return _add_pairs(Q, g, *rows, points, term.roots, term.weights)


def _add_joints(Q: ndarray, g: ndarray, term: JointResidual, body: Body, root_m: ndarray) -> float:
    """Add joint centres, each a point that one link carries; their constant."""
    link = {int(joint): k for k, joint in enumerate(body.link_joints)}
    frames = [body.model.frames[int(body.joint_frames[j])] for j in term.joint]
    count = len(frames)
    links = np.array([[link[frame.parentJoint]] for frame in frames], dtype=np.int64)
    offsets = np.array([[frame.placement.translation] for frame in frames])
    rows = links.reshape(count, 1), np.ones((count, 1)), offsets.reshape(count, 1, 3)
    roots = np.tile(np.eye(3), (count, 1, 1))
    weights = np.full(count, term.sigma_m**-2.0)
    return _add_pairs(Q, g, *rows, term.places_world - root_m, roots, weights)


def _sum_priors(
    priors: Sequence[TangentPrior], body: Body, root_m: ndarray
) -> tuple[ndarray, ndarray, ndarray, float]:
    """Expected places of the root, Q and g over the tangent features, and the constant."""
    hinges = body.nv - 6
    informed = [bool(np.any(prior.root[:6])) for prior in priors]
    count = max(1, sum(informed))
    places = np.tile(np.array([0.0, 0, 0, 0, 0, 0, 1])[:, None], (1, count))
    Q, g, constant = np.zeros((6 * count + hinges,) * 2), np.zeros(6 * count + hinges), 0.0
    place = 0
    for prior, rooted in zip(priors, informed, strict=True):
        information = prior.root @ prior.root.T
        rows = np.concatenate([6 * place + np.arange(6), 6 * count + np.arange(hinges)])
        expected = np.concatenate([np.zeros(6), prior.q0[7:]])
        pull = information @ expected
        Q[np.ix_(rows, rows)] += information
        g[rows] -= pull
        constant += 0.5 * float(expected @ pull)
        if rooted:
            places[:, place] = prior.q0[:7]
            places[:3, place] -= root_m
            place += 1
    return places, Q, g, constant


@njit(cache=True, nogil=True)
def _bond(together, links, weights):
    """Mark the links of every vertex as sharing it."""
    for i in range(links.shape[0]):
        for a in range(links.shape[1]):
            for b in range(links.shape[1]):
                if weights[i, a] > 0.0 and weights[i, b] > 0.0:
                    together[links[i, a], links[i, b]] = True


@njit(cache=True, nogil=True)
def _add_pairs(Q, g, links, shares, points, observed, roots, weights):
    """Add w_i |A_i (T b_i - p_i)|^2 / 2 of pairs to Q (upper part, t = vec T) and g."""
    constant = 0.0
    b = np.empty(16)
    at = np.empty(16, dtype=np.int64)
    pull = np.empty(3)
    M = np.empty((3, 3))
    for i in range(links.shape[0]):
        if weights[i] == 0.0:
            continue
        A = roots[i]
        for r in range(3):
            for s in range(3):
                M[r, s] = weights[i] * (A[0, r] * A[0, s] + A[1, r] * A[1, s] + A[2, r] * A[2, s])
        count = 0
        for k in range(links.shape[1]):
            w = shares[i, k]
            if w == 0.0:
                continue
            for c in range(4):
                b[count] = w * points[i, k, c] if c < 3 else w
                at[count] = 3 * (4 * links[i, k] + c)
                count += 1
        for r in range(3):
            p = observed[i]
            pull[r] = M[r, 0] * p[0] + M[r, 1] * p[1] + M[r, 2] * p[2]
            constant += 0.5 * pull[r] * p[r]
        for m in range(count):
            for r in range(3):
                g[at[m] + r] -= b[m] * pull[r]
            for n in range(count):
                if at[n] < at[m]:
                    continue
                bb = b[m] * b[n]
                for r in range(3):
                    for s in range(3):
                        Q[at[m] + r, at[n] + s] += bb * M[r, s]
    return constant

# SPDX-License-Identifier: Apache-2.0
"""The kinematic tree as CasADi symbols: link poses as functions of a step from a configuration.

A step is x = (a, w, h): the root moves by a along its own axes and turns by the unit quaternion
of (w / 2, 1), which has no singularity below half a turn; hinges turn by h. The tree is read from
the Pinocchio model once. A person's joint origins are inputs, so that all sizes share one tree.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import Body
from kintrack.errors import ModelError

Symbol = Any
"""A `casadi.SX`; CasADi carries no types."""
LOG_ROUNDING = 1e-8
"""Added to the squared sine of half the angle in `_root_difference`; moves it by less than 1e-8."""


@dataclass(frozen=True)
class Tree:
    """A free-flyer root and hinges, all that does not depend on the person's size."""

    parents: tuple[int, ...]
    """Joint that each hinge hangs on: 0 is the root, k the k-th hinge, counted from 1."""
    axes: tuple[tuple[float, ...], ...]
    """Axis of each hinge, in its own frame."""
    turns: tuple[tuple[float, ...], ...]
    """Rotation of each hinge's frame in its parent's, 3x3 row by row."""
    links: tuple[int, ...]
    """Joint that moves each skin-carrying link, counted as in `parents`."""


def tree_of(body: Body) -> Tree:
    """The tree of a body.

    Raises:
        ModelError: if the root is no free-flyer or another joint is no hinge of one angle.
    """
    model, data = body.model, body.scratch.data
    pin.computeJointJacobians(model, data, pin.neutral(model))
    if model.njoints < 2 or model.joints[1].nq != 7:
        raise ModelError("the symbolic body needs a free-flyer as its first joint")
    columns = []
    for i in range(2, model.njoints):
        joint = model.joints[i]
        column = pin.getJointJacobian(model, data, i, pin.LOCAL)[:, joint.idx_v]
        if joint.nq != 1 or joint.idx_v != i + 4 or column[:3].any():
            raise ModelError(f"joint {model.names[i]!r}: the symbolic body knows hinges only")
        columns.append(column[3:])
    turns = np.array([placement.rotation for placement in list(model.jointPlacements)[2:]])
    return Tree(
        parents=tuple(model.parents[i] - 1 for i in range(2, model.njoints)),
        axes=_tuples(np.round(columns, 12)),
        turns=_tuples(np.round(turns.reshape(-1, 9), 12)),
        links=tuple(int(joint) - 1 for joint in body.link_joints),
    )


def _tuples(rows: Float[ndarray, "n m"]) -> tuple[tuple[float, ...], ...]:
    """An array as something that can be a key."""
    return tuple(tuple(row) for row in rows.tolist())


def joint_origins(body: Body) -> Float[ndarray, "3 h"]:
    """Origin of every hinge in its parent's frame [m], a column each: the person's size."""
    placements = list(body.model.jointPlacements)[2:]
    return np.array([placement.translation for placement in placements]).T


@dataclass(frozen=True)
class SymbolicBody:
    """Expressions in the symbols `step`, `q`, `origins_m` and `places`."""

    step: Symbol
    """x, shape (6 + H,) [m, rad]."""
    q: Symbol
    """Configuration that the step starts from, Pinocchio order, shape (7 + H,)."""
    origins_m: Symbol
    """`joint_origins`, shape (3, H)."""
    places: Symbol
    """Expected root placements, one (x y z, quaternion) a column, shape (7, K)."""
    q_next: Symbol
    """Configuration after the step, shape (7 + H,)."""
    transforms: Symbol
    """3x4 world poses of the links side by side, shape (3, 4 L); a vertex is `transforms @ b`."""
    tangent: Symbol
    """Root differences from the K places, then the hinge angles, shape (6 K + H,) [m, rad]."""


def symbolic_body(tree: Tree, places: int) -> SymbolicBody:
    """Build the expressions.

    Args:
        tree: The kinematic tree.
        places: Number K of expected root placements.

    Returns:
        The body after a step.
    """
    import casadi as ca

    hinges = len(tree.parents)
    step, q = ca.SX.sym("step", 6 + hinges), ca.SX.sym("q", 7 + hinges)
    origins, expected = ca.SX.sym("origins_m", 3, hinges), ca.SX.sym("places", 7, places)
    half = step[3:6] / 2
    turn = ca.vertcat(half, 1) / ca.sqrt(1 + ca.dot(half, half))
    quaternion = _product(q[3:7], turn)
    angles = q[7:] + step[6:]
    R = [_rotation(quaternion)]
    p = [q[:3] + _rotation(q[3:7]) @ step[:3]]
    for k, parent in enumerate(tree.parents):
        frame = R[parent] @ ca.sparsify(ca.DM(np.reshape(tree.turns[k], (3, 3))))
        p.append(p[parent] + R[parent] @ origins[:, k])
        R.append(frame @ _hinge(np.array(tree.axes[k]), angles[k]))
    differences = [
        _root_difference(expected[:, k], p[0], quaternion) for k in range(expected.shape[1])
    ]
    return SymbolicBody(
        step=step,
        q=q,
        origins_m=origins,
        places=expected,
        q_next=ca.vertcat(p[0], quaternion / ca.norm_2(quaternion), angles),
        transforms=ca.horzcat(*[ca.horzcat(R[j], p[j]) for j in tree.links]),
        tangent=ca.vertcat(*differences, angles),
    )


def _hinge(axis: Float[ndarray, 3], angle: Symbol) -> Symbol:
    """Rotation about a constant unit axis (Rodrigues): I + sin [a]x + (1 - cos) [a]x^2."""
    import casadi as ca

    K = np.cross(np.eye(3), axis)
    return ca.sparsify(np.eye(3) + ca.sin(angle) * ca.DM(K) + (1 - ca.cos(angle)) * ca.DM(K @ K))


def _product(a: Symbol, b: Symbol) -> Symbol:
    """Product of quaternions x y z w."""
    import casadi as ca

    vector = a[3] * b[:3] + b[3] * a[:3] + ca.cross(a[:3], b[:3])
    return ca.vertcat(vector, a[3] * b[3] - ca.dot(a[:3], b[:3]))


def _rotation(quaternion: Symbol) -> Symbol:
    """Rotation matrix of a unit quaternion."""
    import casadi as ca

    x, y, z, w = (quaternion[i] for i in range(4))
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        ca.horzcat(2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        ca.horzcat(2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )


def _root_difference(place: Symbol, p: Symbol, quaternion: Symbol) -> Symbol:
    """log(T_place^-1 T) as `pin.difference` has it, linear then angular, shape (6,).

    With the relative rotation's quaternion (v, c) the rotation vector is r = 2 atan2(|v|, c) v/|v|
    and the linear part (I - [r]x / 2 + k [r]x^2) t, k = 1/t^2 - cot(t/2) / (2 t) at t = |r|,
    here by its series (Bernoulli numbers), exact to 1.1e-6 at half a turn and better below.
    """
    import casadi as ca

    inverse = ca.vertcat(-place[3:6], place[6])
    relative = _product(inverse, quaternion)
    relative = relative * ca.if_else(relative[3] < 0, -1, 1)
    v, c = relative[:3], relative[3]
    sine = ca.sqrt(ca.dot(v, v) + LOG_ROUNDING)
    r = 2 * ca.atan2(sine, c) / sine * v
    squared, k, power = ca.dot(r, r), 0.0, 1.0
    for bernoulli in _BERNOULLI:
        k, power = k + bernoulli * power, power * squared
    linear = _rotation(place[3:7]).T @ (p - place[:3])
    once = ca.cross(r, linear)
    return ca.vertcat(linear - once / 2 + k * ca.cross(r, once), r)


_BERNOULLI = (
    1 / 12,
    1 / 720,
    1 / 30240,
    1 / 1209600,
    1 / 47900160,
    691 / 1307674368000,
    1 / 74724249600,
    3617 / 10670622842880000,
)
"""|B_2n| / (2n)! for n = 1, 2, ..."""

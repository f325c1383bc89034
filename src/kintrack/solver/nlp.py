# SPDX-License-Identifier: Apache-2.0
"""The objective as a nonlinear programme for IPOPT: hard joint limits, exact derivatives.

min_x f(x) = 0.5 t^T Q t + g^T t + 0.5 z^T P z + b^T z + c  with  lower <= q(x) <= upper,

t(x) the link poses and z(x) the tangent features of `symbolic_body`. With their Jacobians J and
slopes u = Q t + g, w = P z + b:  grad f = J_t^T u + J_z^T w,  and
hess f = J_t^T Q J_t + J_z^T P J_z + sum_k u_k hess t_k + sum_k w_k hess z_k.
Everything is built once and then serves every frame and every person: a person's size and the
associations are parameters. Nothing is compiled: CasADi's virtual machine takes 0.5 ms for the
Hessian, compiled C 0.4 ms after 8 s in the compiler. Gauss and Newton's half of the Hessian would
spare a third of that and take twice the iterations.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np

from kintrack.solver.nlp_terms import Parameters, pose_pattern
from kintrack.solver.symbolic_body import SymbolicBody, Tree, symbolic_body

Function = Any
"""A `casadi.Function`; CasADi carries no types."""
Symbol = Any
"""A `casadi.MX`."""
Bonds = tuple[tuple[bool, ...], ...]
"""`nlp_terms.bonds`, row by row."""
IPOPT = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-5,
    "mu_strategy": "adaptive",
    "bound_relax_factor": 0.0,
    "warm_start_init_point": "yes",
}
"""Options of IPOPT: silent, limits are never widened, the start is not moved far inside them."""
INTERFACE = {
    "print_time": False,
    "error_on_fail": False,
    "show_eval_warnings": False,
    "calc_lam_p": False,
}
"""Options of CasADi's interface to IPOPT."""


@dataclass(frozen=True)
class Programme:
    """Functions of one tree; their inputs are `step` and the fields of `Parameters`."""

    kinematics: Function
    """(step, q, origins_m) -> (q_next, transforms)."""
    cost: Function
    """-> (cost)."""
    slope: Function
    """-> (cost, slope)."""
    curvature: Function
    """-> (curvature), the upper part of the Hessian."""
    solver: Function
    """IPOPT: (x0, p, lbx, ubx) -> (x, f)."""


@lru_cache(maxsize=8)
def programme(tree: Tree, together: Bonds, places: int, iterations: int) -> Programme:
    """Build the programme of a tree; later calls return the same one.

    Args:
        tree: The kinematic tree.
        together: Links that share vertices.
        places: Number of expected root placements.
        iterations: Interior-point iterations at most.

    Returns:
        The programme.
    """
    import casadi as ca

    body = symbolic_body(tree, places)
    names = ["step", *(field.name for field in fields(Parameters))]
    symbols = _symbols(body, np.array(together), names)
    cost, slope, curvature = _objective(body, *symbols)
    made = {
        "cost": ca.Function("cost", symbols, [cost], names, ["cost"]),
        "slope": ca.Function("slope", symbols, [cost, slope], names, ["cost", "slope"]),
        "curvature": ca.Function("curvature", symbols, [curvature], names, ["curvature"]),
    }
    kinematics = ca.Function(
        "kinematics",
        [body.step, body.q, body.origins_m],
        [body.q_next, body.transforms],
        ["step", "q", "origins_m"],
        ["q_next", "transforms"],
    )
    return Programme(kinematics, **made, solver=_solver(**made, at=symbols, iterations=iterations))


def _symbols(body: SymbolicBody, together: np.ndarray, names: list[str]) -> list[Symbol]:
    """The step and the fields of `Parameters` as matrix symbols."""
    import casadi as ca

    t, z = body.transforms.numel(), body.tangent.numel()
    shapes = {
        "step": body.step.shape,
        "q": body.q.shape,
        "origins_m": body.origins_m.shape,
        "places": body.places.shape,
        "surface_Q": (ca.sparsify(pose_pattern(together).astype(float)).sparsity(),),
        "surface_g": (t, 1),
        "prior_Q": (z, z),
        "prior_g": (z, 1),
        "constant": (1, 1),
    }
    return [ca.MX.sym(name, *shapes[name]) for name in names]


def _objective(body: SymbolicBody, step, q, origins_m, places, Q, g, P, b, constant):
    """Cost, gradient and the upper part of the Hessian by the module's equations."""
    import casadi as ca

    inputs, at = [body.step, body.q, body.origins_m, body.places], [step, q, origins_m, places]
    t, z = ca.vec(body.transforms), body.tangent
    u, w = ca.SX.sym("u", t.numel()), ca.SX.sym("w", z.numel())
    gradient = ca.gradient(ca.dot(u, t) + ca.dot(w, z), body.step)
    bend = ca.triu(ca.jacobian(gradient, body.step, {"symmetric": True}))
    features = ca.Function("features", inputs, [t, z])
    slopes = ca.Function("slopes", [*inputs, u, w], [gradient])
    bends = ca.Function("bends", [*inputs, u, w], [bend])
    jacobians = ca.Function(
        "jacobians", inputs, [ca.jacobian(t, body.step), ca.jacobian(z, body.step)]
    )
    t, z = features(*at)
    u, w = Q @ t + g, P @ z + b
    cost = 0.5 * (ca.dot(t, u + g) + ca.dot(z, w + b)) + constant
    J_t, J_z = jacobians(*at)
    gauss_newton = ca.triu(J_t.T @ (Q @ J_t) + J_z.T @ (P @ J_z))
    return cost, slopes(*at, u, w), gauss_newton + bends(*at, u, w)


def _solver(
    cost: Function, slope: Function, curvature: Function, at: list[Symbol], iterations: int
) -> Function:
    """IPOPT over the step, the packed parameters as its `p`."""
    import casadi as ca

    ends = np.cumsum([0] + [symbol.nnz() for symbol in at[1:]]).tolist()
    x, p = ca.MX.sym("x", at[0].numel()), ca.MX.sym("p", ends[-1])
    parts = zip(ca.vertsplit(p, ends), at[1:], strict=True)
    at = [x, *(ca.sparsity_cast(part, symbol.sparsity()) for part, symbol in parts)]
    scale, nothing = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", 0)
    hessian = ca.Function(
        "nlp_hess_l",
        [x, p, scale, nothing],
        [scale * curvature(*at)],
        ["x", "p", "lam_f", "lam_g"],
        ["triu_hess_gamma_x_x"],
    )
    gradient = ca.Function("nlp_grad_f", [x, p], slope(*at), ["x", "p"], ["f", "grad_f_x"])
    options: dict[str, Any] = {
        **INTERFACE,
        "ipopt": {**IPOPT, "max_iter": iterations},
        "grad_f": gradient,
        "hess_lag": hessian,
    }
    problem: dict[str, Any] = {"x": x, "p": p, "f": cost(*at)}
    return ca.nlpsol("pose", "ipopt", problem, options)

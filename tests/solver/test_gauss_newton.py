# SPDX-License-Identifier: Apache-2.0
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from kintrack.body import run_kinematics
from kintrack.residuals.linearization import Quadratic
from kintrack.residuals.prior import TangentPrior, diagonal_prior
from kintrack.solver.gauss_newton import bounded_step, normal_equations, solve, step_bounds


def problem(seed, n=12, unbounded=3):
    """A random convex quadratic program whose bounds cut in for most components."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(2 * n, n))
    b = 3 * rng.normal(size=2 * n)
    low, high = -rng.uniform(0.0, 0.6, n), rng.uniform(0.0, 0.6, n)
    low[:unbounded], high[:unbounded] = -np.inf, np.inf
    return A, b, low, high


def objective(H, g, x):
    return 0.5 * x @ H @ x + g @ x


@pytest.mark.parametrize("seed", range(40))
def test_the_bounded_step_is_the_optimum(seed):
    A, b, low, high = problem(seed)
    H, g = A.T @ A, -A.T @ b
    x = bounded_step(H, g, low, high)
    expected = lsq_linear(A, b, (low, high), tol=1e-14, max_iter=500).x
    assert objective(H, g, x) <= objective(H, g, expected) + 1e-9 * abs(objective(H, g, expected))
    assert np.allclose(x, expected, atol=1e-5)


@pytest.mark.parametrize("seed", range(40))
def test_the_bounded_step_meets_the_conditions_of_an_optimum(seed):
    A, b, low, high = problem(seed, n=48, unbounded=6)
    H, g = A.T @ A, -A.T @ b
    x = bounded_step(H, g, low, high)
    slope = H @ x + g
    assert (x >= low).all() and (x <= high).all()
    on_low, on_high = x == low, x == high
    tiny = 1e-8 * np.abs(g).max()
    assert (slope[on_low & ~on_high] >= -tiny).all()
    assert (slope[on_high & ~on_low] <= tiny).all()
    assert np.abs(slope[~on_low & ~on_high]).max() <= tiny


def test_without_bounds_the_step_is_newtons():
    A, b, _, _ = problem(7)
    H, g = A.T @ A, -A.T @ b
    free = np.full(12, np.inf)
    assert np.allclose(bounded_step(H, g, -free, free), -np.linalg.solve(H, g))


def test_a_component_whose_bounds_are_both_zero_stays():
    A, b, low, high = problem(8)
    low[5] = high[5] = 0.0
    assert bounded_step(A.T @ A, -A.T @ b, low, high)[5] == 0.0


def test_a_component_is_let_go_of_its_bound_when_the_others_pull_it_back():
    H = np.array([[1.0, 0.9], [0.9, 1.0]])
    g = np.array([-1.0, -0.2])
    x = bounded_step(H, g, np.array([-1.0, -0.3]), np.array([1.0, 0.3]))
    best = min(
        (objective(H, g, np.array([a, b])), a, b)
        for a in np.linspace(-1, 1, 401)
        for b in np.linspace(-0.3, 0.3, 241)
    )
    assert np.allclose(x, best[1:], atol=6e-3)


def test_step_bounds_end_at_the_hinge_limits_and_leave_the_root_free(body, legal_pose):
    q = legal_pose(0)
    low, high = step_bounds(body, q)
    assert np.allclose(q[7:] + low[6:], body.lower[6:])
    assert np.allclose(q[7:] + high[6:], body.upper[6:])
    assert np.isneginf(low[:6]).all() and np.isposinf(high[:6]).all()


def test_a_hinge_slightly_over_its_limit_is_never_pushed_further(body):
    q = body.neutral()
    q[body.dof("l_knee_flexion") + 1] = body.upper[body.dof("l_knee_flexion")] + 1e-6
    low, high = step_bounds(body, q)
    assert (low <= 0).all() and (high >= 0).all()
    assert high[body.dof("l_knee_flexion")] == 0.0


def pull(body, target, sigma=0.1):
    return diagonal_prior(target, np.full(body.nv, sigma))


def test_a_reachable_target_is_reached(body, legal_pose):
    start, target = run_kinematics(body, legal_pose(0)), legal_pose(1)
    solution = solve(body, start, [pull(body, target)], steps=60, damping=1e-3)
    reached = solution.state.joint_positions_world
    assert np.allclose(reached, run_kinematics(body, target).joint_positions_world, atol=1e-4)
    assert solution.cost == pytest.approx(pull(body, target).cost(solution.state))


@pytest.mark.parametrize("seed", range(4))
def test_limits_hold_exactly_and_the_rest_still_arrives(body, legal_pose, seed):
    target = legal_pose(seed)
    beyond = np.random.default_rng(seed).choice(np.arange(7, body.nq), 12, replace=False)
    over = np.random.default_rng(seed).random(12) < 0.5
    limits = np.where(over, body.upper[beyond - 1], body.lower[beyond - 1])
    target[beyond] = limits + np.where(over, 0.7, -0.7)
    start = run_kinematics(body, legal_pose(seed + 50))
    q = solve(body, start, [pull(body, target)], steps=60, damping=1e-3).state.q
    assert (q[7:] >= body.lower[6:] - 1e-12).all() and (q[7:] <= body.upper[6:] + 1e-12).all()
    assert np.allclose(q[beyond], limits, atol=1e-9)
    others = np.setdiff1d(np.arange(7, body.nq), beyond)
    assert np.allclose(q[others], target[others], atol=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_the_cost_never_rises(body, legal_pose, seed):
    state, damping = run_kinematics(body, legal_pose(seed)), 1e-3
    terms = [pull(body, legal_pose(seed + 10)), pull(body, legal_pose(seed + 20), 0.3)]
    costs = [sum(term.cost(state) for term in terms)]
    for _ in range(12):
        solution = solve(body, state, terms, steps=1, damping=damping)
        state, damping = solution.state, solution.damping
        costs.append(sum(term.cost(state) for term in terms))
        assert solution.cost == pytest.approx(costs[-1])
    assert (np.diff(costs) <= 1e-12).all()
    assert costs[-1] < costs[0]


@dataclass(frozen=True)
class Spiteful:
    """A term that wants to move, and gets worse wherever it goes."""

    inner: TangentPrior
    q0: np.ndarray
    asked: list = field(default_factory=list)

    def quadratic(self, state) -> Quadratic:
        return self.inner.quadratic(state)

    def cost(self, state) -> float:
        self.asked.append(state.q)
        return self.inner.cost(run_kinematics(state.body, self.q0)) + 1.0


def test_rejected_steps_raise_the_damping_shorten_and_leave_the_state(body, legal_pose):
    q0 = legal_pose(0)
    term = Spiteful(pull(body, legal_pose(1)), q0)
    start = run_kinematics(body, q0)
    solution = solve(body, start, [term], steps=3, damping=1e-3)
    assert solution.state is start
    assert solution.steps == 0
    assert solution.damping > 1e-3
    lengths = [np.linalg.norm(body.difference(q0, q)) for q in term.asked]
    assert len(lengths) > 1
    assert all(b < a for a, b in zip(lengths, lengths[1:], strict=False))


def test_accepted_steps_lower_the_damping(body, legal_pose):
    start = run_kinematics(body, legal_pose(2))
    solution = solve(body, start, [pull(body, legal_pose(3))], steps=2, damping=1.0)
    assert solution.steps > 0
    assert solution.damping < 1.0


def test_no_more_steps_are_taken_than_allowed(body, legal_pose):
    start = run_kinematics(body, legal_pose(2))
    assert solve(body, start, [pull(body, legal_pose(3))], steps=1, damping=1e-3).steps == 1


def test_normal_equations_are_the_sum_of_the_terms(body, legal_pose):
    state = run_kinematics(body, legal_pose(0))
    terms = [pull(body, legal_pose(k), 0.1 * k) for k in (1, 2, 3)]
    H, g, cost = normal_equations(state, terms)
    parts = [term.quadratic(state) for term in terms]
    assert np.allclose(H, sum(p.H for p in parts))
    assert np.allclose(g, sum(p.g for p in parts))
    assert cost == pytest.approx(sum(p.cost for p in parts))

# SPDX-License-Identifier: Apache-2.0
import logging
import os
import signal
import sys
import threading
from dataclasses import replace

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.config import SolverConfig, TrackerConfig
from kintrack.errors import ConfigError
from kintrack.residuals.prior import diagonal_prior
from kintrack.solver import gauss_newton, ipopt, nlp
from kintrack.solver.choice import SOLVERS
from kintrack.solver.ipopt import minimise, solve
from kintrack.tracker import Tracker
from residual_terms import joints, motion_prior, pose_prior, silhouette, surface

pytest.importorskip("casadi")


def problem(human, legal_pose, seed, inside_rad=0.35):
    """A frame's terms around a hidden pose within the limits, and a start near it."""
    body, rng = human.body, np.random.default_rng(seed)
    q = legal_pose(seed)
    room = np.minimum(inside_rad, 0.4 * (body.upper - body.lower)[6:])
    q[7:] = np.clip(q[7:], body.lower[6:] + room, body.upper[6:] - room)
    hidden = run_kinematics(body, q)
    terms = [kind(human, hidden, rng) for kind in (silhouette, pose_prior)]
    terms += [surface(human, hidden, rng), diagonal_prior(q, np.full(body.nv, 0.3))]
    start = body.integrate(q, rng.normal(0, 0.05, body.nv))
    start[7:] = np.clip(start[7:], body.lower[6:], body.upper[6:])
    return run_kinematics(body, start), terms


def pull(body, target, sigma=0.1):
    return diagonal_prior(target, np.full(body.nv, sigma))


def inside(body, q):
    return (q[7:] >= body.lower[6:]).all() and (q[7:] <= body.upper[6:]).all()


def on_a_limit(body, q, near_rad=1e-3):
    return (q[7:] < body.lower[6:] + near_rad) | (q[7:] > body.upper[6:] - near_rad)


@pytest.mark.parametrize("seed", range(8))
def test_both_solvers_agree_on_the_same_problem(human, legal_pose, seed):
    state, terms = problem(human, legal_pose, seed)
    reference = gauss_newton.solve(human.body, state, terms, 100, 1e-3)
    found = minimise(human.body, state, terms)
    assert found.status == "converged"
    assert found.solution.cost == pytest.approx(reference.cost, rel=0.01)
    assert found.solution.cost <= reference.cost * (1 + 1e-6)
    apart = found.solution.state.joint_positions_world - reference.state.joint_positions_world
    assert not on_a_limit(human.body, reference.state.q).any()
    assert np.linalg.norm(apart, axis=1).max() < 0.002


@pytest.mark.parametrize("seed", range(4))
def test_the_solvers_agree_with_limits_too_where_there_is_one_minimum(body, legal_pose, seed):
    target, rng = legal_pose(seed), np.random.default_rng(seed)
    beyond = rng.choice(np.arange(7, body.nq), 12, replace=False)
    over = rng.random(12) < 0.5
    limits = np.where(over, body.upper[beyond - 1], body.lower[beyond - 1])
    target[beyond] = limits + np.where(over, 0.7, -0.7)
    start = run_kinematics(body, legal_pose(seed + 50))
    q = solve(body, start, [pull(body, target)], 60, 1e-3).state.q
    reference = gauss_newton.solve(body, start, [pull(body, target)], 60, 1e-3).state.q
    assert inside(body, q)
    assert np.allclose(q[beyond], limits, atol=1e-5)
    assert np.abs(body.difference(reference, q)).max() < 1e-3


def test_a_tangle_of_pulls_ends_inside_the_limits_at_no_greater_cost(human, legal_pose):
    body = human.body
    for seed in range(4):
        start, rng = run_kinematics(body, legal_pose(seed)), np.random.default_rng(seed)
        far = joints(human, start, rng)
        far = replace(far, places_world=far.places_world + rng.normal(0, 1.0, (4, 3)))
        terms = [far, motion_prior(human, start, rng), pose_prior(human, start, rng)]
        before = sum(term.cost(start) for term in terms)
        found = minimise(body, start, terms)
        assert found.status == "converged" and inside(body, found.solution.state.q)
        assert on_a_limit(body, found.solution.state.q).any()
        assert found.solution.cost < before
        at_the_end = sum(term.cost(found.solution.state) for term in terms)
        assert found.solution.cost == pytest.approx(at_the_end)


@pytest.mark.parametrize("seed", range(4))
def test_the_end_meets_the_conditions_of_a_minimum_within_limits(human, legal_pose, seed):
    body, rng, q = human.body, np.random.default_rng(seed), legal_pose(seed)
    at_limit = rng.choice(42, 24, replace=False)
    q[7 + at_limit] = np.where(rng.random(42) < 0.5, body.lower[6:], body.upper[6:])[at_limit]
    state = run_kinematics(body, q)
    terms = [kind(human, state, rng) for kind in (surface, pose_prior, joints)]
    end = minimise(body, state, terms).solution.state
    slope = sum(term.quadratic(end).g for term in terms)
    scale = sum(np.abs(term.quadratic(end).g) for term in terms).max()
    low, high = end.q[7:] < body.lower[6:] + 1e-3, end.q[7:] > body.upper[6:] - 1e-3
    assert (low | high).sum() >= 3
    assert np.abs(slope[:6]).max() < 1e-3 * scale
    assert np.abs(slope[6:][~low & ~high]).max() < 1e-3 * scale
    assert (slope[6:][low] > -1e-3 * scale).all() and (slope[6:][high] < 1e-3 * scale).all()


def test_a_start_outside_the_limits_is_brought_inside(body):
    knee = body.dof("l_knee_flexion")
    q = body.neutral()
    q[knee + 1] = body.upper[knee] + 0.5
    found = minimise(body, run_kinematics(body, q), [pull(body, q)])
    assert found.status == "converged"
    assert found.solution.state.q[knee + 1] == pytest.approx(body.upper[knee], abs=1e-5)
    assert inside(body, found.solution.state.q)


def test_a_hinge_whose_limits_meet_stays(body, legal_pose):
    knee = body.dof("r_knee_flexion")
    limits = body.lower.copy(), body.upper.copy()
    for limit in limits:
        limit[knee] = 0.4
    stiff = replace(body, lower=limits[0], upper=limits[1])
    found = minimise(stiff, run_kinematics(stiff, body.neutral()), [pull(stiff, legal_pose(1))])
    assert found.status == "converged"
    assert found.solution.state.q[knee + 1] == pytest.approx(0.4, abs=1e-12)


def test_a_stop_at_the_iteration_limit_keeps_the_best_pose(human, legal_pose, monkeypatch):
    monkeypatch.setattr(ipopt, "LEAST_ITERATIONS", 2)
    body, start = human.body, run_kinematics(human.body, legal_pose(1))
    terms = [pull(body, legal_pose(2)), joints(human, start, np.random.default_rng(0))]
    before = sum(term.cost(start) for term in terms)
    found = minimise(body, start, terms, steps=2)
    assert found.status == "iteration limit"
    assert found.solution.cost <= before and found.solution.steps <= 2
    assert inside(body, found.solution.state.q)


def test_an_end_that_is_worse_than_the_start_is_not_taken(body, legal_pose, monkeypatch):
    state, terms = run_kinematics(body, legal_pose(1)), [pull(body, legal_pose(1))]
    monkeypatch.setattr(ipopt, "_run", lambda *_: ipopt._Run(legal_pose(2), "Solve_Succeeded", 3))
    assert minimise(body, state, terms).solution.state is state


def test_limits_that_cross_are_infeasible_and_the_pose_stays(body, legal_pose):
    elbow = body.dof("l_elbow_flexion")
    upper = body.upper.copy()
    upper[elbow] = body.lower[elbow] - 0.1
    crossed = replace(body, upper=upper)
    state = run_kinematics(crossed, legal_pose(0))
    found = minimise(crossed, state, [pull(body, legal_pose(1))])
    assert found.status == "infeasible" and "l_elbow_flexion" in found.detail
    assert found.solution.state is state


def test_a_term_that_is_not_finite_is_said_and_the_pose_stays(human, legal_pose):
    state = run_kinematics(human.body, legal_pose(0))
    term = surface(human, state, np.random.default_rng(0))
    term.points_world[3, 1] = np.nan
    found = minimise(human.body, state, [term, pull(human.body, legal_pose(0))])
    assert found.status == "not finite" and found.solution.state is state


def test_a_failure_is_logged_once_and_a_success_not(body, legal_pose, monkeypatch, caplog):
    state, terms = run_kinematics(body, legal_pose(1)), [pull(body, legal_pose(2))]
    with caplog.at_level(logging.INFO):
        solve(body, state, terms, 1, 1e-3)
        assert not caplog.records
        monkeypatch.setattr(ipopt, "LEAST_ITERATIONS", 1)
        solve(body, state, terms, 1, 1e-3)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert "iteration limit" in caplog.text


def test_nothing_is_printed_not_even_by_failures(human, legal_pose, monkeypatch, capfd):
    state = run_kinematics(human.body, legal_pose(1))
    terms = [surface(human, state, np.random.default_rng(0)), pull(human.body, legal_pose(2))]
    nlp.programme.cache_clear()
    minimise(human.body, state, terms)
    monkeypatch.setattr(ipopt, "LEAST_ITERATIONS", 1)
    minimise(human.body, state, terms, steps=1)
    printed = capfd.readouterr()
    assert printed.out == "" and printed.err == ""


def test_the_same_problem_ends_at_the_same_bits_whatever_was_solved_before(human, legal_pose):
    state, terms = problem(human, legal_pose, 3)
    first = minimise(human.body, state, terms).solution
    minimise(human.body, *problem(human, legal_pose, 4))
    again = minimise(human.body, state, terms).solution
    assert np.array_equal(first.state.q, again.state.q) and first.cost == again.cost


def test_the_damping_is_handed_on_and_iterations_are_counted(body, legal_pose):
    start = run_kinematics(body, legal_pose(1))
    solution = solve(body, start, [pull(body, legal_pose(2))], 1, 0.125)
    assert solution.damping == 0.125
    assert 1 <= solution.steps <= 60


@pytest.mark.parametrize("delay_s", [0.011, 0.023, 0.037, 0.061])
def test_ctrl_c_is_never_lost_in_a_solve(body, legal_pose, delay_s):
    start, terms = run_kinematics(body, legal_pose(1)), [pull(body, legal_pose(2))]
    minimise(body, start, terms)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(delay_s, os.kill, (os.getpid(), signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt):
            timer.start()
            for _ in range(3000):
                assert minimise(body, start, terms).status == "converged"
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        timer.join()
        signal.signal(signal.SIGINT, before)


def test_it_solves_in_other_threads_too(body, legal_pose):
    start, terms = run_kinematics(body, legal_pose(1)), [pull(body, legal_pose(2))]
    found = []
    worker = threading.Thread(target=lambda: found.append(minimise(body, start, terms)))
    worker.start()
    worker.join()
    assert found[0].status == "converged"


def test_without_casadi_no_tracker_is_set_up_and_the_error_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    Tracker(TrackerConfig())
    with pytest.raises(ConfigError, match=r"kintrack\[ipopt\]"):
        Tracker(TrackerConfig(solver=SolverConfig(method="ipopt")))


def test_solvers_are_found_by_name():
    assert SOLVERS == {"gauss-newton": gauss_newton.solve, "ipopt": solve}

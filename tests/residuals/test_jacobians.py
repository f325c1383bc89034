# SPDX-License-Identifier: Apache-2.0
"""One finite-difference test for every residual term."""

import numpy as np
import pytest
from scipy.linalg import block_diag

from kintrack.body import run_kinematics
from kintrack.human import RESTING_DEG, posed
from kintrack.residuals.linearization import quadratic_of
from kintrack.residuals.prior import diagonal_prior, gaussian_prior
from kintrack.residuals.targets import TargetResidual
from residual_terms import TERMS, pose_prior


@pytest.fixture(params=TERMS, ids=lambda make: make.__name__)
def term(request, human):
    return lambda state, seed: request.param(human, state, np.random.default_rng(seed))


@pytest.mark.parametrize("seed", range(5))
def test_jacobians_agree_with_differences_and_sums_with_rows(
    body, legal_pose, differences, term, seed
):
    frozen_at = run_kinematics(body, legal_pose(seed))
    residual = term(frozen_at, seed)
    q = body.integrate(frozen_at.q, np.random.default_rng(seed).normal(0, 0.05, body.nv))
    state = run_kinematics(body, q)
    r, J, w = residual.linearize(state)
    assert r.shape == w.shape == (len(J),) and J.shape[1] == body.nv
    scale = max(1.0, np.abs(J).max())
    numeric = differences(lambda state: residual.linearize(state).r, q)
    assert np.allclose(J, numeric, atol=1e-6 * scale)
    rows, summed = quadratic_of((r, J, w)), residual.quadratic(state)
    assert np.allclose(summed.H, rows.H, rtol=1e-9, atol=1e-9 * np.abs(rows.H).max())
    assert np.allclose(summed.g, rows.g, rtol=1e-9, atol=1e-9 * np.abs(rows.g).max())
    assert summed.cost == pytest.approx(rows.cost, rel=1e-9)
    assert residual.cost(state) == pytest.approx(0.5 * np.sum(w * r**2), rel=1e-9)


@pytest.mark.parametrize("seed", range(2))
def test_the_gradient_is_that_of_the_cost(body, legal_pose, differences, term, seed):
    state = run_kinematics(body, legal_pose(seed))
    residual = term(state, seed)
    q = body.integrate(state.q, np.full(body.nv, 0.02))
    gradient = residual.quadratic(run_kinematics(body, q)).g
    numeric = differences(residual.cost, q)
    assert np.allclose(gradient, numeric, rtol=1e-4, atol=1e-5 * np.abs(gradient).max())


def test_the_pose_prior_rests_at_the_resting_pose_and_leaves_the_root_free(human, body):
    prior = pose_prior(human, None, None)
    q = posed(body, RESTING_DEG)
    assert prior.cost(run_kinematics(body, q)) == 0.0
    moved = body.integrate(q, np.r_[np.full(6, 0.5), np.zeros(42)])
    assert prior.cost(run_kinematics(body, moved)) == pytest.approx(0.0, abs=1e-18)


def test_one_deviation_from_the_prior_costs_one_half(body):
    sigma = np.full(body.nv, 0.3)
    q = body.neutral()
    moved = body.integrate(q, 0.3 * np.eye(body.nv)[body.dof("l_knee_flexion")])
    assert diagonal_prior(q, sigma).cost(run_kinematics(body, moved)) == pytest.approx(0.5)


def test_a_full_covariance_measures_mahalanobis_distance(body):
    rng = np.random.default_rng(0)
    A = rng.normal(size=(48, 48))
    covariance = block_diag(0.01 * np.eye(6), A[6:, 6:] @ A[6:, 6:].T + np.eye(42))
    v = np.r_[np.zeros(6), rng.normal(0, 0.1, 42)]
    q = body.neutral()
    state = run_kinematics(body, body.integrate(q, v))
    expected = 0.5 * v @ np.linalg.solve(covariance, v)
    assert gaussian_prior(q, covariance).cost(state) == pytest.approx(expected, rel=1e-6)


def test_a_target_within_its_free_distance_does_nothing_and_no_targets_neither(body, legal_pose):
    state = run_kinematics(body, legal_pose(0))
    places = state.joint_positions_world[[3, 6]] + [[0.1, 0, 0], [0, 0.3, 0]]
    near, far = TargetResidual(np.array([3, 6]), places, 0.1, 0.2).linearize(state).r.reshape(2, 3)
    assert not near.any() and np.allclose(far, [0, -0.1, 0])
    none = TargetResidual(np.zeros(0, int), np.zeros((0, 3)), 0.1, 0.2)
    assert none.cost(state) == 0 and not none.quadratic(state).H.any()

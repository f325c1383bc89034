# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import joint_jacobians, run_kinematics
from kintrack.confidence import joint_covariances
from kintrack.config import ConfidenceConfig
from kintrack.human import prior_sigma
from kintrack.joints import JOINT_NAMES
from kintrack.objective_config import PriorConfig, SurfaceConfig
from kintrack.residuals.prior import diagonal_prior
from kintrack.residuals.surface import surface_residual
from kintrack.skin import skinned_vertices, vertex_jacobians, vertex_normals
from kintrack.solver.gauss_newton import normal_equations

KNEE = JOINT_NAMES.index("l_knee")
SEEN = np.ones(len(JOINT_NAMES))


@pytest.fixture(scope="module")
def problem(human, scene):
    """A pose, its covariance, and pairs on every third vertex."""
    q = scene.place({"elbow_flexion": 40})
    state = run_kinematics(human.body, q)
    vertices = skinned_vertices(state, human.skin)
    vertex = np.arange(0, len(vertices), 3)
    points = vertices[vertex] + np.random.default_rng(0).normal(0, 0.01, (len(vertex), 3))
    normals = vertex_normals(vertices, human.skin.faces)
    surface = surface_residual(human.skin, vertex, points, vertices, normals, SurfaceConfig())
    prior = diagonal_prior(q, prior_sigma(human.body, PriorConfig()))
    H, _, _ = normal_equations(state, [surface, prior])
    return state, np.linalg.inv(H + 1e-9 * np.eye(len(H))), surface


def test_without_shared_error_and_floor_it_is_the_solvers_own_covariance(problem):
    state, covariance, surface = problem
    J = joint_jacobians(state)
    found = joint_covariances(state, covariance, surface, SEEN, ConfidenceConfig(0.0, 0.0))
    assert np.allclose(found, J @ covariance @ J.transpose(0, 2, 1))


def test_the_floor_is_added_along_every_axis(problem):
    bare = joint_covariances(*problem, SEEN, ConfidenceConfig(0.0, 0.0))
    floored = joint_covariances(*problem, SEEN, ConfidenceConfig(0.0, 0.02))
    assert np.allclose(floored - bare, 4e-4 * np.eye(3))


def test_a_joint_is_as_much_farther_off_as_less_of_it_is_seen(problem):
    config = ConfidenceConfig(unseen=3.0)
    seen = joint_covariances(*problem, SEEN, config)
    assert np.allclose(joint_covariances(*problem, 0 * SEEN, config), 9.0 * seen)
    assert np.allclose(joint_covariances(*problem, 0.5 * SEEN, config), 4.0 * seen)


def test_a_prediction_has_no_shared_error(problem):
    state, covariance, _ = problem
    J = joint_jacobians(state)
    found = joint_covariances(state, covariance, None, SEEN, ConfidenceConfig(0.5, 0.0))
    assert np.allclose(found, J @ covariance @ J.transpose(0, 2, 1))


def test_the_shared_error_is_what_shifting_the_points_of_each_link_does(problem, human):
    """The first-order answer to a random shift of every link's points, by many draws."""
    state, covariance, surface = problem
    rng, sigma = np.random.default_rng(1), 0.02
    J = vertex_jacobians(state, human.skin, surface.vertex)
    metric = surface.weights[:, None, None] * np.einsum(
        "nki,nkj->nij", surface.roots, surface.roots
    )
    links = human.skin.links[surface.vertex, 0]
    shifts = rng.normal(0, sigma, (4000, len(human.skin.link_names), 3))
    gradient = np.zeros((len(human.skin.link_names), 3, human.body.nv))
    np.add.at(gradient, links, np.einsum("nij,njk->nik", metric, J))
    moved = np.einsum("dli,lik->dk", shifts, gradient) @ covariance
    knees = moved @ joint_jacobians(state)[KNEE].T
    config = ConfidenceConfig(sigma, 0.0)
    own = joint_covariances(state, covariance, surface, SEEN, ConfidenceConfig(0.0, 0.0))[KNEE]
    found = joint_covariances(state, covariance, surface, SEEN, config)[KNEE] - own
    assert np.allclose(np.cov(knees.T), found, atol=0.1 * np.trace(found))

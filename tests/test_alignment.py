# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pinocchio as pin
import pytest

from kintrack.alignment import fit_pose, view_skin
from kintrack.association.observation import Observation, observe
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.errors import AssociationError
from kintrack.geometry import (
    T_LEVEL_WORLD_CAMERA,
    camera_pose,
    invert_rigid,
    transform_points,
)
from kintrack.human import prior_sigma
from kintrack.residuals.prior import diagonal_prior

CONFIG = TrackerConfig()
GATE_M = 0.15
POSES = {
    "standing": {},
    "arms half up": {"shoulder_elevation": 45, "elbow_flexion": 40},
    "a step": {"l_hip_flexion": 35, "l_knee_flexion": 30, "r_hip_flexion": -8},
}


@pytest.fixture(scope="module")
def human(scene):
    """Who is filmed."""
    return scene.human


def weak_prior(human, q):
    return diagonal_prior(q, 3 * prior_sigma(human.body, CONFIG.prior))


def perturbed(body, q, seed):
    rng = np.random.default_rng(seed)
    v = np.r_[rng.normal(0, 0.03, 3), rng.normal(0, 0.05, 3), rng.normal(0, 0.08, body.nv - 6)]
    q = body.integrate(q, v)
    q[7:] = np.clip(q[7:], body.lower[6:], body.upper[6:])
    return q


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("pose", POSES)
def test_the_error_falls_every_round_and_lands_within_a_centimetre(human, scene, pose, seed):
    truth = scene.place(POSES[pose], heading_deg=15.0)
    observation = observe(scene.frame(scene.depth(truth)), 320)
    q = perturbed(human.body, truth, seed)
    priors = [weak_prior(human, q)]
    errors = [scene.errors(truth, scene.joints(q)).mean()]
    assert errors[0] > 0.03
    while errors[-1] > 0.01 and len(errors) < 30:
        q = fit_pose(human, observation, q, priors, T_LEVEL_WORLD_CAMERA, CONFIG, [GATE_M]).state.q
        errors.append(scene.errors(truth, scene.joints(q)).mean())
    assert (np.diff(errors) < 0).all(), errors
    fit = fit_pose(human, observation, q, priors, T_LEVEL_WORLD_CAMERA, CONFIG, [GATE_M] * 12)
    landed = scene.errors(truth, scene.joints(fit.state.q))
    assert landed.mean() < 0.01
    assert np.sort(landed)[-3] < 0.015  # a fingertip or a toe may turn about its own axis
    assert fit.surface.rms_m < 0.008


@pytest.fixture(scope="module")
def standing(human, scene):
    truth = scene.place({"elbow_flexion": 50})
    return truth, observe(scene.frame(scene.depth(truth)), 320)


def fit(human, observation, q, T_world_camera=T_LEVEL_WORLD_CAMERA, gates=(GATE_M,) * 6):
    priors = [weak_prior(human, q)]
    return fit_pose(human, observation, q, priors, T_world_camera, CONFIG, gates)


def test_the_fit_stays_within_the_limits(human, standing):
    truth, observation = standing
    q = fit(human, observation, perturbed(human.body, truth, 5)).state.q
    body = human.body
    assert (q[7:] >= body.lower[6:] - 1e-12).all() and (q[7:] <= body.upper[6:] + 1e-12).all()
    assert np.linalg.norm(q[3:7]) == pytest.approx(1.0)


def test_the_camera_pose_only_moves_the_world(human, scene, standing):
    truth, observation = standing
    T = camera_pose(25.0)
    T[:3, 3] = [0.4, -0.2, 1.7]
    T_new_old = T @ invert_rigid(T_LEVEL_WORLD_CAMERA)
    q = perturbed(human.body, truth, 6)
    level = fit(human, observation, q)
    moved = _moved(human.body, q, T_new_old)
    pitched = fit(human, observation, moved, T)
    expected = transform_points(T_new_old, level.state.joint_positions_world)
    assert np.allclose(pitched.state.joint_positions_world, expected, atol=1e-4)


def _moved(body, q, T_new_old):
    root = pin.SE3(pin.Quaternion(*np.roll(q[3:7], 1)).matrix(), q[:3])
    return np.r_[pin.SE3ToXYZQUAT(pin.SE3(T_new_old) * root), q[7:]]


def test_a_fit_repeats_to_the_bit(human, standing):
    truth, observation = standing
    q = perturbed(human.body, truth, 7)
    a, b = (fit(human, observation, q) for _ in range(2))
    assert a.state.q.tobytes() == b.state.q.tobytes()
    assert a.surface.weights.tobytes() == b.surface.weights.tobytes()


def test_rounds_end_early_once_no_joint_moves(human, standing):
    truth, observation = standing
    started = []
    q = fit(human, observation, truth, gates=(GATE_M,) * 15).state.q
    fit_pose(
        human, observation, q, [weak_prior(human, q)], T_LEVEL_WORLD_CAMERA, CONFIG,
        (GATE_M,) * 15, started.append,
    )  # fmt: skip
    assert 1 <= started.count("solve") < 15


def test_nothing_observed_is_an_association_error(human, standing):
    truth, observation = standing
    nothing = Observation(
        observation.camera, observation.points_camera, np.zeros_like(observation.region)
    )
    with pytest.raises(AssociationError):
        fit(human, nothing, truth)


def test_a_person_out_of_reach_is_an_association_error(human, scene, standing):
    with pytest.raises(AssociationError):
        fit(human, standing[1], scene.place(at=(5.5, 0.0, 0.0)))


def test_the_view_shows_the_skin_in_the_cameras_frame(human, scene, standing):
    truth, observation = standing
    state = run_kinematics(human.body, truth)
    view = view_skin(human, state, invert_rigid(T_LEVEL_WORLD_CAMERA), observation, CONFIG)
    assert np.allclose(view.vertices_camera[:, 2].mean(), 2.8, atol=0.15)
    head, foot = (scene.joints(truth)[i] for i in (4, 12))
    assert head[1] < foot[1]
    pixel = np.rint(scene.camera.project(view.vertices_camera[view.visible])).astype(int)
    depth = observation.points_camera[pixel[:, 1], pixel[:, 0], 2]
    seen = depth > 0
    assert seen.mean() > 0.9
    off = np.abs(depth[seen] - view.vertices_camera[view.visible][seen, 2])
    assert np.percentile(off, 90) < 0.02

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from kintrack.body import Scratch, run_kinematics
from kintrack.errors import ModelError
from kintrack.human import load_human
from kintrack.solver.symbolic_body import joint_origins, symbolic_body, tree_of

ca = pytest.importorskip("casadi")


@pytest.fixture(scope="module")
def symbols(body):
    return symbolic_body(tree_of(body), 1)


@pytest.fixture(scope="module")
def kinematics(symbols):
    s = symbols
    return ca.Function("kinematics", [s.step, s.q, s.origins_m], [s.q_next, s.transforms])


@pytest.fixture(scope="module")
def tangent(symbols):
    s = symbols
    return ca.Function("tangent", [s.step, s.q, s.places], [s.tangent])


def poses(transforms):
    """3x4 link poses one after the other, shape (L, 3, 4)."""
    return np.array(transforms).reshape(3, -1, 4).transpose(1, 0, 2)


@pytest.mark.parametrize("shape", [None, (2.0, -1.0, 1.5)], ids=["average", "another size"])
def test_link_poses_are_pinocchios_after_any_step_of_any_person(kinematics, legal_pose, shape):
    body = load_human(shape=None if shape is None else np.array(shape)).body
    for seed in range(4):
        q, step = legal_pose(seed), np.random.default_rng(seed).normal(0, 0.5, body.nv)
        q_next, transforms = kinematics(step, q, joint_origins(body))
        state = run_kinematics(body, np.array(q_next).ravel())
        assert np.allclose(poses(transforms), state.Ts_world_link[:, :3], atol=1e-12)


def test_no_step_changes_nothing(body, kinematics, legal_pose):
    q = legal_pose(1)
    assert np.allclose(np.array(kinematics(0, q, joint_origins(body))[0]).ravel(), q, atol=1e-15)


def test_small_steps_are_those_of_pinocchio(body, kinematics, legal_pose):
    q, step = legal_pose(2), np.random.default_rng(2).normal(0, 1e-4, body.nv)
    moved = np.array(kinematics(step, q, joint_origins(body))[0]).ravel()
    assert np.allclose(body.difference(q, moved), step, atol=1e-7)


@pytest.mark.parametrize("turn_rad", [0.0, 1e-7, 1e-3, 0.1, 1.0, 3.0, 3.14])
def test_the_root_difference_is_pinocchios(body, tangent, legal_pose, turn_rad):
    q = legal_pose(3)
    axis = np.array([0.48, -0.6, 0.64])
    moved = body.integrate(q, np.concatenate([[0.3, -0.2, 0.1], turn_rad * axis, np.zeros(42)]))
    found = np.array(tangent(0, moved, q[:7])).ravel()
    assert np.allclose(found[:6], body.difference(q, moved)[:6], atol=2e-6)
    assert np.array_equal(found[6:], moved[7:])


def test_a_quaternion_and_its_negative_are_the_same_place(tangent, legal_pose):
    q, place = legal_pose(4), legal_pose(5)[:7]
    other = np.concatenate([place[:3], -place[3:]])
    found = [np.array(tangent(0, q, at)) for at in (place, other)]
    assert np.allclose(*found, atol=1e-12)


def model_of(*joints):
    model = pin.Model()
    parent = 0
    for k, joint in enumerate(joints):
        parent = model.addJoint(parent, joint, pin.SE3.Identity(), f"joint_{k}")
    return model


@pytest.mark.parametrize(
    ("joints", "says"),
    [
        ((pin.JointModelRX(),), "free-flyer"),
        ((pin.JointModelFreeFlyer(), pin.JointModelPZ()), "joint_1"),
        ((pin.JointModelFreeFlyer(), pin.JointModelSpherical()), "joint_1"),
    ],
    ids=["no root", "slider", "ball"],
)
def test_a_body_of_other_joints_is_refused(body, joints, says):
    model = model_of(*joints)
    with pytest.raises(ModelError, match=says):
        tree_of(replace(body, model=model, scratch=Scratch(model)))

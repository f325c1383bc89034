# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import ModelError
from kintrack.human import load_human
from kintrack.shape import (
    checked_shape,
    joint_shape_jacobians,
    load_shape_space,
    vertex_shape_jacobians,
)
from kintrack.skin import skinned_vertices

STEP = 1e-4


@pytest.fixture(scope="module")
def space():
    return load_shape_space()


@pytest.fixture(scope="module")
def person(space):
    return np.random.default_rng(3).normal(size=len(space))


def test_a_person_of_the_space_is_the_one_that_is_loaded(space, person, legal_pose):
    loaded = load_human(shape=person)
    state = run_kinematics(space.body(person), legal_pose(1))
    other = run_kinematics(loaded.body, legal_pose(1))
    assert np.allclose(state.joint_positions_world, other.joint_positions_world, atol=1e-9)
    ours, theirs = (
        skinned_vertices(state, space.bound(person)),
        skinned_vertices(other, loaded.skin),
    )
    assert np.allclose(ours, theirs, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_shape_jacobians_agree_with_differences(space, person, legal_pose, seed):
    q, vertex = legal_pose(seed), np.arange(0, 2800, 31)
    state = run_kinematics(space.body(person), q)
    J_vertex = vertex_shape_jacobians(state, space, vertex)
    J_joint = joint_shape_jacobians(state, space)
    for k in range(len(space)):
        step = STEP * np.eye(len(space))[k]
        ends = []
        for b in (person + step, person - step):
            moved = run_kinematics(space.body(b), q)
            skin = skinned_vertices(moved, space.bound(b))[vertex]
            ends.append((skin, moved.joint_positions_world))
        for J, i in ((J_vertex, 0), (J_joint, 1)):
            numeric = (ends[0][i] - ends[1][i]) / (2 * STEP)
            assert np.allclose(J[..., k], numeric, atol=1e-8)


def test_a_widened_space_moves_vertices_and_no_joint(space, person, legal_pose):
    fields = np.random.default_rng(0).normal(size=(2, len(space.vertices_m), 3))
    wide = space.widened(fields)
    b = np.concatenate([person, [0.01, -0.02]])
    assert len(wide) == len(space) + 2
    assert np.allclose(wide.origins(b), space.origins(person))
    moved = 0.01 * fields[0] - 0.02 * fields[1]
    assert np.allclose(wide.vertices(b) - space.vertices(person), moved)
    state = run_kinematics(wide.body(b), legal_pose(0))
    assert not joint_shape_jacobians(state, wide)[..., -2:].any()


def test_missing_coefficients_are_zero_and_surplus_ones_an_error(space):
    assert checked_shape(space, np.ones(2)).tolist() == [1, 1] + [0] * (len(space) - 2)
    with pytest.raises(ModelError, match="up to 10 finite"):
        checked_shape(space, np.ones(11))

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.joints import JOINT_NAMES
from kintrack.skin import skinned_vertices
from synthesis.motions.motion import RATE_HZ, perform
from synthesis.motions.scripts import MOTIONS

pytestmark = pytest.mark.parametrize("name", list(MOTIONS))


@pytest.fixture(scope="module")
def performed(person):
    motions = {name: perform(person, script()) for name, script in MOTIONS.items()}
    return {
        name: (motion, [run_kinematics(person.body, q) for q in motion.q])
        for name, motion in motions.items()
    }


def test_joint_limits_hold(person, performed, name):
    angles = performed[name][0].q[:, 7:]
    assert np.all(angles >= person.body.lower[6:]) and np.all(angles <= person.body.upper[6:])


def test_the_legs_never_need_their_limits(person, performed, name):
    dofs = [person.body.dof(f"{s}_{j}_flexion") for s in "lr" for j in ("knee", "hip")]
    angles = performed[name][0].q[:, np.array(dofs) + 1]
    assert np.all(angles > person.body.lower[dofs] + 0.01)
    assert np.all(angles < person.body.upper[dofs] - 0.01)


def test_knees_never_bend_backwards(person, performed, name):
    dofs = [person.body.dof(f"{s}_knee_flexion") for s in "lr"]
    assert performed[name][0].q[:, np.array(dofs) + 1].min() > 0.0


def test_a_planted_foot_does_not_slide(person, performed, name):
    motion, states = performed[name]
    for side in "lr":
        link = person.skin.link_names.index(f"{side}_foot")
        place = np.array([state.Ts_world_link[link][:2, 3] for state in states])
        planted = motion.planted[side]
        ends = np.flatnonzero(np.diff(planted.astype(int))) + 1
        for run, standing in zip(np.split(place, ends), np.split(planted, ends), strict=True):
            if standing[0]:
                assert np.ptp(run, axis=0).max() < 0.01


def test_a_rolling_foot_keeps_its_toe_or_heel_in_place(person, performed, name):
    motion, states = performed[name]
    for side in "lr":
        link = person.skin.link_names.index(f"{side}_foot")
        sole = np.array([person.toe[side], person.heel[side]])
        points = np.array(
            [sole @ s.Ts_world_link[link][:3, :3].T + s.Ts_world_link[link][:3, 3] for s in states]
        )
        slip = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=-1)
        on_floor = np.maximum(points[:-1, :, 2], points[1:, :, 2]) < 0.012
        both_down = on_floor.all(axis=1)
        assert np.all(slip[both_down] < 0.01)


def test_nothing_goes_below_the_floor_and_a_foot_always_stands_on_it(person, performed, name):
    for state in performed[name][1][::3]:
        lowest = skinned_vertices(state, person.skin)[:, 2].min()
        assert -0.01 < lowest < 0.005


def test_joints_move_no_faster_than_people_do(performed, name):
    speed = np.abs(np.diff(performed[name][0].q[:, 7:], axis=0)).max() * RATE_HZ
    assert np.degrees(speed) < 500.0


def test_the_body_is_never_jerked(performed, name):
    positions = np.array([state.joint_positions_world for state in performed[name][1]])
    pelvis = positions[:, JOINT_NAMES.index("pelvis")]
    acceleration = np.diff(pelvis, 2, axis=0) * RATE_HZ**2
    assert np.linalg.norm(acceleration, axis=1).max() < 6.0


def test_a_motion_begins_upright_and_looking_along_x(performed, name):
    state = performed[name][1][0]
    head, pelvis = (state.joint_positions_world[JOINT_NAMES.index(j)] for j in ("head", "pelvis"))
    assert head[2] - pelvis[2] > 0.6
    assert state.Ts_world_link[0][0, 0] > 0.99

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial import cKDTree

from kintrack.body import run_kinematics
from kintrack.joints import JOINT_NAMES
from kintrack.skin import skinned_vertices, vertex_normals
from synthesis.motions.actions import act, default_things
from synthesis.motions.motion import RATE_HZ
from synthesis.motions.roaming import ARM_HINGES, roam, roaming
from synthesis.people.person import load_person

ACTIONS, PEOPLE = ("walking", "sitting_and_gesturing", "squatting"), (3, 250, 77)
DURATION_S = 3.4
ARM_LINKS = ("_clavicle", "_upper_arm", "_forearm", "_forearm_distal", "_hand")


def performed(n):
    person = load_person(PEOPLE[n])
    return person, act(ACTIONS[n], person, np.random.default_rng(n), DURATION_S)


@pytest.fixture(scope="module")
def roamed():
    out = []
    for n in range(len(ACTIONS)):
        person, performance = performed(n)
        motion = roam(person, performance.motion, np.random.default_rng(10 + n))
        out.append((person, performance.motion, motion))
    return out


def arm_columns(person):
    return np.array([person.body.dof(f"{side}_{h}") + 1 for side in "lr" for h in ARM_HINGES])


def test_only_the_arms_move_otherwise_and_all_hinges_keep_their_limits(roamed):
    for person, before, after in roamed:
        arms = arm_columns(person)
        others = np.setdiff1d(np.arange(before.q.shape[1]), arms)
        np.testing.assert_array_equal(after.q[:, others], before.q[:, others])
        assert np.abs(after.q[:, arms] - before.q[:, arms]).max() > 1.0
        assert (after.q[:, 7:] >= person.body.lower[6:]).all()
        assert (after.q[:, 7:] <= person.body.upper[6:]).all()


def test_arms_turn_no_faster_than_peoples_do(roamed):
    for _, _, after in roamed:
        assert np.abs(np.diff(after.q[:, 7:], axis=0)).max() * RATE_HZ < 15.0


def test_hands_and_forearms_do_not_go_through_trunk_head_or_legs(roamed):
    for person, _, after in roamed:
        names = person.skin.link_names
        main = person.skin.links[
            np.arange(len(person.skin.links)), person.skin.weights.argmax(axis=1)
        ]
        hand = np.isin(main, [names.index(f"{s}_{n}") for s in "lr" for n in ("forearm", "hand")])
        rest = np.array([not name.endswith(ARM_LINKS) for name in names])[main]
        for q in after.q[::3]:
            skin = skinned_vertices(run_kinematics(person.body, q), person.skin)
            normals = vertex_normals(skin, person.skin.faces)[rest]
            _, nearest = cKDTree(skin[rest]).query(skin[hand])
            outside = ((skin[hand] - skin[rest][nearest]) * normals[nearest]).sum(axis=1)
            assert outside.min() > -0.02


def test_hands_come_to_places_all_round():
    person, performance = performed(0)
    places = []
    for seed in range(24):
        motion = roam(person, performance.motion, np.random.default_rng(seed))
        for q in motion.q[::30]:
            state = run_kinematics(person.body, q)
            T = state.Ts_world_link[person.skin.link_names.index("chest")]
            wrist = state.joint_positions_world[JOINT_NAMES.index("l_wrist")]
            places.append(T[:3, :3].T @ (wrist - T[:3, 3]))
    spread = np.array(places)
    shoulder_m = 0.2
    assert (spread[:, 0] > 0.25).mean() > 0.2
    assert (spread[:, 2] > shoulder_m + 0.1).mean() > 0.1
    assert (spread[:, 2] < -0.15).mean() > 0.1
    assert (spread[:, 1] > 0.45).mean() > 0.1
    assert (spread[:, 1] < 0.0).mean() > 0.05


def test_the_same_draws_give_the_same_motion():
    person, performance = performed(1)
    once, again = (roam(person, performance.motion, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(once.q, again.q)


def test_a_thing_may_be_in_one_hand_and_full_hands_stay_as_they_are():
    person, performance = performed(2)
    things = default_things()
    done = [roaming(person, performance, np.random.default_rng(s), things) for s in range(6)]
    held = [len(p.props) - len(performance.props) for p in done]
    assert set(held) == {0, 1}
    full = next(p for p in done if len(p.props) > len(performance.props))
    assert roaming(person, full, np.random.default_rng(0), things) is full

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.geometry import invert_rigid
from synthesis.motions.actions.frames import pose
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import HandPath, frame_path, in_hand, palm_path, reach
from synthesis.motions.measures import measure
from synthesis.motions.motion import Script, perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.placing import floor_pose, moved
from synthesis.motions.poses import FORWARD, both, keys
from synthesis.objects.thing import Thing

COUNT = 12


@pytest.fixture(scope="module")
def motion(person):
    return perform(person, Script(COUNT / 30.0, keys(start=both(FORWARD))))


def at(chest, side, ahead=0.42, out=0.15, high=0.1):
    outward = 1.0 if side == "l" else -1.0
    return chest @ pose((0.2, -outward, 0.0), (-1.0, 0.0, -0.2), (ahead, outward * out, high))


@pytest.mark.parametrize("side", ["l", "r"])
def test_a_palm_reaches_its_place_and_turns_there(person, motion, side):
    goal = at(frame_path(person, motion, "chest"), side)
    got = palm_path(person, reach(person, motion, [HandPath(side, goal, np.ones(COUNT))]), side)
    assert np.linalg.norm(got[:, :3, 3] - goal[:, :3, 3], axis=1).max() < 0.002
    cosine = 0.5 * (np.einsum("nij,nij->n", got[:, :3, :3], goal[:, :3, :3]) - 1.0)
    assert np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))).max() < 25.0


def test_a_share_of_nothing_leaves_the_arm_as_it_is(person, motion):
    goal = at(frame_path(person, motion, "chest"), "l")
    assert np.array_equal(reach(person, motion, [HandPath("l", goal, np.zeros(COUNT))]).q, motion.q)


def test_reaching_moves_one_arm_only(person, motion):
    goal = at(frame_path(person, motion, "chest"), "l")
    q = reach(person, motion, [HandPath("l", goal, np.ones(COUNT))]).q
    names = list(person.body.model.names)[2:]
    before, after = motion.q[:, 7:], q[:, 7:]
    moves = [name for name, a, b in zip(names, before.T, after.T, strict=True) if (a != b).any()]
    assert moves and all(name.startswith("l_") for name in moves)


def test_a_place_out_of_reach_straightens_the_arm_towards_it_within_limits(person, motion):
    goal = at(frame_path(person, motion, "chest"), "r", ahead=2.0)
    done = reach(person, motion, [HandPath("r", goal, np.ones(COUNT), (0.0, 0.0, 0.0))])
    elbow = person.body.dof("r_elbow_flexion") + 1
    assert np.degrees(done.q[:, elbow]).max() < 35.0
    assert np.all(done.q[:, 7:] >= person.body.lower[6:])
    assert np.all(done.q[:, 7:] <= person.body.upper[6:])
    shoulder = frame_path(person, done, "r_upper_arm")[:, :3, 3]
    way, palm = goal[:, :3, 3] - shoulder, palm_path(person, done, "r")[:, :3, 3] - shoulder
    cosine = (way * palm).sum(1) / np.linalg.norm(way, axis=1) / np.linalg.norm(palm, axis=1)
    assert cosine.min() > 0.97


def test_elbows_stay_outside_the_trunk(person, motion):
    m = measure(person)
    goal = at(
        frame_path(person, motion, "chest"), "l", ahead=m.front(0.0) + 0.06, out=-0.05, high=0
    )
    done = reach(person, motion, [HandPath("l", goal, np.ones(COUNT))])
    to_chest = invert_rigid(frame_path(person, done, "chest"))
    elbow = (to_chest @ frame_path(person, done, "l_forearm"))[:, :2, 3]
    inside = (elbow - [m.middle_x_m, 0.0]) / [m.half_depth_m, m.half_width_m]
    assert np.linalg.norm(inside, axis=1).min() > 1.0


def test_a_thing_in_the_hand_goes_with_the_palm(person, motion):
    T_palm_place, T_thing_place = pose((0, 1, 0), (0, 0, 1), (0.01, 0, 0)), np.eye(4)
    T_thing_place[:3, 3] = 0.1, 0.2, 0.3
    Ts = in_hand(person, motion, "r", T_palm_place, T_thing_place)
    places = Ts @ T_thing_place
    assert np.allclose(places, palm_path(person, motion, "r") @ T_palm_place)


def test_the_palm_faces_the_thigh_when_the_arm_hangs(person):
    hanging = perform(person, Script(1.0 / 30.0, keys()))
    for side, inward in (("l", -1.0), ("r", 1.0)):
        palm = palm_path(person, hanging, side)[0]
        assert palm[1, 0] * inward > 0.8 and palm[2, 2] > 0.8


def test_the_face_turns_to_what_is_looked_at(person, motion):
    place = np.tile([1.5, 1.0, 1.2], (COUNT, 1))
    done = look_at(person, motion, place, np.ones(COUNT))
    head = frame_path(person, done, "head")[-1]
    eyes = frame_path(person, done, "head_center")[-1, :3, 3]
    way = (place[-1] - eyes) / np.linalg.norm(place[-1] - eyes)
    assert np.degrees(np.arccos(head[:3, 0] @ way)) < 12.0
    assert np.array_equal(look_at(person, motion, place, np.zeros(COUNT)).q, motion.q)


def test_a_moved_performance_keeps_things_in_the_hands_and_feet_on_the_floor(person, motion):
    Ts = in_hand(person, motion, "l", np.eye(4), np.eye(4))
    performance = Performance("x", motion, (Prop(Thing("t", None), Ts, True),))
    T = floor_pose(1.0, -2.0, 2.0)
    there = moved(performance, T)
    assert np.allclose(there.props[0].Ts_world_thing, palm_path(person, there.motion, "l"))
    assert np.allclose(there.motion.q[:, 2], motion.q[:, 2])
    assert np.allclose(
        frame_path(person, there.motion, "pelvis"), T @ frame_path(person, motion, "pelvis")
    )

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from kintrack.body import run_kinematics
from kintrack.joints import JOINT_NAMES
from synthesis.motions.contacts import floor_height_m, foot_path, runs, standing
from synthesis.motions.legs import foot_pose, solve_legs
from synthesis.motions.mocap import Clip, load_clip
from synthesis.motions.motion import Motion
from synthesis.motions.pull import Pull
from synthesis.motions.retarget import retarget
from synthesis.motions.targets import BONES
from synthesis.people.person import Person, load_person
from synthesis.people.population import SIDES

DATA = Path(__file__).parents[4] / "shared" / "data" / "mocap"
ROW = {name: k for k, name in enumerate(JOINT_NAMES)}


@pytest.fixture(scope="module")
def tall() -> Person:
    return load_person(2)


@pytest.fixture(scope="module")
def small() -> Person:
    return load_person(38)


@pytest.fixture(scope="module")
def clip(tall) -> Clip:
    """Knee bends with the right arm raised, by a tall person at (1, 2) who looks along -y."""
    body, n = tall.body, 40
    bend = 0.5 - 0.5 * np.cos(np.linspace(0.0, 2.0 * np.pi, n))
    neutral = run_kinematics(body, body.neutral())
    feet = {}
    for side in SIDES:
        x, y, _ = neutral.joint_positions_world[ROW[f"{side}_ankle"]]
        feet[side] = foot_pose(tall, side, np.array([x, y, 0.0]), 0.0, 0.0)
    top = feet["l"].translation[2] - neutral.joint_positions_world[ROW["l_ankle"], 2]
    positions = np.empty((n, len(JOINT_NAMES), 3))
    for k, b in enumerate(bend):
        q = body.neutral()
        q[0], q[2] = -0.10 * b, top - 0.02 - 0.25 * b
        for hinge, angle in (("r_shoulder_elevation", 1.2 * b), ("r_elbow_flexion", 0.2 + b)):
            q[body.dof(hinge) + 1] = angle
        for side in SIDES:
            q[body.dof(f"{side}_knee_flexion") + 1] = 0.5
        q = solve_legs(body, q, feet)
        positions[k] = run_kinematics(body, q).joint_positions_world
    turn = pin.exp3(np.array([0.0, 0.0, -np.pi / 2]))
    return Clip("bend", np.arange(n) / 30.0, JOINT_NAMES, positions @ turn.T + [1.0, 2.0, 0.0])


@pytest.fixture(scope="module")
def copied(tall, clip) -> Motion:
    return retarget(tall, clip)


def joints(person: Person, motion: Motion) -> np.ndarray:
    return np.array([run_kinematics(person.body, q).joint_positions_world for q in motion.q])


def soles(person: Person, motion: Motion, side: str) -> np.ndarray:
    k = person.body.link_names.index(f"{side}_foot")
    Ts = np.array([run_kinematics(person.body, q).Ts_world_link[k] for q in motion.q])
    return np.einsum("nij,pj->npi", Ts[:, :3, :3], person.foot_points[side]) + Ts[:, None, :3, 3]


def assert_stands_well(person: Person, motion: Motion) -> None:
    body = person.body
    assert (motion.q[:, 7:] >= body.lower[6:]).all() and (motion.q[:, 7:] <= body.upper[6:]).all()
    for side in SIDES:
        points = soles(person, motion, side)
        assert points[..., 2].min() > -0.005
        for first, last in runs(motion.planted[side]):
            assert np.ptp(points[first:last], axis=0).max() < 0.005
            assert points[first:last, :, 2].min() < 0.005


def bone_angles_deg(person: Person, motion: Motion, clip: Clip) -> np.ndarray:
    x, ours = joints(person, motion), []
    for parent, child, _ in BONES:
        if not child.endswith(("hand", "foot")):
            bones = [x[:, ROW[child]] - x[:, ROW[parent]], clip.joint(child) - clip.joint(parent)]
            u, v = (b / np.linalg.norm(b, axis=1, keepdims=True) for b in bones)
            ours.append(np.degrees(np.arccos(np.clip((u * v).sum(axis=1), -1.0, 1.0))))
    return np.array(ours)


def turned(clip: Clip) -> Clip:
    back = pin.exp3(np.array([0.0, 0.0, np.pi / 2]))
    return replace(clip, joint_positions_m=clip.joint_positions_m @ back.T)


def test_somebody_who_copies_their_own_motion_moves_the_same(tall, clip, copied):
    assert bone_angles_deg(tall, copied, turned(clip)).max() < 4.0
    origin = clip.joint_positions_m[0, ROW["pelvis"]] * [1.0, 1.0, 0.0]
    wanted = turned(replace(clip, joint_positions_m=clip.joint_positions_m - origin))
    assert np.linalg.norm(joints(tall, copied) - wanted.joint_positions_m, axis=2).mean() < 0.02
    assert_stands_well(tall, copied)
    assert copied.planted["l"].all() and copied.planted["r"].all()


def test_somebody_small_points_their_bones_like_somebody_tall(small, clip):
    motion = retarget(small, clip)
    assert bone_angles_deg(small, motion, turned(clip)).mean() < 3.0
    assert_stands_well(small, motion)
    assert motion.planted["l"].mean() > 0.9


def test_a_motion_starts_at_the_origin_looking_along_x_and_keeps_the_times(clip, copied):
    np.testing.assert_array_equal(copied.times_s, clip.times_s)
    np.testing.assert_allclose(copied.q[0, :2], 0.0, atol=1e-9)
    left = pin.XYZQUATToSE3(copied.q[0, :7]).rotation[:, 1]
    assert left[0] == pytest.approx(0.0, abs=1e-9) and left[1] > 0.9


def test_the_same_clip_gives_the_same_motion_bit_for_bit(tall, clip, copied):
    np.testing.assert_array_equal(retarget(tall, clip).q, copied.q)


def test_a_mirrored_motion_raises_the_other_arm(tall, clip, copied):
    x, y = joints(tall, copied), joints(tall, retarget(tall, clip, mirrored=True))
    raised = len(x) // 2
    assert x[raised, ROW["r_wrist"], 2] - x[raised, ROW["l_wrist"], 2] > 0.3
    swapped = [ROW[{"l": "r", "r": "l"}.get(n[0], n[0]) + n[1:] if n[1] == "_" else n] for n in ROW]
    mirrored = y[:, swapped] * [1.0, -1.0, 1.0]
    assert np.linalg.norm(mirrored - x, axis=2).max() < 0.02


def test_feet_in_the_air_stay_there(tall, clip):
    hanging = clip.joint_positions_m + [0.0, 0.0, 0.6]
    motion = retarget(tall, replace(clip, joint_positions_m=hanging))
    for side in SIDES:
        assert not motion.planted[side].any()
        assert soles(tall, motion, side)[..., 2].min() > 0.4


def test_two_frames_are_enough(tall, clip):
    short = Clip("two", clip.times_s[:2], clip.joint_names, clip.joint_positions_m[:2])
    assert retarget(tall, short).q.shape == (2, tall.body.nq)


def test_a_foot_below_the_floor_is_raised_and_one_that_drifts_gets_a_new_foothold(tall):
    drift = np.linspace(0.0, 0.12, 60)
    raw = [foot_pose(tall, "l", np.array([x, 0.1, 0.0]), 0.0, -0.03) for x in drift]
    none = foot_path(tall, "l", raw, np.zeros(60, dtype=bool), 30.0)
    points = tall.foot_points["l"]
    lowest = [T.translation[2] + (points @ T.rotation[2]).min() for T in none.Ts_world_foot]
    assert min(lowest) > -1e-9 and not none.planted.any()
    path = foot_path(tall, "l", raw, np.ones(60, dtype=bool), 30.0)
    assert len(path.contacts) >= 2
    for first, last in path.contacts:
        places = np.array([T.translation for T in path.Ts_world_foot[first:last]])
        assert np.ptp(places, axis=0).max() < 1e-9
    steps = np.diff([T.translation[0] for T in path.Ts_world_foot])
    assert np.abs(steps).max() < 0.02


def test_a_contact_begins_only_when_slow_and_low_but_outlasts_a_little_speed(clip):
    ball = np.zeros((60, 3))
    ball[:, 0] = np.concatenate([np.linspace(-1.0, 0.0, 20), np.zeros(20), 0.012 * np.arange(20)])
    x = np.repeat(clip.joint_positions_m[:1], 60, axis=0)
    x[:, ROW["l_foot"]] = ball
    stands = standing(Clip("slide", np.arange(60) / 30.0, JOINT_NAMES, x), "l", 0.0)
    assert not stands[:19].any() and stands[21:].all()
    x[:, ROW["l_foot"], 2] = 0.3
    assert not standing(Clip("high", np.arange(60) / 30.0, JOINT_NAMES, x), "l", 0.0).any()


def test_the_floor_is_found_under_calm_feet_and_not_far_from_zero(clip):
    for height in (-0.03, 0.04):
        moved = replace(clip, joint_positions_m=clip.joint_positions_m + [0.0, 0.0, height])
        assert floor_height_m(moved) - floor_height_m(clip) == pytest.approx(height, abs=1e-9)
    far = replace(clip, joint_positions_m=clip.joint_positions_m + [0.0, 0.0, 0.5])
    assert floor_height_m(far) == 0.0


def test_the_pull_on_bones_axes_and_joints_has_the_derivative_of_its_residual(small):
    rng = np.random.default_rng(5)
    body = small.body
    q = body.integrate(body.neutral(), 0.3 * rng.normal(size=body.nv))
    towards = rng.normal(size=(4, 3))
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    pull = Pull(
        (np.array([9, 5]), np.array([10, 6]), towards[:2], np.array([0.1, 0.2])),
        (np.array([0, 2]), np.array([1, 2]), towards[2:], np.array([0.1, 0.3])),
        (np.array([0]), rng.normal(size=(1, 3)), np.array([0.01])),
    )
    r, J, w = pull.linearize(run_kinematics(body, q))
    for k in range(body.nv):
        step = np.zeros(body.nv)
        step[k] = 1e-6
        ends = [
            pull.linearize(run_kinematics(body, body.integrate(q, s * step))).r for s in (1, -1)
        ]
        np.testing.assert_allclose(J[:, k], (ends[0] - ends[1]) / 2e-6, atol=1e-6)
    state = run_kinematics(body, q)
    assert pull.cost(state) == pytest.approx(0.5 * float(r @ (w * r)))
    assert pull.quadratic(state).cost == pytest.approx(pull.cost(state))


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no motion capture in {DATA}")
@pytest.mark.parametrize("name", ["cmu_02_02", "cmu_02_04", "cmu_02_08"])
def test_real_motion_capture_keeps_feet_limits_and_directions(small, name):
    clip = load_clip(DATA / f"{name}.npz")
    n = min(len(clip.times_s), 150)
    clip = Clip(name, clip.times_s[:n], clip.joint_names, clip.joint_positions_m[:n])
    motion = retarget(small, clip)
    assert_stands_well(small, motion)
    assert 0.1 < motion.planted["l"].mean() < 1.0
    yaw = np.arctan2(*(clip.joint("l_hip") - clip.joint("r_hip"))[0, :2])
    heading = pin.exp3(np.array([0.0, 0.0, yaw]))
    facing = replace(clip, joint_positions_m=clip.joint_positions_m @ heading.T)
    assert bone_angles_deg(small, motion, facing).mean() < 4.0

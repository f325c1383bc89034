# SPDX-License-Identifier: Apache-2.0

import numpy as np
import pytest
import trimesh

from kintrack.body import FRAME_OF_JOINT, joint_jacobians, load_body, run_kinematics
from kintrack.errors import ModelError
from kintrack.human import posed
from kintrack.joints import JOINT_NAMES
from kintrack.skin import load_skin, skinned_vertices

POSES = range(5)
PUBLISHED = {
    ("hip", "knee"): 0.245,
    ("knee", "ankle"): 0.246,
    ("shoulder", "elbow"): 0.186,
    ("elbow", "wrist"): 0.146,
}
"""Segment lengths as shares of stature (Drillis & Contini 1966, in Winter 2009, fig. 4.1)."""


@pytest.fixture(scope="module")
def neutral(body):
    state = run_kinematics(body, body.neutral())
    return dict(zip(JOINT_NAMES, state.joint_positions_world, strict=True))


@pytest.fixture(scope="module")
def stature(human):
    state = run_kinematics(human.body, human.body.neutral())
    return np.ptp(skinned_vertices(state, human.skin)[:, 2])


def joints_at(body, degrees):
    state = run_kinematics(body, posed(body, degrees))
    return dict(zip(JOINT_NAMES, state.joint_positions_world, strict=True))


def test_the_body_mass_is_that_of_an_average_adult_of_this_height(body, stature):
    mass = sum(inertia.mass for inertia in body.model.inertias)
    assert mass == pytest.approx(24.0 * stature**2, rel=0.02)


def test_inertias_are_those_of_possible_bodies(body):
    for inertia in list(body.model.inertias)[1:]:
        small, middle, large = np.linalg.eigvalsh(inertia.inertia)
        assert small > 0
        assert large <= (small + middle) * (1 + 1e-6)


def test_the_average_adult_has_an_average_stature(stature):
    assert 1.60 < stature < 1.78


@pytest.mark.parametrize("side", ["l_", "r_"])
@pytest.mark.parametrize(("upper", "lower"), PUBLISHED)
def test_segment_lengths_are_within_a_fifth_of_the_published(neutral, stature, side, upper, lower):
    length = np.linalg.norm(neutral[side + upper] - neutral[side + lower])
    assert length / stature == pytest.approx(PUBLISHED[upper, lower], rel=0.20)


def test_zero_is_standing_with_hanging_arms_facing_forward(neutral):
    for side, sign in (("l", 1), ("r", -1)):
        heights = [neutral[f"{side}_{j}"][2] for j in ("shoulder", "elbow", "wrist", "hand")]
        assert heights == sorted(heights, reverse=True)
        assert sign * neutral[f"{side}_shoulder"][1] > 0.1
        assert neutral[f"{side}_foot"][0] > neutral[f"{side}_ankle"][0] + 0.05
    assert neutral["head"][2] > neutral["neck"][2] > neutral["chest"][2] > neutral["spine"][2] > 0


def test_a_person_can_sit(body):
    p = joints_at(body, {"hip_flexion": 90, "knee_flexion": 90})
    for side in "lr":
        assert p[f"{side}_knee"][2] == pytest.approx(p[f"{side}_hip"][2], abs=0.02)
        assert p[f"{side}_ankle"][0] == pytest.approx(p[f"{side}_knee"][0], abs=0.02)
        assert p[f"{side}_ankle"][2] < p[f"{side}_knee"][2] - 0.35


def test_a_person_can_squat_with_flat_feet(body):
    squat = {"hip_flexion": 115, "knee_flexion": 135, "ankle_dorsiflexion": 35}
    p = joints_at(body, squat)
    foot = run_kinematics(body, posed(body, squat)).Ts_world_link[body.link_names.index("l_foot")]
    lean = np.radians(115 - 135 + 35)
    assert np.arccos(foot[2, 2]) == pytest.approx(abs(lean), abs=1e-3)
    assert p["l_hip"][2] - p["l_ankle"][2] < 0.30


def test_a_person_can_reach_overhead(body):
    p = joints_at(body, {"shoulder_elevation": 165, "clavicle_elevation": 25})
    assert p["l_hand"][2] > p["head"][2] + 0.25
    assert p["r_hand"][2] > p["head"][2] + 0.25


def test_elbows_and_knees_bend_one_way_only(body):
    for name in ("l_elbow_flexion", "r_elbow_flexion", "l_knee_flexion", "r_knee_flexion"):
        k = body.dof(name)
        assert np.radians(-15) <= body.lower[k] <= 0
        assert body.upper[k] > np.radians(130)
    assert joints_at(body, {"knee_flexion": 90})["l_ankle"][0] < -0.3
    assert joints_at(body, {"elbow_flexion": 90})["l_wrist"][0] > 0.2


def test_every_hinge_has_a_finite_range_around_zero(body):
    assert (body.lower[6:] <= 0).all() and (body.upper[6:] >= 0).all()
    assert (body.upper[6:] - body.lower[6:] > np.radians(30)).all()
    assert (body.upper[6:] - body.lower[6:] < np.radians(250)).all()
    assert np.isinf(body.lower[:6]).all() and np.isinf(body.upper[:6]).all()


@pytest.mark.parametrize("seed", POSES)
def test_equal_angles_on_both_sides_give_mirrored_joints(body, seed):
    rng = np.random.default_rng(seed)
    q = body.neutral()
    for name in list(body.model.names)[2:]:
        if name.startswith("l_"):
            for k in (body.dof(name), body.dof("r_" + name[2:])):
                q[k + 1] = np.random.default_rng([seed, body.dof(name)]).uniform(
                    body.lower[k], body.upper[k]
                )
        elif not name.startswith("r_") and name.endswith("flexion"):
            q[body.dof(name) + 1] = rng.uniform(-0.2, 0.2)
    p = dict(zip(JOINT_NAMES, run_kinematics(body, q).joint_positions_world, strict=True))
    for name in JOINT_NAMES:
        other = {"l_": "r_", "r_": "l_"}.get(name[:2], name[:2]) + name[2:]
        assert np.allclose(p[name] * [1, -1, 1], p[other], atol=1e-3), name


def test_limits_are_the_same_on_both_sides(body):
    for name in list(body.model.names)[2:]:
        if name.startswith("l_"):
            left, right = body.dof(name), body.dof("r_" + name[2:])
            assert body.lower[left] == body.lower[right]
            assert body.upper[left] == body.upper[right]


def test_a_dof_supports_exactly_the_links_and_joints_that_it_moves(body, legal_pose):
    q = legal_pose(11)
    rest = run_kinematics(body, q)
    for k in range(body.nv):
        v = np.zeros(body.nv)
        v[k] = 1e-3
        moved = run_kinematics(body, body.integrate(q, v))
        change = np.abs(moved.Ts_world_link - rest.Ts_world_link).max(axis=(1, 2))
        assert np.array_equal(change > 1e-9, body.support[:, k])
        shift = np.linalg.norm(moved.joint_positions_world - rest.joint_positions_world, axis=1)
        assert not (shift[~body.joint_support[:, k]] > 1e-12).any()


@pytest.mark.parametrize("seed", POSES)
def test_joint_jacobians_agree_with_differences(body, legal_pose, differences, seed):
    q = legal_pose(seed)
    numeric = differences(lambda state: state.joint_positions_world, q)
    assert np.allclose(joint_jacobians(run_kinematics(body, q)), numeric, atol=1e-7)


@pytest.mark.parametrize("seed", POSES)
def test_link_motion_agrees_with_differences(body, legal_pose, differences, seed):
    q = legal_pose(seed)
    state = run_kinematics(body, q)
    numeric = differences(lambda state: state.Ts_world_link, q)  # (L, 4, 4, nv)
    lin, ang = state.J_world[:3], state.J_world[3:]
    for link, T in enumerate(state.Ts_world_link):
        velocity = lin + np.cross(ang, T[:3, 3], axis=0)
        spin = np.cross(ang.T[:, :, None], T[None, :3, :3], axis=1).transpose(1, 2, 0)
        moved = body.support[link]
        assert np.allclose(numeric[link, :3, 3], velocity * moved, atol=1e-7)
        assert np.allclose(numeric[link, :3, :3], spin * moved, atol=1e-7)


def test_kinematics_are_copied_out_of_the_work_space(body, legal_pose):
    first = run_kinematics(body, legal_pose(0))
    before = first.Ts_world_link.copy(), first.J_world.copy(), first.joint_positions_world.copy()
    run_kinematics(body, legal_pose(1))
    for kept, now in zip(
        before, (first.Ts_world_link, first.J_world, first.joint_positions_world), strict=True
    ):
        assert np.array_equal(kept, now)


def test_moving_by_the_difference_reaches_the_other_pose(body, legal_pose):
    q0, q1 = legal_pose(0), legal_pose(1)
    reached = run_kinematics(body, body.integrate(q0, body.difference(q0, q1)))
    assert np.allclose(reached.Ts_world_link, run_kinematics(body, q1).Ts_world_link)


def test_an_unknown_hinge_is_answered_with_the_known_ones(body):
    with pytest.raises(ModelError, match="no joint 'l_gill'.*l_knee_flexion"):
        body.dof("l_gill")


def test_every_reported_joint_is_a_frame_of_the_body(body):
    assert set(FRAME_OF_JOINT) == set(JOINT_NAMES)
    names = [body.model.frames[int(frame)].name for frame in body.joint_frames]
    assert names == [FRAME_OF_JOINT[name] for name in JOINT_NAMES]


def height_of(shape):
    body, skin = load_body(shape=shape), load_skin(shape=shape)
    state = run_kinematics(body, body.neutral())
    return np.ptp(skinned_vertices(state, skin)[:, 2]), state.joint_positions_world


def test_the_first_shape_coefficient_is_stature(stature):
    heights = [height_of(np.array([b, 0.0]))[0] for b in (-2.0, -1.0, 0.0, 1.0, 2.0)]
    assert heights == sorted(heights)
    assert heights[2] == pytest.approx(stature, abs=1e-6)
    assert 0.3 < heights[4] - heights[0] < 0.55  # four deviations of about 9 to 10 cm


def test_legs_and_arms_grow_with_stature():
    small, tall = (height_of(np.array([b])) for b in (-1.5, 1.5))
    grown = tall[0] / small[0]
    for upper, lower in PUBLISHED:
        a, b = JOINT_NAMES.index(f"l_{upper}"), JOINT_NAMES.index(f"l_{lower}")
        before, after = (np.linalg.norm(joints[a] - joints[b]) for _, joints in (small, tall))
        assert after / before == pytest.approx(grown, rel=0.15)


def test_further_coefficients_change_build_more_than_stature(stature):
    for k in (1, 2):
        height, _ = height_of(2.0 * np.eye(3)[k])
        assert height == pytest.approx(stature, abs=0.03)


@pytest.mark.parametrize("shape", [None, [2.0], [-2.0], [0.0, 2.0], [0.0, -2.0], [1.0, -1.0, 1.5]])
def test_joint_centres_stay_inside_the_skin_of_any_build(shape):
    shape = None if shape is None else np.array(shape)
    body, skin = load_body(shape=shape), load_skin(shape=shape)
    state = run_kinematics(body, posed(body, {"shoulder_elevation": 30}))
    mesh = trimesh.Trimesh(skinned_vertices(state, skin), skin.faces, process=False)
    inside = mesh.contains(state.joint_positions_world)
    assert [n for n, ok in zip(JOINT_NAMES, inside, strict=True) if not ok] == []

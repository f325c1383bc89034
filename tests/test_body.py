# SPDX-License-Identifier: Apache-2.0
import logging
import shutil
import warnings
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh
import yourdfpy

from kintrack.body import (
    FRAME_OF_JOINT,
    joint_jacobians,
    load_body,
    load_rig,
    run_kinematics,
)
from kintrack.errors import ModelError
from kintrack.human import load_human, posed
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
MASS_SHARES = {
    "thigh": (0.10, 0.16),
    "shank": (0.037, 0.055),
    "foot": (0.010, 0.018),
    "upper_arm": (0.022, 0.034),
    "hand": (0.004, 0.009),
    "head": (0.045, 0.085),
    "pelvis": (0.10, 0.16),
}
"""Shares of body mass that published tables span (Dempster 1955, de Leva 1996)."""


@pytest.fixture(scope="module")
def urdf(model_folder):
    return model_folder / "human.urdf"


@pytest.fixture(scope="module")
def neutral(body):
    state = run_kinematics(body, body.neutral())
    return dict(zip(JOINT_NAMES, state.joint_positions_world, strict=True))


@pytest.fixture(scope="module")
def stature(human):
    state = run_kinematics(human.body, human.body.neutral())
    return np.ptp(skinned_vertices(state, human.skin)[:, 2])


@pytest.fixture
def copied_model(model_folder, tmp_path):
    shutil.copytree(model_folder, tmp_path / "model")
    return tmp_path / "model"


def joints_at(body, degrees):
    state = run_kinematics(body, posed(body, degrees))
    return dict(zip(JOINT_NAMES, state.joint_positions_world, strict=True))


def load_in_pinocchio(path):
    return pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer()).nv - 6


def load_in_yourdfpy(path):
    robot = yourdfpy.URDF.load(
        str(path), build_collision_scene_graph=True, load_collision_meshes=True
    )
    assert len(robot.scene.geometry) == len(load_rig(path.parent).link_names)
    return len(robot.actuated_joints)


def load_in_mujoco(path):
    return mujoco.MjModel.from_xml_path(str(path)).nv


@pytest.mark.parametrize("load", [load_in_pinocchio, load_in_yourdfpy, load_in_mujoco])
def test_the_urdf_loads_everywhere_without_a_warning(
    load, urdf, tmp_path, monkeypatch, capfd, caplog
):
    monkeypatch.chdir(tmp_path)  # where MuJoCo would log its warnings
    with warnings.catch_warnings(), caplog.at_level(logging.WARNING):
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", DeprecationWarning)  # between the readers' own libraries
        assert load(urdf) == 42
    assert caplog.records == []
    assert capfd.readouterr().err == ""
    assert list(tmp_path.iterdir()) == []


def test_the_body_mass_is_that_of_an_average_adult_of_this_height(body, stature):
    mass = sum(inertia.mass for inertia in body.model.inertias)
    assert mass == pytest.approx(24.0 * stature**2, rel=0.02)


@pytest.mark.parametrize("segment", MASS_SHARES)
def test_every_segment_has_a_plausible_share_of_the_mass(body, urdf, segment):
    masses = {
        link.get("name"): float(link.find("inertial/mass").get("value"))
        for link in ElementTree.parse(urdf).iter("link")
        if link.find("inertial") is not None
    }
    low, high = MASS_SHARES[segment]
    for name in (segment, f"l_{segment}", f"r_{segment}"):
        if name in masses:
            assert low < masses[name] / sum(masses.values()) < high, name


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


def test_all_hinges_turn_about_principal_axes(urdf):
    joints = [j for j in ElementTree.parse(urdf).iter("joint") if j.get("type") != "fixed"]
    assert {joint.get("type") for joint in joints} == {"revolute"}
    for joint in joints:
        axis = np.abs([float(x) for x in joint.find("axis").get("xyz").split()])
        assert sorted(axis) == [0, 0, 1], joint.get("name")


def test_every_link_with_skin_can_be_seen_and_touched(urdf, model_folder, body):
    links = {link.get("name"): link for link in ElementTree.parse(urdf).iter("link")}
    assert set(body.link_names) <= set(links)
    for name in body.link_names:
        mesh = links[name].find("visual/geometry/mesh").get("filename")
        assert (model_folder / mesh).is_file()
        shapes = {shape.tag for shape in links[name].iterfind("collision/geometry/*")}
        assert shapes in ({"sphere", "cylinder"}, {"sphere"}), name


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


@pytest.mark.parametrize("frame", ["l_hand_center", "r_shank", "head"])
def test_a_urdf_without_a_needed_frame_names_file_and_frame(copied_model, frame):
    urdf = copied_model / "human.urdf"
    urdf.write_text(urdf.read_text().replace(f'"{frame}"', '"other"'))
    with pytest.raises(ModelError) as caught:
        load_body(copied_model)
    assert str(urdf) in str(caught.value) and frame in str(caught.value)


def test_a_missing_urdf_names_the_file(tmp_path):
    with pytest.raises(ModelError, match="human.urdf") as caught:
        load_body(tmp_path)
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("text", ["", "not xml", "<robot name='x'><link name='a'/>"])
def test_a_broken_urdf_names_the_file(copied_model, text):
    (copied_model / "human.urdf").write_text(text)
    with pytest.raises(ModelError, match="human.urdf"):
        load_body(copied_model)


@pytest.mark.parametrize("name", ["rig.npz", "tracking.npz"])
@pytest.mark.parametrize("damage", ["missing", "empty", "truncated", "text"])
def test_a_broken_array_file_names_the_file(copied_model, name, damage):
    path = copied_model / "skin" / name
    whole = path.read_bytes()
    path.unlink()
    if damage != "missing":
        content = {"empty": b"", "truncated": whole[: len(whole) // 2], "text": b"hello"}
        path.write_bytes(content[damage])
    with pytest.raises(ModelError, match=name):
        load_human(copied_model)


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("rig.npz", "Ts_root_link_bind"),
        ("rig.npz", "extra_names"),
        ("tracking.npz", "weights"),
        ("tracking.npz", "shape_basis_m"),
    ],
)
def test_a_file_without_a_needed_array_names_file_and_array(copied_model, name, array):
    path = copied_model / "skin" / name
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files if key != array}
    np.savez(path, **arrays)
    with pytest.raises(ModelError, match=name) as caught:
        load_human(copied_model)
    assert array in str(caught.value)


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


@pytest.mark.parametrize(
    "shape", [np.zeros(50), np.array([np.nan]), np.array([np.inf, 0]), np.zeros((2, 2))]
)
def test_a_shape_that_the_model_does_not_have_is_refused(shape, model_folder):
    available = len(load_rig(model_folder).explained)
    for load in (load_body, load_skin):
        with pytest.raises(
            ModelError, match=f"(?s)shape = .*up to {available} finite coefficients"
        ):
            load(shape=shape)

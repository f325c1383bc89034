# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pinocchio as pin
import pytest

from kintrack.body import run_kinematics
from kintrack.calibration.measures import height
from kintrack.human import load_human
from kintrack.modelling.limits import flexion_limits
from kintrack.modelling.personal import person_bodies, stl, write_personal_model
from kintrack.modelling.volume import inside_points
from kintrack.shape import load_shape_space
from kintrack.skin import skinned_vertices

HEAVY = np.array([-0.5, 3.0, -2.0, 0, 0, 0, 0, 0, 0, 0], dtype=float)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("person")
    write_personal_model(HEAVY, path)
    return path


def test_the_folder_is_the_person(folder, legal_pose):
    ours, shaped = load_human(folder), load_human(shape=HEAVY)
    q = legal_pose(2)
    a, b = run_kinematics(ours.body, q), run_kinematics(shaped.body, q)
    assert np.allclose(a.joint_positions_world, b.joint_positions_world, atol=1e-5)
    assert np.allclose(skinned_vertices(a, ours.skin), skinned_vertices(b, shaped.skin), atol=1e-4)


def load_in_pinocchio(path):
    return pin.buildModelFromUrdf(str(path)).nv


def load_in_yourdfpy(path):
    import yourdfpy

    robot = yourdfpy.URDF.load(str(path))
    assert len(robot.scene.geometry) >= 21  # every visual mesh is found
    return len(robot.actuated_joints)


def load_in_mujoco(path):
    import mujoco

    return mujoco.MjModel.from_xml_path(str(path)).nv


@pytest.mark.parametrize("load", [load_in_pinocchio, load_in_yourdfpy, load_in_mujoco])
def test_the_personal_urdf_loads_everywhere(folder, load, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert load(folder / "human.urdf") == 42


def test_masses_and_capsules_follow_the_shape(folder):
    heavy = pin.buildModelFromUrdf(str(folder / "human.urdf"), pin.JointModelFreeFlyer())
    average = load_human().body.model
    kg = [sum(inertia.mass for inertia in model.inertias) for model in (heavy, average)]
    assert kg[0] > 1.15 * kg[1]
    space = load_shape_space()
    bodies, mean = person_bodies(space, HEAVY), person_bodies(space, np.zeros(10))
    assert bodies["abdomen"].capsule[2] > 1.1 * mean["abdomen"].capsule[2]
    assert sum(body.mass_kg for body in bodies.values()) == pytest.approx(kg[0], rel=0.001)
    for inertia in list(heavy.inertias)[1:]:
        assert (np.linalg.eigvalsh(inertia.inertia) > 0).all()


def test_flesh_ends_flexion_earlier_and_thin_people_bend_as_published(folder):
    heavy, average = load_human(folder).body, load_human().body
    for hinge in ("l_hip_flexion", "r_knee_flexion", "l_elbow_flexion"):
        assert heavy.upper[heavy.dof(hinge)] <= average.upper[average.dof(hinge)] + 1e-6
    k = heavy.dof("l_hip_flexion")
    assert heavy.upper[k] < average.upper[k] - np.radians(1.0)
    k = heavy.dof("l_wrist_flexion")
    assert heavy.upper[k] == pytest.approx(average.upper[k], abs=1e-6)
    published = {"knee_flexion": 143.0}
    thin = flexion_limits(published, {"knee_flexion": 0.4}, {"knee_flexion": 0.3})
    assert thin["knee_flexion"] == pytest.approx(143.0)
    stout = flexion_limits(published, {"knee_flexion": 0.4}, {"knee_flexion": 0.6})
    expected = 180 - 2 * np.degrees(np.arcsin(1.5 * np.sin(np.radians(37 / 2))))
    assert stout["knee_flexion"] == pytest.approx(expected)
    assert flexion_limits(published, {"knee_flexion": 0.1}, {"knee_flexion": 9.0})[
        "knee_flexion"
    ] == pytest.approx(0.6 * 143)


def test_the_average_person_weighs_and_moves_as_the_model_that_ships(tmp_path):
    write_personal_model(np.zeros(10), tmp_path)
    ours, shipped = load_human(tmp_path).body.model, load_human().body.model
    for a, b in zip(ours.inertias, shipped.inertias, strict=True):
        assert a.mass == pytest.approx(b.mass, rel=0.03)  # the source's finer weights differ
        assert np.allclose(a.lever, b.lever, atol=0.002)
    assert np.allclose(ours.upperPositionLimit[7:], shipped.upperPositionLimit[7:], atol=1e-5)


def test_inside_points_fill_a_ball_and_no_more():
    import trimesh

    ball = trimesh.creation.icosphere(3, 0.1)
    points = inside_points(np.array(ball.vertices), np.array(ball.faces), 0.005)
    assert len(points) * 0.005**3 == pytest.approx(ball.volume, rel=0.01)
    assert np.linalg.norm(points, axis=1).max() < 0.1001
    assert len(np.unique(points.round(6), axis=0)) == len(points)


def test_an_stl_file_is_read_back(tmp_path):
    import trimesh

    box = trimesh.creation.box((0.2, 0.3, 0.4))
    (tmp_path / "box.stl").write_bytes(stl(np.array(box.triangles)))
    again = trimesh.load(tmp_path / "box.stl")
    assert again.is_watertight and again.volume == pytest.approx(0.024)


def test_the_person_is_as_tall_as_measured(folder):
    skin = load_shape_space(None, "display").vertices(HEAVY)
    assert height(HEAVY)[0] == pytest.approx(np.ptp(skin[:, 2]), abs=1e-9)

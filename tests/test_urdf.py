# SPDX-License-Identifier: Apache-2.0
"""The human's URDF, as other programs read it."""

import logging
import warnings
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from kintrack.rig import load_rig

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

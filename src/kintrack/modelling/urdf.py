# SPDX-License-Identifier: Apache-2.0
"""The human as a plain URDF: principal-axis hinges, inertias, capsules, visual meshes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from xml.etree import ElementTree as ET

import numpy as np
from numpy import ndarray

from kintrack.modelling.segments import SegmentBody
from kintrack.modelling.skeleton import JOINT_OF_SEGMENT, LIMIT_MARGIN_DEG, Hinge, Link, links

DUMMY_MASS_KG = 0.001
"""Mass of the bodies between the hinges of one joint, which dynamics engines need above zero."""
EFFORT_NM, VELOCITY_RAD_S = 300.0, 20.0
"""Bounds of human joint torque and speed that no segment exceeds; formal fields of the URDF."""


def _text(values) -> str:
    return " ".join(f"{0.0 if abs(v) < 5e-7 else v:.6f}" for v in values)


def _inertial(link: ET.Element, mass: float, center: ndarray, inertia: ndarray) -> None:
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=_text(center), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=f"{mass:.6f}")
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2)}
    entries["izz"] = (2, 2)
    ET.SubElement(inertial, "inertia", {k: f"{inertia[ij]:.9f}" for k, ij in entries.items()})


def _capsule(link: ET.Element, name: str, capsule: tuple[ndarray, ndarray, float]) -> None:
    """Cylinder and two spheres, which every URDF reader knows, under one name."""
    lower, upper, radius = capsule
    axis = upper - lower
    length = float(np.linalg.norm(axis))
    parts = [("lower", lower), ("upper", upper)] if length > 0 else [("lower", lower)]
    for end, center in parts:
        collision = ET.SubElement(link, "collision", name=f"{name}_capsule_{end}")
        ET.SubElement(collision, "origin", xyz=_text(center), rpy="0 0 0")
        geometry = ET.SubElement(collision, "geometry")
        ET.SubElement(geometry, "sphere", radius=f"{radius:.6f}")
    if length > 0:
        axis = axis / length
        rpy = (0.0, math.acos(np.clip(axis[2], -1, 1)), math.atan2(axis[1], axis[0]))
        collision = ET.SubElement(link, "collision", name=f"{name}_capsule_side")
        ET.SubElement(collision, "origin", xyz=_text(0.5 * (lower + upper)), rpy=_text(rpy))
        geometry = ET.SubElement(collision, "geometry")
        ET.SubElement(geometry, "cylinder", radius=f"{radius:.6f}", length=f"{length:.6f}")


def _hinge_joint(
    robot: ET.Element,
    link: Link,
    hinge: Hinge,
    parent: str,
    child: str,
    xyz: ndarray,
    upper_deg: Mapping[str, float],
) -> None:
    mirror = -1 if link.side < 0 else 1
    prefix = {1: "l_", -1: "r_", 0: ""}[link.side]
    stem = f"{JOINT_OF_SEGMENT[link.segment.name]}_{hinge.name}"
    name = prefix + stem
    joint = ET.SubElement(robot, "joint", name=name, type="revolute")
    yaw = math.radians(hinge.yaw_deg) * mirror
    ET.SubElement(joint, "origin", xyz=_text(xyz), rpy=_text((0, 0, yaw)))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    x, y, z = hinge.axis
    ET.SubElement(joint, "axis", xyz=f"{mirror * x} {y} {mirror * z}")
    ET.SubElement(
        joint,
        "limit",
        lower=f"{math.radians(hinge.lower_deg - LIMIT_MARGIN_DEG):.6f}",
        upper=f"{math.radians(upper_deg.get(stem, hinge.upper_deg) + LIMIT_MARGIN_DEG):.6f}",
        effort=f"{EFFORT_NM:g}",
        velocity=f"{VELOCITY_RAD_S:g}",
    )


def human_urdf(
    Ts_root_link: dict[str, ndarray],
    extra_points: dict[str, tuple[str, ndarray]],
    bodies: dict[str, SegmentBody],
    visuals: dict[str, str],
    upper_deg: Mapping[str, float] | None = None,
) -> str:
    """The URDF text.

    Args:
        Ts_root_link: Bind pose of every link, root frame.
        extra_points: Fixed frames: name -> (link, position in that link's frame [m]).
        bodies: Rigid-body data per link.
        visuals: Mesh file per link, relative to the URDF.
        upper_deg: Hinge without side -> end of its range, where it is not the published one [deg].

    Returns:
        Indented XML.
    """
    robot = ET.Element("robot", name="human")
    for link in links():
        R = Ts_root_link[link.parent][:3, :3].T if link.parent else np.eye(3)
        if link.parent:
            offset = R @ (Ts_root_link[link.name][:3, 3] - Ts_root_link[link.parent][:3, 3])
            parent = link.parent
            for i, hinge in enumerate(link.segment.hinges):
                last = i == len(link.segment.hinges) - 1
                child = link.name if last else f"{link.name}_{hinge.name}"
                if not last:
                    body = ET.SubElement(robot, "link", name=child)
                    _inertial(body, DUMMY_MASS_KG, np.zeros(3), np.eye(3) * 1e-6)
                at = offset if i == 0 else np.zeros(3)
                _hinge_joint(robot, link, hinge, parent, child, at, upper_deg or {})
                parent = child
        body = ET.SubElement(robot, "link", name=link.name)
        data = bodies[link.name]
        _inertial(body, data.mass_kg, data.center_m, data.inertia_kgm2)
        visual = ET.SubElement(body, "visual", name=f"{link.name}_skin")
        ET.SubElement(visual, "origin", xyz="0 0 0", rpy="0 0 0")
        geometry = ET.SubElement(visual, "geometry")
        ET.SubElement(geometry, "mesh", filename=visuals[link.name])
        _capsule(body, link.name, data.capsule)
    for name, (parent, position) in extra_points.items():
        ET.SubElement(robot, "link", name=name)
        joint = ET.SubElement(robot, "joint", name=f"{name}_fixed", type="fixed")
        ET.SubElement(joint, "origin", xyz=_text(position), rpy="0 0 0")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=name)
    ET.indent(robot, "  ")
    return (
        '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"
    )

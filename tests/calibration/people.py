# SPDX-License-Identifier: Apache-2.0
"""A dressed person before a camera in a few poses, and poses that a template was tracked with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from kintrack.association.observation import Observation, observe
from kintrack.body import run_kinematics
from kintrack.clothing import REGIONS, dressed_space
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, PinholeCamera, invert_rigid, transform_points
from kintrack.human import RESTING_DEG, load_human, posed
from kintrack.raster import rasterise
from kintrack.sequence.frame import Frame
from kintrack.shape import load_shape_space
from kintrack.skin import skinned_vertices

CAMERA = PinholeCamera(320, 265, 230.0, 230.0, 160.0, 132.0)
POSES = (
    ({"shoulder_elevation": 70, "elbow_flexion": 30}, 0.0),
    ({"shoulder_elevation": 40, "shoulder_plane": 50, "elbow_flexion": 80}, 25.0),
    ({"hip_flexion": 45, "knee_flexion": 60, "elbow_flexion": 60}, -20.0),
    ({"shoulder_elevation": 120, "elbow_flexion": 20}, 40.0),
    ({"l_hip_flexion": 60, "l_knee_flexion": 80, "shoulder_elevation": 50}, -45.0),
    ({"spine_flexion": 25, "shoulder_elevation": 30, "elbow_flexion": 100}, 10.0),
)
"""Hinges [deg] and heading [deg]; 0 looks at the camera."""


@dataclass(frozen=True)
class Scene:
    """What a calibration gets, and the truth."""

    shape: ndarray
    depths_m: list[ndarray]
    observations: list[Observation]
    qs_template: list[ndarray]
    joints_m: ndarray


def placed(body, degrees, heading_deg, at=(2.8, 0.0, 0.0)) -> ndarray:
    q = posed(body, RESTING_DEG | degrees)
    yaw = np.pi + np.radians(heading_deg)
    q[:3], q[3:7] = at, [0, 0, np.sin(yaw / 2), np.cos(yaw / 2)]
    return q


def seen(vertices_world, faces, labelled) -> tuple[ndarray, ndarray]:
    """Depth and labels of a surface that a noiseless camera sees; nothing else is there."""
    T_camera_world = invert_rigid(T_LEVEL_WORLD_CAMERA)
    depth, face = rasterise(transform_points(T_camera_world, vertices_world), faces, CAMERA)
    depth = np.where(np.isfinite(depth), depth, 0.0).astype(np.float32)
    return depth, np.where(face >= 0, labelled[faces[face, 0]], 0).astype(np.uint8)


def scene_of(shape, worn_m=0.02, poses=POSES, noise_rad=0.05) -> Scene:
    """A person of some shape, evenly dressed, tracked with the template's body."""
    space = load_shape_space()
    b = np.zeros(len(space))
    b[: len(shape)] = shape
    dressed, body = dressed_space(space), space.body(b)
    skin = dressed.bound(np.concatenate([b, np.full(len(REGIONS), worn_m)]))
    rng, template = np.random.default_rng(0), load_human().body
    depths, observations, qs, joints = [], [], [], []
    for degrees, heading in poses:
        q = placed(body, degrees, heading)
        state = run_kinematics(body, q)
        depth, labels = seen(skinned_vertices(state, skin), skin.faces, skin.labels)
        depths.append(depth)
        observations.append(observe(Frame(0, 0.0, CAMERA, depth), 320, labels=labels))
        joints.append(
            transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), state.joint_positions_world)
        )
        q = template.integrate(q, noise_rad * rng.normal(size=template.nv))
        q[7:] = np.clip(q[7:], template.lower[6:], template.upper[6:])
        qs.append(q)
    return Scene(b, depths, observations, qs, np.array(joints))

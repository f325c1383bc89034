# SPDX-License-Identifier: Apache-2.0
"""A person who waves 2.8 m in front of a small level camera, and the depth images of it."""

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from kintrack.body import load_body, run_kinematics
from kintrack.geometry import (
    T_LEVEL_WORLD_CAMERA,
    PinholeCamera,
    invert_rigid,
    transform_points,
)
from kintrack.raster import rasterise
from kintrack.sequence import Frame
from kintrack.skin import load_skin, skinned_vertices

CAMERA = PinholeCamera(width=160, height=120, fx=120.0, fy=120.0, cx=79.5, cy=59.5)
BODY = load_body()
SKIN = load_skin("tracking")


@dataclass(frozen=True)
class Shot:
    frame: Frame
    q: ndarray
    vertices: ndarray  # camera frame
    joints: ndarray  # camera frame


def shoot(index: int) -> Shot:
    q = BODY.neutral()
    q[:3] = 2.8, 0.0, -0.05
    q[3:7] = 0.0, 0.0, 1.0, 0.0
    q[BODY.dof("r_shoulder_elevation") + 1] = 0.8 + 0.5 * np.sin(index / 4)
    state = run_kinematics(BODY, q)
    T_camera_world = invert_rigid(T_LEVEL_WORLD_CAMERA)
    vertices = transform_points(T_camera_world, skinned_vertices(state, SKIN))
    joints = transform_points(T_camera_world, state.joint_positions_world)
    depth, _ = rasterise(vertices, SKIN.faces, CAMERA)
    depth_m = np.where(np.isfinite(depth), depth, 0.0).astype(np.float32)
    return Shot(Frame(index, index / 30, CAMERA, depth_m), q, vertices, joints)

# SPDX-License-Identifier: Apache-2.0
"""Depth and true part labels of posed tracking skins, for the tests of what needs labels."""

import numpy as np

from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.raster import rasterise
from kintrack.skin import skinned_vertices

WALL_M = 4.5


def labelled(scene, *qs, things=(), wall_m=WALL_M):
    """Observation of people before a wall; `things` are depth images of what is not a person."""
    shape = (scene.camera.height, scene.camera.width)
    depth, labels = np.full(shape, wall_m), np.zeros(shape, dtype=np.uint8)
    for q in qs:
        state = run_kinematics(scene.human.body, q)
        vertices = transform_points(
            invert_rigid(T_LEVEL_WORLD_CAMERA), skinned_vertices(state, scene.human.skin)
        )
        z, face = rasterise(vertices, scene.human.skin.faces, scene.camera)
        part = scene.human.skin.labels[scene.human.skin.faces[face, 0]]
        labels = np.where(z < depth, part, labels)
        depth = np.minimum(depth, z)
    for thing in things:
        nearer = (thing > 0) & (thing < depth)
        labels[nearer] = 0
        depth = np.where(nearer, thing, depth)
    return observe(scene.frame(depth.astype(np.float32)), 320, labels=labels)


def board(scene, z_m, columns, rows):
    """Depth of a board that fills some columns and rows of the image."""
    depth = np.zeros((scene.camera.height, scene.camera.width))
    depth[rows[0] : rows[1], columns[0] : columns[1]] = z_m
    return depth


def world_joints(scene, q):
    return run_kinematics(scene.human.body, q).joint_positions_world

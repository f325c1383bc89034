# SPDX-License-Identifier: Apache-2.0
"""A person with a fold of 1 cm across the chest, filmed without noise."""

from dataclasses import replace

import numpy as np

from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.deformation.relief import relief_of
from kintrack.deformation.surface import followed, met
from kintrack.deformation_config import DeformationConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.raster import rasterise
from kintrack.skin import skinned_vertices, vertex_normals

FOLD_M = 0.01
CONFIG = DeformationConfig(enabled=True)
T_CAMERA_WORLD = invert_rigid(T_LEVEL_WORLD_CAMERA)
TORSO = 2


def fold_of(human):
    """Offsets of a round bump in the middle of the chest, 8 cm wide at half height [m]."""
    state = run_kinematics(human.body, human.body.neutral())
    vertices = skinned_vertices(state, human.skin)
    front = vertices[(human.skin.labels == TORSO) & (vertices[:, 0] > 0)]
    middle = front[np.argmax(front[:, 0] - np.abs(front[:, 1]))]
    return FOLD_M * np.exp(-((vertices - middle) ** 2).sum(axis=1) / (2 * 0.034**2))


def wearing(human, offsets_m):
    return replace(human, skin=relief_of(human.body, human.skin).raised(offsets_m))


def labels_of(scene, q, human):
    """True label of every pixel, 0 where the person is not."""
    vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
    _, index = rasterise(transform_points(T_CAMERA_WORLD, vertices), human.skin.faces, scene.camera)
    labels = human.skin.labels[human.skin.faces[index, 0]].astype(np.uint8)
    return np.where(index >= 0, labels, 0).astype(np.uint8)


def seen(scene, q, human, labels=None):
    return observe(scene.frame(scene.depth(q, human)), 320, labels=labels)


def learnt(human, observations, state, config=CONFIG, surface=None, begin_s=0.0):
    """The surface after some observations of one pose, 30 a second."""
    surface = met(None, human, config) if surface is None else surface
    for n, observation in enumerate(observations):
        surface = followed(surface, state, observation, T_CAMERA_WORLD, begin_s + n / 30.0, config)
    return surface


def towards_camera(human, state):
    """Vertices on the camera's side."""
    vertices = skinned_vertices(state, human.skin)
    return vertex_normals(vertices, human.skin.faces)[:, 0] < -0.5

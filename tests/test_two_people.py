# SPDX-License-Identifier: Apache-2.0
"""Whom the tracker stays with while somebody else is in view."""

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.raster import rasterise
from kintrack.skin import skinned_vertices
from kintrack.tracker import Tracker

WALL_M = 5.0
CROSSING, GONE, BACK = 12, 15, 8
"""Frames in which the other one crosses, the person is gone, and is back."""


def own_pose(scene, index):
    return scene.place({"r_elbow_flexion": 20 + 2 * index}, at=(2.6, 0.02 * index, 0.0))


def other_pose(scene, index):
    """Walks from her left to her right behind her, and waits there."""
    return scene.place(heading_deg=90.0, at=(3.6, max(1.1 - 0.16 * index, -0.9), 0.0))


def filmed(scene, index, *poses):
    """Depth of some people before a wall, and their labels."""
    skin, shape = scene.human.skin, (scene.camera.height, scene.camera.width)
    depth, labels = np.full(shape, WALL_M, np.float32), np.zeros(shape, np.uint8)
    for q in poses:
        vertices = skinned_vertices(run_kinematics(scene.human.body, q), skin)
        points = transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), vertices)
        z, face = rasterise(points, skin.faces, scene.camera)
        nearer = (face >= 0) & (z < depth)
        depth[nearer] = z[nearer]
        labels[nearer] = skin.labels[skin.faces[face[nearer], 0]]
    return scene.frame(depth, index), labels


class Film:
    def __init__(self, labels):
        self.labels = labels

    def segment(self, frame, region=None):
        return self.labels[frame.index]


@pytest.fixture(scope="module")
def film(scene):
    return [
        filmed(
            scene,
            n,
            *([] if CROSSING <= n < CROSSING + GONE else [own_pose(scene, min(n, CROSSING))]),
            other_pose(scene, n),
        )
        for n in range(CROSSING + GONE + BACK)
    ]


@pytest.fixture(scope="module")
def results(scene, film, unsized):
    frames = [frame for frame, _ in film]
    tracker = Tracker(unsized, segmenter=Film([labels for _, labels in film]))
    first = tracker.begin(frames[0], scene.joints(own_pose(scene, 0)))
    return [first, *(tracker.step(frame) for frame in frames[1:])]


def test_she_is_followed_while_another_crosses_behind_her(scene, results):
    for n, result in enumerate(results[:CROSSING]):
        assert result.status == "tracking"
        assert scene.errors(own_pose(scene, n), result.joint_positions_camera_m).mean() < 0.03


def test_who_stands_by_is_not_taken_for_her_once_she_is_gone(scene, results):
    while_gone = results[CROSSING : CROSSING + GONE]
    assert while_gone[-1].status == "lost"
    for n, result in enumerate(while_gone, start=CROSSING):
        other = scene.joints(other_pose(scene, n))
        if result.status == "tracking":
            away = np.linalg.norm(result.joint_positions_camera_m - other, axis=1)
            assert away.mean() > 0.5


def test_she_is_found_again_beside_the_other(scene, results):
    result = results[-1]
    assert result.status == "tracking"
    q = own_pose(scene, CROSSING)
    assert scene.errors(q, result.joint_positions_camera_m).mean() < 0.05

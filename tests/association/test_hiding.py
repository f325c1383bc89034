# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.hiding import hidden_vertices
from kintrack.association.observation import Observation
from kintrack.geometry import PinholeCamera

CAMERA = PinholeCamera(64, 48, 60.0, 60.0, 31.5, 23.5)
ARM, TORSO = 4, 2
AT_M = 2.0
"""Depth of the vertex in the middle of the image [m]."""


def hidden(depth_m, label, has_background=True, part=ARM):
    """Whether a vertex is hidden in an image of one depth and one label."""
    points = CAMERA.back_project(np.full((48, 64), depth_m))
    labels = np.full((48, 64), label, dtype=np.uint8)
    region = (labels > 0) & (points[..., 2] > 0)
    observation = Observation(CAMERA, points, region, has_background, labels)
    vertex = np.array([[0.0, 0.0, AT_M]])
    return bool(
        hidden_vertices(observation, vertex, np.ones(1, bool), np.array([part], np.uint8), 0.05)[0]
    )


@pytest.mark.parametrize(
    ("depth_m", "label", "expected"),
    [(1.5, 0, True), (1.98, 0, False), (3.0, 0, False), (2.0, ARM, False), (1.5, TORSO, True)],
    ids=["object before it", "as far", "past it", "the arm itself", "the trunk before it"],
)
def test_a_vertex_is_hidden_by_what_is_clearly_nearer_and_not_its_own_part(
    depth_m, label, expected
):
    assert hidden(depth_m, label) is expected


def test_its_own_part_in_front_is_a_wrong_pose_and_hides_nothing():
    assert not hidden(1.5, ARM)


@pytest.mark.parametrize("has_background", [True, False])
def test_a_ray_without_reading_hides_only_where_a_room_was_recorded(has_background):
    assert hidden(0.0, 0, has_background) is has_background


def test_nothing_is_hidden_without_labels_nor_what_is_not_visible():
    points = CAMERA.back_project(np.full((48, 64), 1.0))
    plain = Observation(CAMERA, points, np.ones((48, 64), bool), True)
    vertex, part = np.array([[0.0, 0.0, AT_M]]), np.array([ARM], np.uint8)
    assert not hidden_vertices(plain, vertex, np.ones(1, bool), part, 0.05)[0]
    labelled = replace(plain, labels=np.zeros((48, 64), np.uint8))
    assert not hidden_vertices(labelled, vertex, np.zeros(1, bool), part, 0.05)[0]
    assert hidden_vertices(labelled, vertex, np.ones(1, bool), part, 0.05)[0]

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.observation import Observation
from kintrack.association.silhouette import outside_pairs, silhouette
from kintrack.geometry import PinholeCamera

CAMERA = PinholeCamera(80, 60, 100.0, 100.0, 40.0, 30.0)
DEPTH_M = 2.0


@pytest.fixture
def column() -> Observation:
    """A column 20 pixels wide at 2 m, nothing around it."""
    depth = np.zeros((60, 80))
    depth[:, 30:50] = DEPTH_M
    points = CAMERA.back_project(depth)
    return Observation(CAMERA, points, points[..., 2] > 0)


def vertex_at(u, v, z=DEPTH_M):
    return np.array([[(u - CAMERA.cx) / CAMERA.fx * z, (v - CAMERA.cy) / CAMERA.fy * z, z]])


def pairs(observation, vertices, tolerance_m=0.02, gate_m=0.4):
    visible = np.ones(len(vertices), dtype=bool)
    shape = silhouette(observation)
    return outside_pairs(shape, observation, vertices, visible, tolerance_m, gate_m)


def test_a_vertex_beside_the_person_is_drawn_to_the_nearest_pixel_at_its_own_depth(column):
    found = pairs(column, vertex_at(60, 25))
    assert found.vertex.tolist() == [0]
    assert np.allclose(found.points_camera, vertex_at(49, 25))


def test_a_vertex_on_the_person_or_within_the_tolerance_is_left_alone(column):
    vertices = np.concatenate([vertex_at(40, 25), vertex_at(50, 25)])
    assert len(pairs(column, vertices, tolerance_m=0.021).vertex) == 0
    assert pairs(column, vertices, tolerance_m=0.019).vertex.tolist() == [1]


def test_a_vertex_beyond_the_gate_is_left_alone(column):
    assert len(pairs(column, vertex_at(75, 25), gate_m=0.4).vertex) == 0


def test_a_hidden_vertex_is_left_alone(column):
    vertices = vertex_at(60, 25)
    found = outside_pairs(silhouette(column), column, vertices, np.zeros(1, dtype=bool), 0.02, 0.4)
    assert len(found.vertex) == 0


def test_an_empty_pixel_says_nothing_where_there_is_a_background(column):
    assert len(pairs(replace(column, has_background=True), vertex_at(60, 25)).vertex) == 0


def test_dark_cloth_without_readings_may_be_where_skin_belongs(column):
    points = column.points_camera.copy()
    points[:, 55:] = CAMERA.back_project(np.full((60, 80), 4.0))[:, 55:]
    room = replace(column, points_camera=points, has_background=True)
    found = pairs(room, vertex_at(60, 25))
    assert np.allclose(found.points_camera, vertex_at(54, 25))


@pytest.mark.parametrize(("depth_m", "count"), [(3.0, 1), (1.0, 0)])
def test_only_a_pixel_that_looks_past_the_vertex_is_evidence(column, depth_m, count):
    depth = column.points_camera[..., 2].copy()
    depth[:, 50:] = depth_m
    seen = replace(column, points_camera=CAMERA.back_project(depth), has_background=True)
    assert len(pairs(seen, vertex_at(60, 25)).vertex) == count


def test_a_vertex_may_also_go_behind_something_nearer(column):
    depth = column.points_camera[..., 2].copy()
    depth[:, 62:66] = 1.0
    seen = replace(column, points_camera=CAMERA.back_project(depth))
    assert np.allclose(pairs(seen, vertex_at(60, 25)).points_camera, vertex_at(62, 25))


def test_nobody_in_the_region_gives_no_pairs(column):
    nobody = replace(column, region=np.zeros((60, 80), dtype=bool))
    assert len(pairs(nobody, vertex_at(60, 25)).vertex) == 0

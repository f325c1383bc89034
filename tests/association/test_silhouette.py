# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.observation import Observation
from kintrack.association.silhouette import outside_pairs
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
    return outside_pairs(observation, vertices, visible, tolerance_m, gate_m)


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
    found = outside_pairs(column, vertices, np.zeros(1, dtype=bool), 0.02, 0.4)
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


def in_a_room(column, depth_m, columns):
    """The column, labelled, before a wall at 4 m, with something else in some columns."""
    depth = column.points_camera[..., 2].copy()
    depth[depth == 0] = 4.0
    depth[:, columns] = depth_m
    labels = np.zeros(depth.shape, dtype=np.uint8)
    labels[:, 30:50] = 5
    points = CAMERA.back_project(depth)
    return Observation(CAMERA, points, labels > 0, has_background=True, labels=labels)


def test_a_vertex_before_something_near_goes_behind_it_along_its_ray(column):
    room = in_a_room(column, 2.15, slice(50, 80))
    found = pairs(room, vertex_at(65, 25))
    assert np.allclose(found.points_camera, vertex_at(65, 25, 2.15))


def test_a_vertex_between_two_ways_takes_the_shorter(column):
    room = in_a_room(column, 2.15, slice(50, 80))
    assert np.allclose(pairs(room, vertex_at(52, 25)).points_camera, vertex_at(49, 25))
    room = in_a_room(column, 3.9, slice(50, 80))
    assert np.allclose(pairs(room, vertex_at(60, 25)).points_camera, vertex_at(49, 25))


@pytest.mark.parametrize("nearer_m", [1.2, 1.9])
def test_what_hides_a_vertex_need_not_be_nearer_than_all_of_the_person(column, nearer_m):
    room = in_a_room(column, nearer_m, slice(62, 66))
    room.points_camera[:5, 30:50, 2] = 1.5  # a hand held out
    assert np.allclose(pairs(room, vertex_at(60, 25)).points_camera, vertex_at(62, 25))


def test_the_nearest_pixel_is_that_of_a_search_of_all(column):
    rng = np.random.default_rng(0)
    depth = rng.choice([0.0, 1.0, 2.5, 4.0], size=(60, 80), p=[0.02, 0.02, 0.5, 0.46])
    labels = (rng.random(depth.shape) < 0.01).astype(np.uint8) * 3
    points = CAMERA.back_project(depth)
    seen = Observation(CAMERA, points, (labels > 0) & (depth > 0), True, labels)
    u, v = rng.integers(5, 75, 50), rng.integers(5, 55, 50)
    vertices = np.concatenate([vertex_at(a, b, 2.0) for a, b in zip(u, v, strict=True)])
    allowed = seen.region | (depth == 0) | (depth < 2.0)
    rows, columns = np.nonzero(allowed)
    found = pairs(seen, vertices, tolerance_m=0.0)
    assert len(found.vertex) > 20
    for n, point in zip(found.vertex, found.points_camera, strict=True):
        least = np.hypot(rows - v[n], columns - u[n]).min() * 2.0 / CAMERA.fx
        back = depth[v[n], u[n]] - 2.0
        moved = np.linalg.norm(point - vertices[n])
        along = np.linalg.norm(vertex_at(u[n], v[n], 2.0 + back) - vertices[n])
        assert moved == pytest.approx(least if least <= back else along)

# SPDX-License-Identifier: Apache-2.0
import multiprocessing
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.observation import Observation, observe
from kintrack.association.window import MAX_HALF_WINDOW, associate, sample_region
from kintrack.body import run_kinematics
from kintrack.geometry import (
    T_LEVEL_WORLD_CAMERA,
    PinholeCamera,
    invert_rigid,
    transform_points,
)
from kintrack.skin import skinned_vertices

CAMERA = PinholeCamera(64, 48, 60.0, 61.0, 31.5, 23.5)
GATE_M = 0.12
"""At 1.2 m this is a window of 6 px each side, below `MAX_HALF_WINDOW`: nothing is skipped."""
HARD = 10.0
ANY = np.ones(400, dtype=np.uint8)
"""Labels of the vertices; they count only where the observation is labelled."""


@pytest.fixture(scope="module")
def cloud():
    rng = np.random.default_rng(0)
    points = CAMERA.back_project(1.5 + 0.2 * rng.random((48, 64)))
    return Observation(CAMERA, points, rng.random((48, 64)) > 0.2)


@pytest.fixture(scope="module")
def vertices():
    return np.random.default_rng(1).uniform([-0.9, -0.7, 1.2], [0.9, 0.7, 1.9], (400, 3))


def nearest_in_window(observation, vertex, gate_m):
    """Slow and plain: every pixel of the square window around the projection."""
    camera = observation.camera
    u, v = np.floor(camera.project(vertex) + 0.5).astype(int)
    half = int(np.ceil(camera.fx * gate_m / vertex[2]))
    assert half <= MAX_HALF_WINDOW
    best, best_distance = None, gate_m
    for row in range(max(0, v - half), min(camera.height, v + half + 1)):
        for column in range(max(0, u - half), min(camera.width, u + half + 1)):
            point = observation.points_camera[row, column]
            distance = np.linalg.norm(point - vertex)
            if observation.region[row, column] and distance < best_distance:
                best, best_distance = point, distance
    return best


def test_every_vertex_takes_the_nearest_point_in_its_window(cloud, vertices):
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(cloud, vertices, seen, GATE_M, GATE_M, pixel_pairs=0, vertex_labels=ANY)
    found = dict(zip(pairs.vertex, pairs.points_camera, strict=True))
    assert pairs.from_skin == len(found) > 50
    for i, vertex in enumerate(vertices):
        expected = nearest_in_window(cloud, vertex, GATE_M)
        assert (i in found) == (expected is not None)
        if expected is not None:
            assert np.allclose(found[i], expected)


def test_every_sampled_pixel_takes_the_nearest_visible_vertex(cloud, vertices):
    seen = np.random.default_rng(2).random(len(vertices)) > 0.4
    pairs = associate(cloud, vertices, seen, GATE_M, 0.08, pixel_pairs=300, vertex_labels=ANY)
    vertex, points = pairs.vertex[pairs.from_skin :], pairs.points_camera[pairs.from_skin :]
    sampled = sample_region(cloud, 300)[0]
    distance = np.linalg.norm(sampled[:, None] - vertices[seen][None], axis=-1)
    near = distance.min(axis=1) < 0.08
    assert 20 < near.sum() < len(sampled)
    assert np.allclose(points, sampled[near])
    assert np.array_equal(vertex, np.flatnonzero(seen)[distance.argmin(axis=1)[near]])


def test_no_pair_is_longer_than_its_gate(cloud, vertices):
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(cloud, vertices, seen, 0.05, 0.2, pixel_pairs=500, vertex_labels=ANY)
    length = np.linalg.norm(vertices[pairs.vertex] - pairs.points_camera, axis=1)
    n = pairs.from_skin
    assert length[:n].max() < 0.05
    assert 0.05 < length[n:].max() <= 0.2


def test_invisible_vertices_and_points_outside_the_region_do_not_pair(cloud, vertices):
    seen = np.arange(len(vertices)) % 2 == 0
    pairs = associate(cloud, vertices, seen, GATE_M, GATE_M, pixel_pairs=500, vertex_labels=ANY)
    assert seen[pairs.vertex].all()
    allowed = {tuple(p) for p in cloud.points_camera[cloud.region]}
    assert {tuple(p) for p in pairs.points_camera} <= allowed


def test_a_wide_gate_skips_pixels_evenly_and_still_finds_a_near_point(cloud, vertices):
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(cloud, vertices, seen, 0.5, 0.5, pixel_pairs=0, vertex_labels=ANY)
    length = np.linalg.norm(vertices[pairs.vertex] - pairs.points_camera, axis=1)
    exact = np.linalg.norm(
        vertices[pairs.vertex][:, None] - cloud.points_camera[cloud.region][None], axis=-1
    ).min(axis=1)
    assert length.max() < 0.5
    assert (length <= exact + 0.15).mean() > 0.99


@pytest.mark.parametrize("pixel_pairs", [0, 300])
def test_without_observation_or_skin_there_are_no_pairs(cloud, vertices, pixel_pairs):
    empty = Observation(CAMERA, cloud.points_camera, np.zeros((48, 64), dtype=bool))
    seen = np.ones(len(vertices), dtype=bool)
    for observation, visible in ((empty, seen), (cloud, ~seen)):
        pairs = associate(observation, vertices, visible, GATE_M, GATE_M, pixel_pairs, ANY)
        assert len(pairs.vertex) == len(pairs.points_camera) == pairs.from_skin == 0
        assert pairs.points_camera.shape == (0, 3)


def test_the_sample_is_about_as_large_as_asked_and_lies_on_the_region(cloud):
    allowed = {tuple(p) for p in cloud.points_camera[cloud.region]}
    for count in (50, 200, 1000, 10_000):
        points = sample_region(cloud, count)[0]
        assert {tuple(p) for p in points} <= allowed
        assert 0.6 * min(count, cloud.region.sum()) <= len(points) <= max(2.5 * count, 10)


def test_association_repeats_to_the_bit(human, scene):
    q = scene.place({"elbow_flexion": 60})
    observation = observe(scene.frame(scene.depth(q)), 320)
    state = run_kinematics(human.body, q)
    vertices = transform_points(
        invert_rigid(T_LEVEL_WORLD_CAMERA), skinned_vertices(state, human.skin)
    ) + np.array([0.02, -0.01, 0.03])
    seen = np.ones(len(vertices), dtype=bool)
    first, *others = (
        associate(observation, vertices, seen, 0.05, 0.1, 1200, human.skin.labels) for _ in range(4)
    )
    assert len(first.vertex) > 1500
    for again in others:
        assert first.vertex.tobytes() == again.vertex.tobytes()
        assert first.points_camera.tobytes() == again.points_camera.tobytes()


def test_a_forked_process_searches_too(cloud, vertices):
    visible = np.ones(len(vertices), dtype=bool)
    here = associate(cloud, vertices, visible, 0.05, 0.1, 100, ANY)
    with multiprocessing.get_context("fork").Pool(1) as pool:
        there = pool.apply_async(associate, (cloud, vertices, visible, 0.05, 0.1, 100, ANY)).get(30)
    assert np.array_equal(here.vertex, there.vertex)
    assert np.array_equal(here.points_camera, there.points_camera)


@pytest.fixture(scope="module")
def labelled(cloud):
    labels = np.random.default_rng(5).integers(0, 4, (48, 64)).astype(np.uint8)
    return replace(cloud, labels=labels, region=cloud.region & (labels > 0))


def test_only_equal_labels_pair_in_both_directions(labelled, vertices):
    part = np.random.default_rng(6).integers(1, 4, len(vertices)).astype(np.uint8)
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(labelled, vertices, seen, GATE_M, GATE_M, 500, part, HARD)
    label_of = {
        tuple(p): label
        for p, label in zip(
            labelled.points_camera.reshape(-1, 3), labelled.labels.ravel(), strict=True
        )
    }
    found = np.array([label_of[tuple(p)] for p in pairs.points_camera])
    assert 50 < pairs.from_skin < len(found) - 50
    assert np.array_equal(found, part[pairs.vertex])


def test_a_gated_pixel_takes_the_nearest_vertex_of_its_own_part(labelled, vertices):
    part = np.random.default_rng(6).integers(1, 4, len(vertices)).astype(np.uint8)
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(labelled, vertices, seen, GATE_M, 0.15, 500, part, HARD)
    points, labels = sample_region(labelled, 500)
    distance = np.linalg.norm(points[:, None] - vertices[None], axis=-1)
    distance[labels[:, None] != part[None]] = np.inf
    near = distance.min(axis=1) < 0.15
    assert np.array_equal(pairs.vertex[pairs.from_skin :], distance.argmin(axis=1)[near])


@pytest.mark.parametrize("part_m", [0.0, 0.03, 0.08])
def test_a_pair_of_two_parts_counts_as_longer(labelled, vertices, part_m):
    part = np.random.default_rng(6).integers(1, 4, len(vertices)).astype(np.uint8)
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(labelled, vertices, seen, GATE_M, 0.15, 500, part, part_m)
    points, labels = sample_region(labelled, 500)
    distance = np.linalg.norm(points[:, None] - vertices[None], axis=-1)
    distance = np.hypot(distance, part_m * (labels[:, None] != part[None]))
    near = distance.min(axis=1) < 0.15
    assert np.array_equal(pairs.vertex[pairs.from_skin :], distance.argmin(axis=1)[near])
    flat, label = labelled.points_camera.reshape(-1, 3), labelled.labels.ravel()
    label_of = {tuple(p): n for p, n in zip(flat, label, strict=True)}
    found = np.array([label_of[tuple(p)] for p in pairs.points_camera[: pairs.from_skin]])
    assert (found > 0).all() and (found != part[pairs.vertex[: pairs.from_skin]]).any()
    gap = np.linalg.norm(pairs.points_camera - vertices[pairs.vertex], axis=1)[: pairs.from_skin]
    assert (np.hypot(gap, part_m * (found != part[pairs.vertex[: pairs.from_skin]])) < GATE_M).all()


def test_a_part_that_nobody_labelled_does_not_pair(labelled, vertices):
    seen = np.ones(len(vertices), dtype=bool)
    pairs = associate(labelled, vertices, seen, GATE_M, GATE_M, 500, 6 * ANY, HARD)
    assert len(pairs.vertex) == 0

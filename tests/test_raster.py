# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import trimesh

from kintrack.body import run_kinematics
from kintrack.geometry import (
    T_LEVEL_WORLD_CAMERA,
    PinholeCamera,
    invert_rigid,
    transform_points,
)
from kintrack.raster import NEAR_M, rasterise
from kintrack.skin import skinned_vertices

CAMERA = PinholeCamera(48, 36, 45.0, 47.0, 23.3, 17.8)
SQUARE = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
TWO_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def rays():
    return CAMERA.back_project(np.ones((CAMERA.height, CAMERA.width)))


def by_ray_casting(vertices, faces):
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    directions = rays().reshape(-1, 3)
    caster = trimesh.ray.ray_triangle.RayMeshIntersector(mesh)
    face, ray, points = caster.intersects_id(
        np.zeros_like(directions), directions, multiple_hits=True, return_locations=True
    )
    depth, index = np.full(len(directions), np.inf), np.full(len(directions), -1)
    for f, r, p in zip(face, ray, points, strict=True):
        if p[2] < depth[r]:
            depth[r], index[r] = p[2], f
    shape = (CAMERA.height, CAMERA.width)
    return depth.reshape(shape), index.reshape(shape)


def test_a_tilted_plane_has_its_analytic_depth_everywhere():
    tilt = np.array([[1, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    vertices = 10 * SQUARE @ tilt.T + [0, 0, 8.0]
    depth, index = rasterise(vertices, TWO_TRIANGLES, CAMERA)
    normal = tilt @ [0, 0, 1]
    expected = normal @ [0, 0, 8.0] / (rays() @ normal)
    assert np.allclose(depth, expected, rtol=1e-9)
    assert (index >= 0).all()


def test_a_sphere_has_its_analytic_depth_away_from_its_rim():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.5)
    centre = np.array([0.1, -0.05, 2.0])
    depth, index = rasterise(ball.vertices + centre, ball.faces, CAMERA)
    ray = rays()
    b, c = ray @ centre, centre @ centre - 0.25
    a = (ray**2).sum(axis=-1)
    inside = b * b - a * c
    expected = (b - np.sqrt(np.maximum(inside, 0))) / a
    middle = inside > 0.2 * inside.max()
    assert np.abs(depth - expected)[middle].max() < 2e-3
    assert (index[inside < -0.05] == -1).all()


@pytest.mark.parametrize("seed", range(3))
def test_depth_and_triangle_agree_with_ray_casting(seed):
    rng = np.random.default_rng(seed)
    corners = rng.uniform([-1, -1, 1], [1, 1, 4], (20, 1, 3))
    vertices = (corners + rng.normal(0, 0.5, (20, 3, 3)) * [1, 1, 0.3]).reshape(-1, 3)
    vertices[:, 2] = np.maximum(vertices[:, 2], 0.3)
    faces = np.arange(60).reshape(20, 3)
    depth, index = rasterise(vertices, faces, CAMERA)
    expected_depth, expected_index = by_ray_casting(vertices, faces)
    same = index == expected_index
    assert same.mean() > 0.999  # rays through an edge may fall to either side
    seen = same & (index >= 0)
    assert seen.sum() > 200
    assert np.allclose(depth[seen], expected_depth[seen], rtol=1e-6)


def test_the_body_agrees_with_ray_casting(human, scene, body):
    vertices = skinned_vertices(run_kinematics(body, scene.place()), human.skin)
    vertices = transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), vertices)
    depth, index = rasterise(vertices, human.skin.faces, CAMERA)
    expected_depth, expected_index = by_ray_casting(vertices, human.skin.faces)
    same = index == expected_index
    assert same.mean() > 0.99
    assert np.allclose(depth[same], expected_depth[same], rtol=1e-6)


def test_of_two_surfaces_the_nearer_is_seen_whatever_their_order():
    near, far = 0.3 * SQUARE + [0, 0, 1.0], 3 * SQUARE + [0, 0, 2.0]
    vertices = np.concatenate([far, near])
    for faces in (
        np.concatenate([TWO_TRIANGLES, TWO_TRIANGLES + 4]),
        np.concatenate([TWO_TRIANGLES + 4, TWO_TRIANGLES]),
    ):
        depth, _ = rasterise(vertices, faces, CAMERA)
        assert depth[18, 23] == pytest.approx(1.0)
        assert depth[0, 0] == pytest.approx(2.0)


def test_winding_does_not_matter():
    vertices = SQUARE + [0, 0, 2.0]
    turned = rasterise(vertices, TWO_TRIANGLES[:, ::-1].copy(), CAMERA)[0]
    assert np.allclose(rasterise(vertices, TWO_TRIANGLES, CAMERA)[0], turned)


def test_nothing_in_view_leaves_an_empty_buffer():
    depth, index = rasterise(SQUARE + [50.0, 0, 2.0], TWO_TRIANGLES, CAMERA)
    assert np.isinf(depth).all() and (index == -1).all()


def test_what_lies_behind_or_touches_the_camera_is_left_out():
    behind = SQUARE - [0, 0, 2.0]
    touching = SQUARE + [0, 0, 0.5 * NEAR_M]
    for vertices in (behind, touching):
        assert (rasterise(vertices, TWO_TRIANGLES, CAMERA)[1] == -1).all()


def test_triangles_without_area_are_invisible():
    line = np.array([[0.0, 0.0, 1.0], [0.1, 0.1, 1.0], [0.2, 0.2, 1.0]])
    assert np.isinf(rasterise(line, np.array([[0, 1, 2]]), CAMERA)[0]).all()

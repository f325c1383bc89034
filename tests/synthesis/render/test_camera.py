# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.ndimage import maximum_filter, minimum_filter

from kintrack.body import run_kinematics
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from kintrack.skin import skinned_vertices
from synthesis.demo import KINECT_V1
from synthesis.motions.motion import perform
from synthesis.motions.scripts import arms
from synthesis.render.camera import SUPERSAMPLING, level_camera, look

T_WORLD_CAMERA = level_camera(2.6, 1.0)


@pytest.fixture(scope="module")
def scene(person):
    q = perform(person, arms()).q[40]
    vertices = skinned_vertices(run_kinematics(person.body, q), person.skin)
    return vertices, person.skin.faces, look(vertices, person.skin.faces, KINECT_V1, T_WORLD_CAMERA)


def _ray_depth(ray, vertices, faces):
    """Smallest z at which a ray from the origin meets a mesh (Moeller & Trumbore 1997)."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    p = np.cross(ray, c - a)
    determinant = np.einsum("fi,fi->f", b - a, p)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.einsum("fi,fi->f", -a, p) / determinant
        r = np.cross(-a, b - a)
        v = r @ ray / determinant
        t = np.einsum("fi,fi->f", c - a, r) / determinant
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return ray[2] * t[hit].min() if hit.any() else 0.0


def test_depth_agrees_with_rays_away_from_edges(scene):
    vertices, faces, view = scene
    vertices_camera = transform_points(invert_rigid(T_WORLD_CAMERA), vertices)
    depth = view.depth_m
    inside = maximum_filter(depth, 3) - minimum_filter(depth, 3) < 0.05
    pixels = np.argwhere(inside & (depth > 0))
    for v, u in np.random.default_rng(0).permutation(pixels)[:80]:
        ray = np.array([(u - KINECT_V1.cx) / KINECT_V1.fx, (v - KINECT_V1.cy) / KINECT_V1.fy, 1.0])
        assert depth[v, u] == pytest.approx(_ray_depth(ray, vertices_camera, faces), abs=1e-3)


def test_samples_hold_every_pixel(scene):
    view = scene[2]
    assert view.samples.scaled(SUPERSAMPLING) == view.camera
    assert view.depth_m.shape == (KINECT_V1.height, KINECT_V1.width)


def test_labels_and_depth_cover_the_same_pixels(person, scene):
    view = scene[2]
    labels = view.labels(person.skin.faces, person.skin.labels)
    assert np.array_equal(labels > 0, view.depth_m > 0)
    assert set(np.unique(labels)) == set(range(7))


def test_the_right_arm_is_on_the_left_of_the_image(person, scene):
    labels = scene[2].labels(person.skin.faces, person.skin.labels)
    right, left = np.argwhere(labels == 3)[:, 1], np.argwhere(labels == 4)[:, 1]
    assert right.max() < left.min()


def test_a_level_camera_sees_up_as_up_and_itself_nowhere():
    ahead = transform_points(invert_rigid(T_WORLD_CAMERA), np.array([[0.0, 0.0, 1.5]]))
    assert np.allclose(ahead, [[0.0, -0.5, 2.6]])


def test_the_angle_of_a_tilted_plane_is_its_tilt():
    camera = PinholeCamera(64, 48, 500.0, 500.0, 32.0, 24.0)
    tilt = np.radians(40.0)
    x, y = np.meshgrid([-1.0, 1.0], [-1.0, 1.0])
    corners = np.stack([x, y * np.cos(tilt), 3.0 + y * np.sin(tilt)], axis=-1).reshape(-1, 3)
    view = look(corners, np.array([[0, 1, 2], [1, 3, 2]]), camera, np.eye(4))
    assert view.sample_angle_rad[48, 64] == pytest.approx(tilt, abs=1e-6)
    assert view.depth_m[24, 32] == pytest.approx(3.0)

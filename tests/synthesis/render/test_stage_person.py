# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from stage_shapes import DAY, PAPER, floor

from kintrack.body import run_kinematics
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from kintrack.joints import JOINT_NAMES
from kintrack.skin import skinned_vertices, vertex_normals
from synthesis.mesh import mesh_of
from synthesis.motions.motion import perform
from synthesis.motions.scripts import arms
from synthesis.people.person import load_person
from synthesis.render.cast import Caster, Rays
from synthesis.render.placing import looking_at
from synthesis.render.stage import Stage

CAMERA = PinholeCamera(1536, 1272, 1095.0, 1095.0, 768.0, 636.0)
"""Three rays a pixel of a Kinect v2: a vertex lies a millimetre at most beside one."""
FRAMES = (0, 40, 75)
T_WORLD_CAMERA = looking_at(np.array([2.4, 0.3, 1.2]), np.array([0.0, 0.0, 0.95]))
SAME_M = 1e-3
DEEPEST_M = 0.20


@pytest.fixture(scope="module")
def someone():
    return load_person(3)


@pytest.fixture(scope="module")
def shots(someone):
    """Vertices, joints and view of a person in a few poses."""
    skin = someone.skin
    mesh = mesh_of(someone.bind_vertices, skin.faces, PAPER, labels=skin.labels)
    stage = Stage(floor(), mesh, DAY)
    out = []
    for n in FRAMES:
        state = run_kinematics(someone.body, perform(someone, arms()).q[n])
        vertices = skinned_vertices(state, skin)
        view = stage.view(vertices, CAMERA, T_WORLD_CAMERA, color=False)
        out.append((vertices, state.joint_positions_world, view))
    return out


def _camera(points_world):
    return transform_points(invert_rigid(T_WORLD_CAMERA), points_world)


def _facing(vertices, faces):
    """Cosine between each vertex's normal and the way to the camera."""
    away = T_WORLD_CAMERA[:3, 3] - vertices
    normals = vertex_normals(vertices, faces)
    return np.einsum("vi,vi->v", away, normals) / np.linalg.norm(away, axis=1)


def _visible(vertices, faces):
    """Vertices that are the first thing on the ray through them.

    The rays pass beside them, in the triangle that faces the camera most: exactly at a vertex, one
    of sixty slips through even between watertight triangles.
    """
    z = _camera(vertices)[:, 2]
    origin = T_WORLD_CAMERA[:3, 3]
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    order = np.argsort(np.einsum("fi,fi->f", normals, origin - corners.mean(axis=1)))
    best = np.zeros(len(vertices), dtype=int)
    best[faces[order].ravel()] = np.repeat(order, 3)
    beside = vertices + 1e-3 * (corners[best].mean(axis=1) - vertices)
    hits = Caster(vertices, faces).cast(Rays(origin, (beside - origin) / z[:, None]))
    depth = np.full(len(vertices), np.inf)
    depth[hits.ray] = hits.depth_m
    passed = depth > z + 1e-4
    assert not np.any(passed & (_facing(vertices, faces) > 0.5))
    return np.abs(depth - z) < 1e-4


def test_depth_is_that_of_the_skin_to_the_millimetre(someone, shots):
    faces = someone.skin.faces
    for vertices, _, view in shots:
        points, normals = _camera(vertices), vertex_normals(_camera(vertices), faces)
        visible = _visible(vertices, faces)
        assert visible.sum() > 3000
        chosen = visible & (_facing(vertices, faces) > 0.5)
        u, v = np.rint(CAMERA.project(points[chosen])).astype(int).T
        ray = np.stack([(u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy, 0 * u + 1], 1)
        at_pixel = np.einsum("vi,vi->v", points[chosen], normals[chosen])
        at_pixel /= np.einsum("vi,vi->v", ray, normals[chosen])
        error = np.abs(view.depth_m[v, u] - at_pixel)
        assert np.median(error) < 0.25 * SAME_M
        assert np.mean(error < SAME_M) > 0.95


def test_labels_are_those_of_the_skin(someone, shots):
    faces, labels = someone.skin.faces, someone.skin.labels
    seam = np.zeros(len(labels), dtype=bool)
    mixed = faces[(labels[faces] != labels[faces[:, :1]]).any(axis=1)]
    seam[np.unique(mixed)] = True
    for vertices, _, view in shots:
        chosen = _visible(vertices, faces) & ~seam & (_facing(vertices, faces) > 0.3)
        u, v = np.rint(CAMERA.project(_camera(vertices[chosen]))).astype(int).T
        same = view.labels[v, u] == labels[chosen]
        nearby = [
            (view.labels[v + dv, u + du] == labels[chosen])
            for dv in (-1, 0, 1)
            for du in (-1, 0, 1)
        ]
        assert same.mean() > 0.98  # the rest lies on the outline
        assert np.any(nearby, axis=0).mean() > 0.999


def test_joints_lie_behind_the_surface_that_is_seen(shots):
    checked = 0
    for _, joints_world, view in shots:
        joints = _camera(joints_world)
        u, v = np.rint(CAMERA.project(joints)).astype(int).T
        on_person = view.labels[v, u] > 0
        behind = joints[:, 2] - view.depth_m[v, u]
        assert np.all(on_person)
        for name, depth in zip(JOINT_NAMES, behind, strict=True):
            assert 0.0 < depth < DEEPEST_M, name
            checked += 1
    assert checked == len(FRAMES) * len(JOINT_NAMES)


def test_depth_and_labels_cover_the_same_pixels(shots):
    for _, _, view in shots:
        place_z = view.depth_m > 0
        assert np.all(place_z[view.labels > 0])
        assert set(np.unique(view.labels)) == set(range(7))


def test_the_right_arm_is_on_the_left_of_the_image(shots):
    labels = shots[1][2].labels
    right, left = np.argwhere(labels == 3)[:, 1], np.argwhere(labels == 4)[:, 1]
    assert right.max() < left.min()

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
import trimesh

from kintrack.association.visibility import visible_vertices
from kintrack.body import run_kinematics
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.skin import skinned_vertices, vertex_normals

FACING, TOLERANCE_M = 0.15, 0.02


@pytest.fixture(scope="module")
def see(human, scene):
    """A function of a configuration: vertices, normals and what is visible."""

    def look(q, facing=FACING, tolerance_m=TOLERANCE_M):
        vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
        vertices = transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), vertices)
        normals = vertex_normals(vertices, human.skin.faces)
        return (
            vertices,
            normals,
            visible_vertices(
                vertices, normals, human.skin.faces, scene.camera, facing, tolerance_m
            ),
        )

    return look


def cosine(vertices, normals):
    rays = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    return -np.einsum("ij,ij->i", rays, normals)


@pytest.mark.parametrize("heading_deg", [0.0, 70.0, 180.0])
def test_visible_vertices_are_those_that_a_ray_from_the_camera_reaches(
    human, scene, see, heading_deg
):
    vertices, normals, visible = see(scene.place({"elbow_flexion": 70}, heading_deg))
    mesh = trimesh.Trimesh(vertices, human.skin.faces, process=False)
    rays = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    first = np.full(len(vertices), np.inf)
    points, ray, _ = mesh.ray.intersects_location(np.zeros_like(rays), rays, multiple_hits=False)
    first[ray] = np.linalg.norm(points, axis=1)
    behind = np.linalg.norm(vertices, axis=1) - first
    facing = cosine(vertices, normals)
    clearly_seen = (facing > FACING + 0.05) & (np.abs(behind) < 0.2 * TOLERANCE_M)
    clearly_hidden = (facing < FACING - 0.01) | (np.isfinite(first) & (behind > 0.06))
    assert clearly_seen.sum() > 500 and clearly_hidden.sum() > 500
    assert visible[clearly_seen].mean() > 0.97  # the depth buffer has half the resolution
    assert visible[clearly_hidden].mean() < 0.01


def test_the_back_of_a_person_is_not_seen_from_the_front(human, scene, see):
    vertices, normals, visible = see(scene.place())
    assert (cosine(vertices, normals)[visible] >= FACING).all()
    assert not visible[normals[:, 2] > 0.3].any()
    assert 0.25 < visible.mean() < 0.5


def test_an_arm_before_the_chest_hides_it(human, scene, see):
    folded = {
        "shoulder_plane": 50,
        "shoulder_elevation": 30,
        "shoulder_rotation": 50,
        "elbow_flexion": 90,
    }
    torso = human.skin.labels == 2
    open_chest, hidden_chest = see(scene.place())[2], see(scene.place(folded))[2]
    assert hidden_chest[torso].sum() < 0.93 * open_chest[torso].sum()


def test_what_lies_beside_or_behind_the_camera_is_not_visible(scene, see):
    assert not see(scene.place(at=(2.8, 30.0, 0.0)))[2].any()
    assert not see(scene.place(at=(-2.8, 0.0, 0.0)))[2].any()


def test_the_half_body_in_the_image_is_visible_and_the_rest_is_not(scene, see):
    vertices, _, visible = see(scene.place(at=(1.2, 0.0, 0.0)))
    pixel = scene.camera.project(vertices)
    inside = ((pixel > -1) & (pixel < [scene.camera.width, scene.camera.height])).all(axis=1)
    assert visible[inside].any() and not visible[~inside].any()


def test_a_stricter_angle_and_a_smaller_tolerance_see_less(scene, see):
    q = scene.place({"elbow_flexion": 90}, 30.0)
    assert see(q, facing=0.5)[2].sum() < see(q)[2].sum()
    assert see(q, tolerance_m=0.0)[2].sum() < see(q)[2].sum()

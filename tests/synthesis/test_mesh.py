# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SceneError
from synthesis.mesh import Material, join, mesh_of

TRIANGLE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


def grey(coords):
    return np.full((len(coords), 3), 0.5)


def white(coords):
    return np.ones((len(coords), 3))


def test_joined_meshes_keep_their_vertices_materials_and_labels():
    a = mesh_of(TRIANGLE, [[0, 1, 2]], Material(grey), labels=np.array([1, 1, 1]))
    b = mesh_of(TRIANGLE + 5.0, [[2, 1, 0]], Material(white))
    both = join([a, b, a])
    assert both.faces.tolist() == [[0, 1, 2], [5, 4, 3], [6, 7, 8]]
    assert [both.materials[m].pattern for m in both.face_material] == [grey, white, grey]
    assert both.labels.tolist() == [1, 1, 1, 0, 0, 0, 1, 1, 1]
    assert np.array_equal(both.vertices[3:6], b.vertices)


def test_moving_turns_and_scales_the_vertices_but_not_the_places_on_the_material():
    mesh = mesh_of(TRIANGLE, [[0, 1, 2]], Material(grey))
    T = np.array([[0, -2, 0, 1], [2, 0, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]], dtype=float)
    moved = mesh.moved(T)
    assert np.allclose(moved.vertices, [[1, 0, 0], [1, 2, 0], [-1, 0, 0]])
    assert np.array_equal(moved.coords, TRIANGLE)


@pytest.mark.parametrize(
    "vertices, faces, labels, says",
    [
        (TRIANGLE, np.zeros((0, 3)), None, "no faces"),
        (TRIANGLE * [1, np.nan, 1], [[0, 1, 2]], None, "not finite"),
        (TRIANGLE, [[0, 1, 3]], None, "vertex 3; 0 to 2"),
        (TRIANGLE, [[0, -1, 2]], None, "vertex -1"),
        (TRIANGLE, [[0, 1, 2]], np.array([0, 7, 0]), "label 7; 0 to 6"),
    ],
)
def test_broken_meshes_are_named(vertices, faces, labels, says):
    with pytest.raises(SceneError, match=f"chair.*{says}"):
        mesh_of(vertices, faces, Material(grey), labels=labels, name="chair")


def test_nothing_cannot_be_joined():
    with pytest.raises(SceneError, match="at least one"):
        join([])

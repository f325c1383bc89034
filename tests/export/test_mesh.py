# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.export.coloring import colors_of, residuals_of, signed_colors
from kintrack.export.mesh import write_glb, write_ply
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.skin import skinned_vertices

VERTICES = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.5]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
COLORS = np.arange(12, dtype=np.uint8).reshape(4, 3)


@pytest.fixture(scope="module")
def human(scene):
    """Who is filmed."""
    return scene.human


def test_a_ply_file_holds_vertices_colours_values_and_triangles(tmp_path):
    path = tmp_path / "a.ply"
    write_ply(path, VERTICES, FACES, COLORS, {"offset_m": np.array([0.0, 0.01, 0.02, 0.03])})
    head, _, body = path.read_bytes().partition(b"end_header\n")
    assert b"element vertex 4" in head and b"property float offset_m" in head
    kind = np.dtype([("xyz", "<f4", 3), ("rgb", "u1", 3), ("offset_m", "<f4")])
    table = np.frombuffer(body, dtype=kind, count=4)
    assert np.allclose(table["xyz"], VERTICES)
    assert (table["rgb"] == COLORS).all()
    assert table["offset_m"][2] == pytest.approx(0.02)
    faces = np.frombuffer(body[4 * kind.itemsize :], dtype=[("n", "u1"), ("corners", "<i4", 3)])
    assert (faces["n"] == 3).all() and (faces["corners"] == FACES).all()


def test_a_glb_file_is_whole_and_stands_upright(tmp_path):
    path = tmp_path / "a.glb"
    normals = VERTICES / np.maximum(np.linalg.norm(VERTICES, axis=1, keepdims=True), 1)
    write_glb(path, VERTICES, normals, FACES, COLORS)
    raw = path.read_bytes()
    assert raw[:4] == b"glTF" and int.from_bytes(raw[8:12], "little") == len(raw)
    size = int.from_bytes(raw[12:16], "little")
    content, data = json.loads(raw[20 : 20 + size]), raw[28 + size :]
    assert content["buffers"][0]["byteLength"] == len(data)
    for view in content["bufferViews"]:
        assert view["byteOffset"] % 4 == 0
        assert view["byteOffset"] + view["byteLength"] <= len(data)
    assert np.allclose(np.frombuffer(data, "<f4", 12).reshape(4, 3), VERTICES)
    x, y, z, w = content["nodes"][0]["rotation"]
    up = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    assert np.allclose(up, [0, 1, 0])


def test_outwards_is_red_inwards_is_blue_and_unknown_is_grey():
    red, blue, none, zero = signed_colors(np.array([0.03, -0.03, np.nan, 0.0]), 0.03).astype(int)
    assert red[0] > red[2] + 80 and blue[2] > blue[0] + 80
    assert none.max() == none.min()
    assert zero.min() > 230


def test_residuals_are_the_distance_of_what_is_seen_along_the_normal(scene, human):
    q = scene.place()
    state = run_kinematics(human.body, q)
    vertices = transform_points(
        invert_rigid(T_LEVEL_WORLD_CAMERA), skinned_vertices(state, human.skin)
    )
    frame = scene.frame(np.where((d := scene.depth(q)) > 0, d - 0.01, 0).astype(np.float32))
    residuals = residuals_of(vertices, human.skin, frame)
    known = np.isfinite(residuals)
    assert 0.25 < known.mean() < 0.6
    assert 0.004 < np.median(residuals[known]) < 0.0105
    colors = colors_of("residual", human.skin, None, vertices, frame)
    assert (colors[~known] == colors[~known][0]).all()
    assert (residuals_of(vertices, human.skin, scene.room()) != 0).all()

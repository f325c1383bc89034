# SPDX-License-Identifier: Apache-2.0
import re

import pytest

from kintrack.errors import SequenceError
from kintrack.sequence.camera_file import read_camera_file, write_camera_file

from .small_recordings import CAMERA, OPEN3D, OURS, save_json


def test_our_camera_file_gives_camera_and_metres_per_unit(tmp_path):
    assert read_camera_file(save_json(tmp_path / "camera.json", OURS)) == (CAMERA, 0.001)


def test_a_written_camera_file_reads_back_the_same(tmp_path):
    write_camera_file(tmp_path / "camera.json", CAMERA, 0.0002)
    assert read_camera_file(tmp_path / "camera.json") == (CAMERA, 0.0002)


def test_a_file_without_a_depth_scale_says_so_instead_of_guessing(tmp_path):
    content = {key: value for key, value in OURS.items() if key != "depth_scale_m"}
    assert read_camera_file(save_json(tmp_path / "camera.json", content)) == (CAMERA, None)


def test_a_missing_camera_file_is_named_with_the_format(tmp_path):
    path = tmp_path / "camera.json"
    with pytest.raises(SequenceError, match='cannot be read: No such file.*"model"') as caught:
        read_camera_file(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("text", ["fx = 525", '{"model": "pinhole",', "\xff"])
def test_a_camera_file_that_is_no_json_is_refused(tmp_path, text):
    path = tmp_path / "camera.json"
    path.write_text(text, encoding="latin-1")
    with pytest.raises(SequenceError, match=re.escape(f"camera file {path} is not JSON")):
        read_camera_file(path)


def test_json_that_is_no_object_is_refused(tmp_path):
    with pytest.raises(SequenceError, match="holds a list; a JSON object is needed"):
        read_camera_file(save_json(tmp_path / "camera.json", [525, 525]))


@pytest.mark.parametrize("key", ["model", "width", "height", "fx", "fy", "cx", "cy"])
def test_a_missing_key_is_named(tmp_path, key):
    content = {other: value for other, value in OURS.items() if other != key}
    with pytest.raises(SequenceError, match=f"key '{key}' is missing"):
        read_camera_file(save_json(tmp_path / "camera.json", content))


@pytest.mark.parametrize(
    ("key", "value", "allowed"),
    [
        ("fx", 0, "a focal length above 0 px"),
        ("fx", 0.0, "a focal length above 0 px"),
        ("fy", -525.0, "a focal length above 0 px"),
        ("fx", float("nan"), "a focal length above 0 px"),
        ("fx", "525", "a number [px]"),
        ("cx", None, "a number [px]"),
        ("cx", float("inf"), "must be finite"),
        ("width", 640.5, "a positive whole number"),
        ("height", 0, "a positive whole number"),
        ("width", True, "a positive whole number"),
        ("depth_scale_m", 0, "a finite number above 0"),
        ("depth_scale_m", -0.001, "a finite number above 0"),
        ("depth_scale_m", "mm", "a finite number above 0"),
        ("model", "fisheye", "'pinhole'"),
    ],
)
def test_a_bad_value_is_named_with_its_key_and_what_is_allowed(tmp_path, key, value, allowed):
    path = save_json(tmp_path / "camera.json", OURS | {key: value})
    with pytest.raises(SequenceError, match=re.escape(f"{key} = ")) as caught:
        read_camera_file(path)
    message = str(caught.value)
    assert str(path) in message and allowed in message
    assert (repr(value) if value != 0 else "= 0") in message


def test_open3d_matrices_are_read_column_by_column(tmp_path):
    assert read_camera_file(save_json(tmp_path / "intrinsic.json", OPEN3D)) == (CAMERA, None)


def test_open3d_depth_scale_counts_units_per_metre(tmp_path):
    path = save_json(tmp_path / "intrinsic.json", OPEN3D | {"depth_scale": 1000.0})
    assert read_camera_file(path)[1] == 0.001


def test_an_open3d_matrix_stored_row_by_row_is_refused(tmp_path):
    rows = {"intrinsic_matrix": [10.0, 0, 3.5, 0, 11.0, 2.5, 0, 0, 1]}
    with pytest.raises(SequenceError, match="not a pinhole camera stored column by column"):
        read_camera_file(save_json(tmp_path / "intrinsic.json", OPEN3D | rows))


@pytest.mark.parametrize("matrix", [[10.0] * 8, "identity", [[10.0, 0, 0]] * 3])
def test_an_open3d_matrix_that_is_not_nine_numbers_is_refused(tmp_path, matrix):
    path = save_json(tmp_path / "intrinsic.json", OPEN3D | {"intrinsic_matrix": matrix})
    with pytest.raises(SequenceError, match="allowed: 9 numbers"):
        read_camera_file(path)


def test_an_open3d_depth_scale_of_zero_is_refused(tmp_path):
    path = save_json(tmp_path / "intrinsic.json", OPEN3D | {"depth_scale": 0})
    with pytest.raises(SequenceError, match="depth_scale = 0; allowed: a finite number above 0"):
        read_camera_file(path)

# SPDX-License-Identifier: Apache-2.0
import re

import cv2
import numpy as np
import pytest

from kintrack.errors import FrameError
from kintrack.sequence.images import (
    clean_depth,
    encode_depth,
    read_color,
    read_depth,
    read_labels,
)

from .small_recordings import CAMERA, depth_units, save_image


def test_depth_comes_in_metres_with_zero_where_nothing_was_read(tmp_path):
    path = save_image(tmp_path / "d.png", depth_units(2500))
    depth_m = read_depth(path, CAMERA, 0.001)
    assert depth_m.dtype == np.float32
    assert depth_m[0, 0] == 0
    np.testing.assert_allclose(depth_m[1:], 2.5)


def test_an_8_bit_depth_image_is_refused_with_what_was_found(tmp_path):
    path = save_image(tmp_path / "d.png", np.full((6, 8), 90, np.uint8))
    with pytest.raises(FrameError, match="8-bit, 1 channel, 8x6 px; allowed: 16-bit") as caught:
        read_depth(path, CAMERA, 0.001)
    assert str(path) in str(caught.value)


def test_a_depth_image_with_three_channels_is_refused(tmp_path):
    path = save_image(tmp_path / "d.png", np.full((6, 8, 3), 90, np.uint16))
    with pytest.raises(FrameError, match="16-bit, 3 channels, 8x6 px; allowed: .* 1 channel"):
        read_depth(path, CAMERA, 0.001)


def test_a_depth_image_of_another_size_is_refused_with_both_sizes(tmp_path):
    path = save_image(tmp_path / "d.png", np.full((3, 4), 900, np.uint16))
    with pytest.raises(FrameError, match=r"4x3 px; allowed: .* 8x6 px"):
        read_depth(path, CAMERA, 0.001)


def test_a_truncated_png_is_refused(tmp_path):
    noise = np.random.default_rng(0).integers(1, 5000, (6, 8)).astype(np.uint16)
    path = save_image(tmp_path / "d.png", noise)
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(FrameError, match=re.escape(f"{path} is truncated")):
        read_depth(path, CAMERA, 0.001)


@pytest.mark.parametrize("content", [b"", b"no image at all"])
def test_a_file_that_is_no_image_is_refused(tmp_path, content):
    path = tmp_path / "d.png"
    path.write_bytes(content)
    with pytest.raises(FrameError, match=rf"cannot be decoded \({len(content)} bytes\)"):
        read_depth(path, CAMERA, 0.001)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(FrameError, match=r"d\.png cannot be read: No such file"):
        read_depth(tmp_path / "d.png", CAMERA, 0.001)


def test_an_all_zero_depth_image_is_refused(tmp_path):
    path = save_image(tmp_path / "d.png", np.zeros((6, 8), np.uint16))
    with pytest.raises(FrameError, match=re.escape(f"no depth reading in {path}")):
        read_depth(path, CAMERA, 0.001)


def test_colour_comes_as_red_green_blue(tmp_path):
    bgr = np.zeros((6, 8, 3), np.uint8)
    bgr[..., 2] = 200
    color = read_color(save_image(tmp_path / "c.png", bgr), CAMERA)
    assert color[0, 0].tolist() == [200, 0, 0]


def test_grey_colour_images_become_three_channels(tmp_path):
    path = save_image(tmp_path / "c.png", np.full((6, 8), 7, np.uint8))
    assert read_color(path, CAMERA).shape == (6, 8, 3)


def test_colour_of_another_size_than_depth_is_refused(tmp_path):
    path = save_image(tmp_path / "c.png", np.zeros((12, 16, 3), np.uint8))
    with pytest.raises(FrameError, match=r"16x12 px; allowed: 8x6 px"):
        read_color(path, CAMERA)


def test_a_truncated_jpeg_is_refused(tmp_path):
    path = save_image(tmp_path / "c.jpg", np.zeros((6, 8, 3), np.uint8))
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(FrameError, match="is truncated"):
        read_color(path, CAMERA)


def test_labels_may_have_another_size_but_not_another_aspect(tmp_path):
    half = save_image(tmp_path / "half.png", np.full((3, 4), 6, np.uint8))
    assert read_labels(half, CAMERA).max() == 6
    square = save_image(tmp_path / "square.png", np.zeros((8, 8), np.uint8))
    with pytest.raises(FrameError, match=r"8x8 px; allowed: 8-bit, .* aspect of 8x6 px"):
        read_labels(square, CAMERA)


def test_a_label_that_does_not_exist_is_refused_with_the_allowed_ones(tmp_path):
    path = save_image(tmp_path / "l.png", np.full((6, 8), 7, np.uint8))
    with pytest.raises(FrameError, match=r"holds the value 7; allowed: 0 to 6 \(background, head"):
        read_labels(path, CAMERA)


def test_nan_infinite_and_negative_depths_count_as_no_reading():
    raw = np.array([[np.nan, np.inf, -1.0, 2.0]])
    assert clean_depth(raw).tolist() == [[0, 0, 0, 2]]
    assert encode_depth(raw, 0.001).tolist() == [[0, 0, 0, 2000]]


def test_depth_beyond_16_bits_is_written_as_no_reading():
    assert encode_depth(np.array([[65.535, 65.536, 1e30]]), 0.001).tolist() == [[65535, 0, 0]]


def test_encoded_depth_is_read_back_within_half_a_unit(tmp_path):
    depth_m = np.random.default_rng(1).uniform(0.5, 8.0, (6, 8))
    path = tmp_path / "d.png"
    cv2.imwrite(str(path), encode_depth(depth_m, 0.0002))
    np.testing.assert_allclose(read_depth(path, CAMERA, 0.0002), depth_m, atol=0.000101)

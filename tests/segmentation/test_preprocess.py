# SPDX-License-Identifier: Apache-2.0
"""From images to the network's picture and back."""

import numpy as np
import pytest

from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame
from segmentation.errors import InputError
from segmentation.labels import IGNORED
from segmentation.preprocess import (
    DEPTH_SCALE,
    FARTHEST,
    HOLE,
    NEAREST,
    frame_input,
    labels_to_image,
    labels_to_network,
    letterbox,
    network_input,
)

LARGE = [(512, 424), (640, 480), (320, 240), (1280, 720), (640, 576), (480, 640), (97, 211)]
SIZES = [*LARGE, (64, 53), (20, 16)]


def flat(width, height, depth_m=2.0):
    return np.full((height, width), depth_m, dtype=np.float32)


def inside(image, width, height):
    """What the network's picture shows of an image of that size."""
    fit = letterbox(width, height)
    return image[..., fit.top : fit.top + fit.rows, fit.left : fit.left + fit.columns]


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_the_whole_image_is_shown_with_its_aspect(width, height):
    fit = letterbox(width, height)
    assert fit.columns == 128 or fit.rows == 106
    assert 0 <= fit.left <= 128 - fit.columns and 0 <= fit.top <= 106 - fit.rows
    assert fit.columns / fit.rows == pytest.approx(width / height, rel=0.02)


def test_a_kinect_v2_fills_the_picture():
    assert letterbox(512, 424)[2:] == (128, 106, 0, 0)


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_bars_are_holes_without_colour_and_nothing_else_is(width, height):
    color = np.full((height, width, 3), 200, dtype=np.uint8)
    image = network_input(flat(width, height), 300.0, color)
    assert image.shape == (4, 106, 128) and image.dtype == np.float32
    assert (inside(image, width, height)[3] < HOLE).all()
    assert (inside(image, width, height)[:3] > 1).all()
    fit = letterbox(width, height)
    assert (image[3] == HOLE).sum() == 128 * 106 - fit.rows * fit.columns
    assert (image[:3, image[3] == HOLE] == 0).all()


@pytest.mark.parametrize(("width", "height"), LARGE)
def test_labels_come_back_from_the_image_unchanged(width, height):
    labels = np.random.default_rng(0).integers(0, 7, (106, 128), dtype=np.uint8)
    image = labels_to_image(labels, width, height)
    assert image.shape == (height, width)
    again = inside(labels_to_network(image), width, height)
    assert (again == inside(labels, width, height)).all()


@pytest.mark.parametrize(("width", "height"), [(64, 53), (20, 16)])
def test_labels_of_an_image_smaller_than_the_picture_survive_both_ways(width, height):
    labels = np.random.default_rng(0).integers(0, 7, (height, width), dtype=np.uint8)
    assert (labels_to_image(labels_to_network(labels), width, height) == labels).all()


@pytest.mark.parametrize(("width", "height"), SIZES)
def test_depth_and_labels_take_a_cell_from_the_same_pixels(width, height):
    labels = np.zeros((height, width), dtype=np.uint8)
    labels[height // 3 :, width // 2 :] = 2
    D = network_input(np.where(labels, 1.5, 3.0), 0.8 * max(width, height))[3]
    shown = inside(D, width, height)
    near = shown < 0.5 * (shown[:, 0].mean() + shown[-1, -1])
    assert ((inside(labels_to_network(labels), width, height) == 2) == near).mean() > 0.98


def test_a_mirrored_image_gives_the_mirrored_picture():
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.5, 5.0, (480, 640)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.3] = 0.0
    D, mirrored = (network_input(image, 500.0)[3] for image in (depth, depth[:, ::-1]))
    assert np.allclose(mirrored[:, ::-1], D, atol=1e-5)


def test_a_label_returns_to_the_pixels_it_was_made_from():
    labels = np.zeros((480, 640), dtype=np.uint8)
    labels[100:300, 200:350] = 5
    assert (labels_to_image(labels_to_network(labels), 640, 480) == labels).all()


def test_bars_of_a_label_map_are_ignored():
    labels = labels_to_network(np.ones((480, 640), dtype=np.uint8))
    assert (labels == IGNORED).sum() == 10 * 128 and (labels == 1).sum() == 96 * 128


def test_a_cell_takes_its_most_frequent_label():
    labels = np.zeros((424, 512), dtype=np.uint8)
    labels[:4, :4] = [[3, 3, 3, 3], [3, 3, 3, 3], [3, 6, 6, 6], [6, 6, 6, 6]]
    assert labels_to_network(labels)[0, 0] == 3


def test_two_surfaces_are_never_averaged():
    depth = flat(640, 480, 1.5)
    depth[:, 331:] = 4.0
    D = inside(network_input(depth, 525.0), 640, 480)[3]
    beyond_relief = np.unique(D[:, np.r_[:50, 90:128]])
    assert len(beyond_relief) == 2
    assert np.ptp(beyond_relief) == pytest.approx(np.log(4.0 / 1.5) / DEPTH_SCALE, rel=1e-5)
    edge = np.diff(D, axis=1)
    assert (edge.max(axis=1) > np.ptp(beyond_relief)).all()


def test_holes_leave_the_readings_beside_them_alone():
    depth = flat(512, 424)
    clean = network_input(depth, 365.0)[3, 0, 0]
    depth[np.random.default_rng(1).random(depth.shape) < 0.3] = 0.0
    D = network_input(depth, 365.0)[3]
    assert set(np.unique(D)) == {clean, np.float32(HOLE)}
    assert 0 < (D == HOLE).mean() < 0.15


def test_a_cell_is_a_hole_where_most_of_it_is():
    depth = flat(512, 424)
    depth[:, 1:4] = depth[:, 4:5] = 0.0
    D = network_input(depth, 365.0)[3]
    assert (D[:, 0] == HOLE).all() and (D[:, 1:] < HOLE).all()


def test_one_wild_reading_does_not_change_a_cell():
    depth = flat(512, 424)
    expected = network_input(depth, 365.0)
    depth[::4, ::4] = 9.0
    assert (depth[:4, :4] == 9.0).sum() == 1
    assert (network_input(depth, 365.0) == expected).all()


def test_every_reading_is_nearer_than_a_hole():
    near, far = (network_input(flat(512, 424, d), 365.0)[3, 0, 0] for d in (0.01, 1000.0))
    assert (near, far) == (NEAREST, FARTHEST) and far < HOLE


def test_a_scene_twice_as_far_keeps_its_relief():
    v, u = np.mgrid[:424, :512]
    depth = (2.0 + 0.3 * np.sin(u / 40.0) + 0.2 * np.cos(v / 30.0)).astype(np.float32)
    near, far = (network_input(k * depth, 365.0)[3] for k in (1, 2))
    assert np.ptp(far - near) < 1e-5
    assert (far - near).mean() == pytest.approx(np.log(2.0) / DEPTH_SCALE, rel=1e-5)


def test_a_longer_lens_is_the_same_as_coming_nearer():
    near = network_input(flat(512, 424, 1.5), 365.0)
    long = network_input(flat(512, 424, 3.0), 730.0)
    assert np.allclose(near, long, atol=1e-6)


def test_resolution_does_not_matter():
    coarse, fine = (network_input(flat(320 * k, 240 * k), 280.0 * k) for k in (1, 4))
    assert np.allclose(coarse, fine, atol=1e-6)


def test_colour_planes_are_red_green_blue_around_zero():
    color = np.zeros((424, 512, 3), dtype=np.uint8)
    color[...] = (255, 128, 0)
    red, green, blue = network_input(flat(512, 424), 365.0, color)[:3, 50, 50]
    assert red == -blue > 1.5 and abs(green) < 0.01


def test_without_colour_its_planes_are_zero_and_depth_is_the_same():
    color = np.random.default_rng(0).integers(0, 256, (424, 512, 3), dtype=np.uint8)
    without, with_color = (network_input(flat(512, 424), 365.0, c) for c in (None, color))
    assert (without[:3] == 0).all() and (with_color[:3] != 0).mean() > 0.9
    assert (without[3] == with_color[3]).all()


def test_a_frame_brings_its_own_focal_length():
    camera = PinholeCamera(512, 424, 365.0, 365.0, 256.0, 212.0)
    frame = Frame(0, 0.0, camera, flat(512, 424))
    assert (frame_input(frame) == network_input(flat(512, 424), 365.0)).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_depth_that_is_no_depth_is_named(value):
    depth = flat(512, 424)
    depth[7, 9] = depth[100, 100] = value
    with pytest.raises(InputError, match=f"depth = {value} m, one of 2 such pixels"):
        network_input(depth, 365.0)


def test_minus_zero_is_a_hole_like_any_other():
    assert (network_input(-flat(512, 424, 0.0), 365.0)[3] == HOLE).all()


@pytest.mark.parametrize(
    ("depth", "words"),
    [
        (np.ones((424, 512, 1), np.float32), r"shape \(424, 512, 1\)"),
        (np.ones((424, 512), np.uint16), "type uint16"),
        (np.ones((8, 512), np.float32), "512 x 8 px: at least 16 x 16"),
    ],
)
def test_a_depth_image_of_a_wrong_kind_is_named(depth, words):
    with pytest.raises(InputError, match=words):
        network_input(depth, 365.0)


def test_colour_of_another_size_is_named_with_both():
    with pytest.raises(InputError, match=r"\(480, 640, 3\).*\(424, 512\)"):
        network_input(flat(512, 424), 365.0, np.zeros((480, 640, 3), np.uint8))


@pytest.mark.parametrize("focal_px", [0.0, -3.0, np.nan])
def test_a_focal_length_that_is_none_is_named(focal_px):
    with pytest.raises(InputError, match="focal length"):
        network_input(flat(512, 424), focal_px)


def test_a_frame_without_depth_tells_why():
    camera = PinholeCamera(512, 424, 365.0, 365.0, 256.0, 212.0)
    with pytest.raises(InputError, match="frame 7 has no depth: cannot read it"):
        frame_input(Frame(7, 0.0, camera, None, problem="cannot read it"))


def test_an_unknown_label_is_named():
    labels = np.zeros((106, 128), dtype=np.uint8)
    labels[3, 4] = 7
    with pytest.raises(InputError, match="label 7: 0 to 6 are known"):
        labels_to_network(labels)


def test_a_label_map_of_another_size_does_not_go_back():
    with pytest.raises(InputError, match=r"labels of shape \(128, 106\)"):
        labels_to_image(np.zeros((128, 106), np.uint8), 640, 480)

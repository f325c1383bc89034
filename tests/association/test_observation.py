# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.association.observation import observe, within
from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame

CAMERA = PinholeCamera(width=640, height=481, fx=520.0, fy=525.0, cx=319.5, cy=240.0)


@pytest.fixture
def frame():
    depth = np.random.default_rng(0).uniform(0.5, 5.0, (481, 640)).astype(np.float32)
    depth[::3, ::5] = 0.0
    depth[7, 11] = np.nan
    return Frame(0, 0.0, CAMERA, depth)


@pytest.mark.parametrize(
    ("max_width_px", "factor"), [(640, 1), (5000, 1), (639, 2), (320, 2), (319, 3), (160, 4)]
)
def test_an_image_is_thinned_to_the_largest_width_that_is_allowed(frame, max_width_px, factor):
    observation = observe(frame, max_width_px)
    assert observation.camera == CAMERA.scaled(factor)
    assert observation.camera.width <= max_width_px
    assert observation.points_camera.shape == (
        observation.camera.height,
        observation.camera.width,
        3,
    )
    expected = CAMERA.back_project(frame.depth_m)[::factor, ::factor]
    assert np.allclose(observation.points_camera, expected, atol=1e-6)


def test_the_region_is_every_pixel_with_a_reading(frame):
    region = observe(frame, 640).region
    assert not region[::3, ::5].any() and not region[7, 11]
    assert region.sum() == np.count_nonzero(np.nan_to_num(frame.depth_m))


def test_points_outside_a_box_leave_the_region_but_not_the_image(frame):
    whole = observe(frame, 320)
    box = np.array([[-0.5, -0.3, 1.0], [0.4, 0.6, 2.0]])
    part = within(whole, box)
    p = part.points_camera[part.region]
    assert len(p) > 100
    assert (p >= box[0]).all() and (p <= box[1]).all()
    left_out = whole.points_camera[whole.region & ~part.region]
    assert ((left_out < box[0]) | (left_out > box[1])).any(axis=1).all()
    assert np.array_equal(part.points_camera, whole.points_camera)


def test_pixels_without_a_reading_stay_out_even_if_the_box_holds_the_camera(frame):
    part = within(observe(frame, 320), np.array([[-9.0] * 3, [9.0] * 3]))
    assert np.array_equal(part.region, observe(frame, 320).region)


def test_with_labels_the_region_is_the_labelled_pixels_that_have_a_reading(frame):
    labels = np.zeros((481, 640), dtype=np.uint8)
    labels[100:300, 200:400] = 2
    seen = observe(frame, 640, labels=labels)
    assert np.array_equal(seen.region, observe(frame, 640).region & (labels == 2))
    assert np.array_equal(seen.labels == 2, seen.region)
    assert seen.has_background == observe(frame, 640).has_background


@pytest.mark.parametrize("height", [90, 300])
def test_without_background_only_what_is_mostly_labelled_takes_labels(height):
    """A person who is cut out lends her labels to her unlabelled pixels; a floor gets none."""
    depth = np.zeros((481, 640), dtype=np.float32)
    depth[100 : 100 + height, 200:300] = 2.0
    labels = np.zeros((481, 640), dtype=np.uint8)
    labels[100:180, 200:300] = 2
    seen = observe(Frame(0, 0.0, CAMERA, depth), 640, labels=labels)
    assert not seen.has_background
    assert seen.region.sum() == 100 * (height if height == 90 else 80)


@pytest.mark.parametrize("wall_rows", [0, 100, 400])
def test_a_room_may_show_little_of_itself_and_a_cut_out_person_none(wall_rows):
    """Far walls and what is too near have no reading: an eighth that is not hers is a room."""
    depth = np.zeros((481, 640), dtype=np.float32)
    depth[:wall_rows] = 4.0
    depth[100:400, 300:340] = 2.0
    labels = np.zeros((481, 640), dtype=np.uint8)
    labels[100:400, 300:340] = 2
    seen = observe(Frame(0, 0.0, CAMERA, depth), 640, labels=labels)
    assert seen.has_background == (wall_rows > 0)
    assert (seen.labels > 0).sum() == 300 * 40

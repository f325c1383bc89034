# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.geometry import PinholeCamera
from kintrack.segmenter import Region, region_of
from segmentation.labels import INPUT_HEIGHT, INPUT_WIDTH
from segmentation.region import (
    FINEST,
    WINDOW_M,
    cells_per_pixel,
    region_of_person,
    window,
)

FOCAL = 365.0


@pytest.mark.parametrize("depth_m", [0.8, 2.0, 4.0])
def test_a_person_has_one_size_in_the_picture_wherever_she_stands(depth_m):
    cells = 1.7 * FOCAL / depth_m * cells_per_pixel(depth_m, FOCAL)
    assert cells == pytest.approx(1.7 / WINDOW_M * INPUT_HEIGHT)


def test_somebody_far_away_is_not_magnified_without_end():
    assert cells_per_pixel(20.0, FOCAL) == FINEST


@pytest.mark.parametrize("center", [(256.0, 212.0), (20.0, 300.0), (500.0, 10.0)])
@pytest.mark.parametrize("depth_m", [0.7, 1.5, 3.0, 6.0])
def test_the_window_lies_in_the_image_and_the_piece_where_it_belongs(center, depth_m):
    view = window(Region(center, depth_m), 512, 424, FOCAL)
    assert view is not None
    rows, columns, fit = view
    assert 0 <= columns.start < columns.stop <= 512 and 0 <= rows.start < rows.stop <= 424
    assert (fit.width, fit.height) == (columns.stop - columns.start, rows.stop - rows.start)
    assert 0 <= fit.left and fit.left + fit.columns <= INPUT_WIDTH
    assert 0 <= fit.top and fit.top + fit.rows <= INPUT_HEIGHT
    scale = cells_per_pixel(depth_m, FOCAL)
    assert (columns.start - 0.5 - center[0]) * scale + 0.5 * INPUT_WIDTH == pytest.approx(
        fit.left, abs=0.5 + scale
    )
    assert (rows.start - 0.5 - center[1]) * scale + 0.5 * INPUT_HEIGHT == pytest.approx(
        fit.top, abs=0.5 + scale
    )


def test_a_region_outside_the_image_has_no_window():
    assert window(Region((2000.0, 100.0), 2.0), 512, 424, FOCAL) is None


def scene(*people):
    """Labels and depth of a wall at 4 m and rectangles (rows, columns, label, depth) before it."""
    labels, depth = np.zeros((106, 128), np.uint8), np.full((424, 512), 4.0, np.float32)
    for rows, columns, label, z in people:
        labels[rows, columns] = label
        depth[4 * rows.start : 4 * rows.stop, 4 * columns.start : 4 * columns.stop] = z
    return labels, depth


def test_the_region_is_where_most_square_metres_are_labelled():
    near = (slice(10, 30), slice(10, 20), 2, 1.0)
    far = (slice(40, 60), slice(80, 90), 2, 3.0)
    found = region_of_person(*scene(near, far), FOCAL)
    assert found.depth_m == pytest.approx(3.0)
    assert found.center_px == pytest.approx((4 * 84.5 + 1.5, 4 * 49.5 + 1.5), abs=2)


def test_what_an_object_cuts_off_belongs_to_the_person_and_others_do_not():
    upper, lower = (slice(20, 50), slice(60, 75), 2, 2.0), (slice(70, 90), slice(60, 75), 5, 2.1)
    stranger = (slice(30, 50), slice(100, 105), 2, 3.5)
    found = region_of_person(*scene(upper, lower, stranger), FOCAL)
    assert found.center_px == pytest.approx((4 * 67 + 1.5, 4 * 54.5 + 1.5), abs=6)


def test_somebody_at_the_side_of_the_image_counts_less_than_one_who_is_all_in_it():
    aside = (slice(10, 90), slice(0, 20), 2, 2.0)
    inside = (slice(30, 70), slice(95, 115), 2, 2.0)
    assert region_of_person(*scene(aside, inside), FOCAL).center_px[0] > 350
    assert region_of_person(*scene(aside), FOCAL).center_px[0] < 60


def test_a_few_stray_pixels_are_nobody():
    assert region_of_person(*scene((slice(5, 7), slice(5, 7), 1, 1.0)), FOCAL) is None


def test_a_tracked_body_says_where_she_is():
    camera = PinholeCamera(512, 424, FOCAL, FOCAL, 255.5, 211.5)
    found = region_of(np.array([[-0.2, -0.8, 2.0], [0.2, 0.8, 2.0], [0.0, 0.0, 2.0]]), camera)
    assert found.center_px == pytest.approx((255.5, 211.5)) and found.depth_m == 2.0
    assert region_of(np.array([[0.0, 0.0, -1.0]]), camera) is None
    assert region_of(np.array([[9.0, 0.0, 1.0]]), camera) is None


def test_a_patch_with_nothing_near_its_middle_is_nobody():
    """Two boards side by side, joined by their labels, far apart in depth."""
    labels, depth = np.zeros((60, 80), np.uint8), np.full((60, 80), 5.0, np.float32)
    labels[10:50, 20:60] = 2
    depth[10:50, 20:40], depth[10:50, 40:60] = 2.0, 6.0
    assert region_of_person(labels, depth, 70.0) is None

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from export.small_track import CAMERA, SKIN, shoot
from kintrack.export import BONES, PART_COLORS, STATUS_COLORS, contact_sheet, depth_range
from kintrack.export.overlay import BAR_PX, depth_picture, draw_overlay, upscale_factor, upscaled
from kintrack.joints import JOINT_NAMES
from kintrack.raster import rasterise

FACTOR = upscale_factor(CAMERA)


def draw(frame, vertices=None, joints=None, status="tracking"):
    return draw_overlay(frame, vertices, SKIN.faces, SKIN.labels, joints, status, "frame 0")


def panels(picture):
    width = CAMERA.width * FACTOR
    return picture[BAR_PX:, :width].astype(int), picture[BAR_PX:, -width:].astype(int)


def test_every_joint_but_the_root_ends_exactly_one_bone():
    assert tuple(child for _, child in BONES if child in JOINT_NAMES[1:5]) == JOINT_NAMES[1:5]
    assert sorted(child for _, child in BONES) == sorted(JOINT_NAMES[1:])
    assert [JOINT_NAMES.index(child) for _, child in BONES] == list(range(1, 21))


@pytest.mark.parametrize(("width", "factor"), [(160, 4), (320, 2), (512, 1), (640, 1), (1280, 1)])
def test_pictures_are_enlarged_by_a_whole_factor_to_about_1280_px(width, factor):
    assert upscale_factor(replace(CAMERA, width=width)) == factor


def test_an_upscaled_pixel_block_has_the_centre_of_its_pixel():
    large = upscaled(CAMERA, 4)
    point = np.array([0.31, -0.2, 2.0])
    expected = (CAMERA.project(point) + 0.5) * 4 - 0.5
    assert np.allclose(large.project(point), expected)


def test_the_left_panel_is_the_depth_image_and_ignores_the_fit():
    shot = shoot(0)
    left, right = panels(draw(shot.frame, shot.vertices, shot.joints))
    alone, same = panels(draw(shot.frame))
    assert np.array_equal(left, alone)
    assert np.array_equal(alone, same)
    assert not np.array_equal(left, right)


def test_the_body_changes_exactly_the_pixels_of_its_silhouette():
    shot = shoot(0)
    left, right = panels(draw(shot.frame, shot.vertices))
    depth, _ = rasterise(shot.vertices, SKIN.faces, upscaled(CAMERA, FACTOR))
    changed = (left != right).any(axis=2)
    inside = np.isfinite(depth)
    assert not changed[~inside].any()
    assert changed[inside].mean() > 0.99


def test_each_part_has_its_own_tint():
    shot = shoot(0)
    blank = replace(shot.frame, depth_m=np.zeros_like(shot.frame.depth_m))
    _, right = panels(draw(blank, shot.vertices))
    _, face = rasterise(shot.vertices, SKIN.faces, upscaled(CAMERA, FACTOR))
    labels = np.where(face >= 0, SKIN.labels[SKIN.faces[face, 0]], 0)
    for label in range(1, 7):
        drawn = right[labels == label].mean(axis=0)
        wanted = PART_COLORS[label].astype(float)
        cosine = drawn @ wanted / np.linalg.norm(drawn) / np.linalg.norm(wanted)
        assert cosine > 0.99, label


def test_the_body_is_fainter_behind_something_nearer():
    shot = shoot(0)
    wall = np.full_like(shot.frame.depth_m, 1.0)
    curtain = np.full_like(shot.frame.depth_m, 3.5)
    body = np.isfinite(rasterise(shot.vertices, SKIN.faces, upscaled(CAMERA, FACTOR))[0])

    def change(depth_m):
        left, right = panels(draw(replace(shot.frame, depth_m=depth_m), shot.vertices))
        tint = right[body] - left[body]
        return np.abs(tint - tint.mean(axis=0)).mean()

    assert change(wall) < 0.6 * change(curtain)


def test_joints_are_marked_where_they_project():
    shot = shoot(0)
    _, right = panels(draw(shot.frame, shot.vertices, shot.joints))
    for u, v in upscaled(CAMERA, FACTOR).project(shot.joints).round().astype(int):
        assert (np.abs(right[v, u] - (255, 210, 60)) < 20).all()


def test_unknown_joints_and_joints_behind_the_camera_are_left_out():
    shot = shoot(0)
    joints = np.full_like(shot.joints, np.nan)
    joints[0] = 0.0, 0.0, -1.0
    assert np.array_equal(draw(shot.frame, joints=joints), draw(shot.frame))
    joints[0] = 1e9, 0.0, 1.0
    assert draw(shot.frame, joints=joints).shape == draw(shot.frame).shape


def test_a_body_of_nan_is_not_drawn():
    shot = shoot(0)
    assert np.array_equal(draw(shot.frame, np.full_like(shot.vertices, np.nan)), draw(shot.frame))


@pytest.mark.parametrize("status", STATUS_COLORS)
def test_the_bar_begins_with_the_color_of_the_status(status):
    picture = draw(shoot(0).frame, status=status)
    assert tuple(picture[2, 2]) == STATUS_COLORS[status]
    framed = tuple(picture[BAR_PX + 1, -2]) == STATUS_COLORS[status]
    assert framed == (status != "tracking")


def test_a_frame_without_depth_is_black_below_the_bar():
    frame = replace(shoot(0).frame, depth_m=None, problem="unreadable")
    left, _ = panels(draw(frame, status="skipped"))
    assert (left == 0).all()


def test_nearer_is_brighter_and_no_reading_is_black():
    depth_m = np.repeat([[0.0, 2.0, 2.4, 2.8, 3.2]], 40, axis=0).repeat(40, axis=1)
    picture = depth_picture(depth_m, (1.5, 3.5)).sum(axis=2)[20, 20::40].astype(int)
    assert picture[0] == 0
    assert (np.diff(picture[1:]) < 0).all()


def test_the_depth_range_covers_the_scene_on_steady_steps():
    assert depth_range(None) == (0.5, 5.0)
    assert depth_range(np.zeros((4, 4))) == (0.5, 5.0)
    assert depth_range(np.linspace(1.2, 3.7, 100).reshape(10, 10)) == (1.0, 4.0)
    assert depth_range(np.linspace(1.3, 3.8, 100).reshape(10, 10)) == (1.0, 4.0)
    assert depth_range(np.full((4, 4), 2.2)) == (2.0, 3.0)


def test_a_contact_sheet_puts_pictures_in_reading_order():
    images = [np.full((10, 20, 3), value, dtype=np.uint8) for value in (10, 20, 30)]
    sheet = contact_sheet(images, 2)
    assert sheet.shape == (24, 44, 3)
    assert [sheet[0, 0, 0], sheet[0, 24, 0], sheet[14, 0, 0], sheet[14, 24, 0]] == [10, 20, 30, 255]
    assert contact_sheet(images[:1], 5).shape == (10, 20, 3)

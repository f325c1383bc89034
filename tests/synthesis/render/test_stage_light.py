# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from stage_shapes import CAMERA, DAY, PAPER, box, floor, lamp, sphere

from synthesis.albedo import Plain
from synthesis.mesh import Material, join
from synthesis.render.cast import camera_rays
from synthesis.render.lights import Lights, color_of_temperature, draw_lights
from synthesis.render.placing import looking_at
from synthesis.render.stage import Stage

FROM_ABOVE = looking_at(np.array([0.0, 0.0, 6.0]), np.zeros(3))
ASIDE = looking_at(np.array([3.0, 0.5, 1.8]), np.array([0.0, 0.0, 0.4]))


def _places(view, T_world_camera):
    """Where the pixels' rays end, world frame [m]."""
    rays = camera_rays(CAMERA, T_world_camera)
    return rays.origin + view.depth_m[..., None] * rays.directions.reshape(*view.depth_m.shape, 3)


def _shadow(place, light_at, low, high):
    """Whether the line from a place of the floor to a lamp crosses a box."""
    d = light_at - place
    ends = np.sort([(low - place) / d, (high - place) / d], axis=0)
    return ends[0].max(axis=-1) < np.minimum(ends[1].min(axis=-1), 1.0)


@pytest.mark.parametrize("moves", [False, True])
def test_a_shadow_falls_where_the_lamp_says(moves):
    low, high = np.array([-0.3, -0.4, 0.5]), np.array([0.4, 0.2, 0.9])
    light_at = np.array([1.2, -0.8, 3.0])
    parts = (floor(), box(low, high)) if moves else (None, None)
    fixed = parts[0] if moves else _joined(floor(), box(low, high))
    view = Stage(fixed, parts[1], lamp(light_at, 9.0)).view(None, CAMERA, FROM_ABOVE)
    place = _places(view, FROM_ABOVE)
    on_floor = np.abs(place[..., 2]) < 1e-6
    place[..., :2] += 1e-9
    expected = on_floor & _shadow(place, light_at, low, high)
    dark = on_floor & (view.color[..., 1] < 0.02)
    assert expected.sum() > 100
    # the pixels of the rim share what they see with their neighbours
    assert np.sum(dark & ~expected) == 0
    assert np.sum(expected & ~dark) < 2.5 * np.sqrt(expected.sum()) * 4


def _joined(*meshes):
    return join(list(meshes))


def test_a_wide_lamp_has_a_soft_shadow():
    slab = box([-0.3, -0.3, 0.8], [0.3, 0.3, 0.9])

    def half_lit(radius_m):
        view = Stage(floor(), slab, lamp([0.0, 1.5, 2.5], 6.0, radius_m))
        color = view.view(None, CAMERA, FROM_ABOVE).color[..., 1]
        alone = Stage(floor(), None, lamp([0.0, 1.5, 2.5], 6.0)).view(None, CAMERA, FROM_ABOVE)
        share = color / alone.color[..., 1]
        return np.sum((share > 0.2) & (share < 0.8))

    assert half_lit(0.4) > 1.5 * half_lit(0.0)


def test_light_falls_with_the_square_and_the_cosine():
    view = Stage(floor(), None, lamp([0.0, 0.0, 2.0], 1.0)).view(None, CAMERA, FROM_ABOVE)
    place = _places(view, FROM_ABOVE)
    square = (place[..., 0] ** 2 + place[..., 1] ** 2) + 4.0
    assert np.allclose(view.color[..., 0], 2.0 / square**1.5, rtol=0.01)


def test_a_ball_has_no_shadow_edges_from_its_triangles():
    ball = sphere([0.0, 0.0, 0.5], 0.5, rows=10)
    light_at = np.array([3.0, 2.0, 1.0])
    view = Stage(None, ball, lamp(light_at, 12.0)).view(None, CAMERA, ASIDE)
    place = _places(view, ASIDE)
    normal = (place - [0.0, 0.0, 0.5]) / 0.5
    to_lamp = light_at - place
    facing = np.einsum("hwi,hwi->hw", normal, to_lamp) / np.linalg.norm(to_lamp, axis=-1)
    lit = (view.labels == 0) & (view.depth_m > 0) & (facing > 0.15)
    expected = 12.0 * facing / (to_lamp**2).sum(axis=-1)
    assert lit.sum() > 300
    assert np.abs(view.color[..., 0] - expected)[lit].max() < 0.12
    assert np.abs(view.color[..., 0] - expected)[lit].mean() < 0.03


def test_the_sides_of_a_box_are_flat():
    view = Stage(box([-0.5, -0.4, 0.0], [0.5, 0.4, 0.9]), None, DAY).view(None, CAMERA, ASIDE)
    values = np.unique(np.round(view.color[view.depth_m > 0], 4))
    assert len(values) == 2  # the top sees the sky, the sides half of it


def test_colour_comes_from_the_pattern():
    paint = Material(Plain((0.2, 0.5, 0.7)))
    view = Stage(floor(material=paint), None, DAY).view(None, CAMERA, FROM_ABOVE)
    assert np.allclose(view.color[view.depth_m > 0], 0.4 * np.array([0.2, 0.5, 0.7]), atol=1e-6)


def test_gloss_makes_a_highlight():
    def brightest(gloss):
        ball = sphere([0, 0, 0.5], 0.5, material=replace(PAPER, gloss=gloss))
        view = Stage(None, ball, lamp([2.5, 0.0, 2.0], 9.0)).view(None, CAMERA, ASIDE)
        return view.color[view.depth_m > 0].max()

    assert brightest(0.3) > 1.5 * brightest(0.0)


def test_the_floor_is_darker_under_a_thing():
    thing = box([-0.3, -0.3, 0.1], [0.3, 0.3, 0.6])
    for fixed, moving in ((floor(), thing), (_joined(floor(), thing), None)):
        view = Stage(fixed, moving, DAY).view(None, CAMERA, ASIDE)
        place = _places(view, ASIDE)
        on_floor = (np.abs(place[..., 2]) < 1e-6) & (view.depth_m > 0)
        away = np.linalg.norm(place[..., :2], axis=-1)
        near, far = on_floor & (away < 0.45), on_floor & (away > 1.5)
        assert view.color[near].mean() < 0.9 * view.color[far].mean()


def test_the_kept_background_is_what_a_fresh_stage_sees():
    rng = np.random.default_rng(0)
    lights, ball = draw_lights(rng), sphere([0.0, 0.0, 0.5], 0.3, label=2)
    room = _joined(floor(), box([-1.5, -1.0, 0.0], [-0.8, 1.0, 1.5]))
    stage = Stage(room, ball, lights)
    for n, T in enumerate((ASIDE, ASIDE, FROM_ABOVE, FROM_ABOVE, ASIDE)):
        vertices = ball.vertices + [0.0, 0.2 * n, 0.1 * n]
        old, new = stage, Stage(room, ball, lights)
        old_view, new_view = (s.view(vertices, CAMERA, T) for s in (old, new))
        for name in ("depth_m", "angle_rad", "infrared", "labels", "color"):
            assert np.array_equal(getattr(old_view, name), getattr(new_view, name)), name
        depth = stage.view(vertices, CAMERA, T, color=False)
        assert depth.color is None
        assert np.array_equal(depth.depth_m, new_view.depth_m)


def test_views_do_not_share_memory():
    stage = Stage(floor(), None, DAY)
    first = stage.view(None, CAMERA, ASIDE)
    again = first.depth_m.copy(), first.labels.copy(), first.color.copy()
    for array in (first.depth_m, first.labels, first.color, first.infrared, first.angle_rad):
        array[:] = 7
    second = stage.view(None, CAMERA, ASIDE)
    for array, before in zip((second.depth_m, second.labels, second.color), again, strict=True):
        assert np.array_equal(array, before)


def test_warm_light_is_red_and_cool_light_is_blue():
    warm, cool = color_of_temperature(2700.0), color_of_temperature(8000.0)
    assert warm[0] > warm[1] > warm[2]
    assert cool[2] > cool[0]
    assert np.allclose(color_of_temperature(6504.0), 1.0, atol=0.08)
    for color in (warm, cool):
        assert color @ [0.2126, 0.7152, 0.0722] == pytest.approx(1.0, abs=0.02)


def test_drawn_lights_are_as_bright_as_said_and_differ():
    brightness = []
    for seed in range(30):
        lights = draw_lights(np.random.default_rng(seed))
        same = draw_lights(np.random.default_rng(seed))
        assert isinstance(lights, Lights)
        assert np.array_equal(lights.key.position, same.key.position)
        view = Stage(floor(z=1.0), None, lights).view(None, CAMERA, FROM_ABOVE)
        middle = view.color[CAMERA.height // 2, CAMERA.width // 2]
        brightness.append(middle.mean())
    assert 0.6 < np.mean(brightness) < 1.4
    assert np.std(brightness) > 0.05

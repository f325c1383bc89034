# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.patterns import (
    Checks,
    Dots,
    Face,
    Image,
    Marble,
    Plain,
    Planks,
    Print,
    Skin,
    Speckle,
    Stripes,
    Tiles,
    Wood,
    cloth_pattern,
    denim_pattern,
    floor_pattern,
    hair_color,
    linear,
    paint_pattern,
    skin_tone,
    wall_pattern,
    wood_pattern,
)

A, B = (0.1, 0.2, 0.3), (0.7, 0.6, 0.5)
WOOD = Wood(B, A)
PATTERNS = (
    Plain(A), Stripes(A, B), Checks(A, B), Dots(A, B), Speckle(A, B), Print(Plain(A), B), Skin(B),
    Face(Skin(B), A, (0.0, 0.0, 0.0)), WOOD, Planks(WOOD), Tiles(A, B), Marble(A, B),
    Image(np.full((4, 6, 3), 128, np.uint8)),
)  # fmt: skip
PLACES = np.random.default_rng(0).uniform(-2.0, 2.0, size=(500, 3))


@pytest.mark.parametrize("pattern", PATTERNS, ids=lambda p: type(p).__name__)
def test_a_place_has_one_colour_whatever_else_is_asked(pattern):
    colors = pattern(PLACES)
    assert colors.shape == (500, 3)
    assert colors.min() >= 0.0 and colors.max() <= 1.0
    np.testing.assert_array_equal(pattern(PLACES[40:43]), colors[40:43])


@pytest.mark.parametrize("pattern", PATTERNS[1:-1], ids=lambda p: type(p).__name__)
def test_every_kind_but_plain_has_more_than_one_colour(pattern):
    assert len(np.unique(pattern(PLACES), axis=0)) > 1


def test_stripes_repeat_with_their_period():
    stripes = Stripes(A, B, period_m=0.1, share=0.5)
    heights = np.array([0.02, 0.07, 0.12, 0.17])
    colors = stripes(np.column_stack([0 * heights, 0 * heights, heights]))
    np.testing.assert_array_equal(colors, [B, A, B, A])


def test_an_image_has_its_last_row_at_the_bottom_and_repeats():
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[1, 0] = 255
    uv = np.array([[0.25, 0.25, 0.0], [0.25, 0.75, 0.0], [1.25, -0.75, 0.0]])
    np.testing.assert_allclose(Image(pixels)(uv)[:, 0], [1.0, 0.0, 1.0])


def test_srgb_is_made_linear():
    assert linear("ffffff") == (1.0, 1.0, 1.0)
    assert linear("bcbcbc")[0] == pytest.approx(0.5028, abs=1e-3)


def test_a_face_has_brows_and_lips_in_front_only():
    face = Face(Skin(B), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    places = np.array([[0.09, 0.032, 0.02], [0.09, 0.0, -0.064], [-0.09, 0.032, 0.02]])
    change = np.abs(face(places) - Skin(B)(places)).sum(axis=1)
    assert change[0] > 0.1 and change[1] > 0.1
    assert change[2] == 0.0


@pytest.mark.parametrize(
    "draw",
    [cloth_pattern, denim_pattern, floor_pattern, paint_pattern, wall_pattern, wood_pattern],
)
def test_the_same_seed_draws_the_same_pattern_and_others_differ(draw):
    def colors(seed: int):
        return draw(np.random.default_rng(seed))(PLACES)

    np.testing.assert_array_equal(colors(3), colors(3))
    assert len({colors(seed).tobytes() for seed in range(12)}) > 5


def test_skin_and_hair_vary_from_dark_to_light():
    rng = np.random.default_rng(1)
    skin = np.array([skin_tone(rng) for _ in range(200)])
    hair = np.array([hair_color(rng) for _ in range(200)])
    assert skin[:, 1].min() < 0.08 and skin[:, 1].max() > 0.5
    assert hair[:, 1].min() < 0.01 and hair[:, 1].max() > 0.2
    assert (skin[:, 0] > skin[:, 2]).all()

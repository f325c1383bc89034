# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from synthesis.sensors.color import ColorCamera, draw_color_camera

SHAPE = (96, 128, 3)
CLEAN = ColorCamera(
    balance=0.0, blur_px=0.0, vignetting=0.0, electrons=1e12, read_noise=0.0, smear_px=0.0
)


def _rng():
    return np.random.default_rng(0)


def _linear(image):
    """Inverse of sRGB (IEC 61966-2-1)."""
    c = image / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def _luminance(image):
    return (_linear(image) @ [0.2126, 0.7152, 0.0722]).mean()


def test_exposure_finds_its_target_however_bright_it_is():
    scene = _rng().uniform(0.3, 0.7, SHAPE)
    for level in (0.01, 1.0, 30.0):
        image = replace(CLEAN, target=0.2).develop(level * scene, _rng())
        assert image.dtype == np.uint8
        assert image.shape == SHAPE
        assert _luminance(image) == pytest.approx(0.2, abs=0.005)


def test_a_missed_exposure_is_missed_by_its_factor():
    image = replace(CLEAN, exposure_error=1.5).develop(np.ones(SHAPE), _rng())
    assert _luminance(image) == pytest.approx(0.3, abs=0.005)


def test_red_stays_first():
    scene = np.ones(SHAPE) * [0.9, 0.5, 0.1]
    red, green, blue = CLEAN.develop(scene, _rng()).mean(axis=(0, 1))
    assert red > green > blue


def test_white_balance_makes_warm_light_grey():
    scene = np.ones(SHAPE) * [1.0, 0.6, 0.3]
    grey = replace(CLEAN, balance=1.0).develop(scene, _rng())
    assert np.ptp(grey.reshape(-1, 3)) <= 1
    half = replace(CLEAN, balance=0.5).develop(scene, _rng()).mean(axis=(0, 1))
    none = CLEAN.develop(scene, _rng()).mean(axis=(0, 1))
    assert 0 < half[0] - half[2] < none[0] - none[2]


def test_noise_grows_with_fewer_electrons_and_follows_poisson():
    scene = np.ones(SHAPE)
    for electrons in (200.0, 2000.0):
        image = replace(CLEAN, electrons=electrons).develop(scene, _rng())
        spread = _linear(image).std()
        assert spread == pytest.approx(np.sqrt(0.2 / electrons), rel=0.1)


def test_blur_softens_an_edge():
    scene = np.full(SHAPE, 0.1)
    scene[:, 64:] = 0.6
    sharp, soft = (replace(CLEAN, blur_px=b).develop(scene, _rng())[48, :, 1] for b in (0.0, 1.0))
    assert np.unique(sharp).size == 2
    assert np.sum((soft > sharp.min() + 5) & (soft < sharp.max() - 5)) >= 3


def test_colours_lie_beside_the_depth_by_the_shift():
    scene = np.full(SHAPE, 0.1)
    scene[40:50, 60:70] = 0.6
    moved = replace(CLEAN, shift_px=(2.0, -1.0)).develop(scene, _rng())
    straight = CLEAN.develop(scene, _rng())
    assert np.abs(np.roll(straight, (-1, 2), axis=(0, 1)).astype(int) - moved).max() <= 1


def test_corners_lose_light():
    image = _linear(replace(CLEAN, vignetting=0.2).develop(np.ones(SHAPE), _rng()))
    assert image[0, 0, 1] / image[48, 64, 1] == pytest.approx(0.8, abs=0.02)


def test_highlights_are_compressed_not_cut():
    ramp = np.tile(np.linspace(0.0, 6.0, 128)[None, :, None], (96, 1, 3))
    row = CLEAN.develop(ramp, _rng())[0, :, 1].astype(int)
    assert np.all(np.diff(row) >= 0)
    bright = replace(CLEAN, target=0.6).develop(ramp, _rng())[0, :, 1]
    assert bright.max() <= 255
    assert np.unique(bright[bright > 230]).size > 5


def test_black_stays_black_and_finite():
    assert not CLEAN.develop(np.zeros(SHAPE), _rng()).any()


def test_the_same_generator_gives_the_same_bytes_and_cameras_differ():
    scene = _rng().uniform(0.0, 1.0, SHAPE)
    images = []
    for seed in (3, 3, 4):
        rng = np.random.default_rng(seed)
        images.append(draw_color_camera(rng).develop(scene, rng))
    assert images[0].tobytes() == images[1].tobytes()
    assert images[0].tobytes() != images[2].tobytes()


def test_the_radiance_is_left_alone():
    scene = np.ones(SHAPE, dtype=np.float32)
    draw_color_camera(_rng()).develop(scene, _rng())
    assert np.all(scene == 1.0)

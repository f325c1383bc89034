# SPDX-License-Identifier: Apache-2.0
"""Labels follow the readings."""

import numpy as np
import pytest

from kintrack.geometry import PinholeCamera
from synthesis.render.view import View
from synthesis.sensors.kinect_v1 import KinectV1
from synthesis.sensors.kinect_v2 import KinectV2
from synthesis.sensors.sensor import rays
from synthesis.sensors.shown import REACH, labels_shown
from synthesis.sensors.stereo import Stereo

HERS = 2


def scene(k=1, height=120, width=160):
    """A person 2 m away in the middle of a wall at 3 m."""
    camera = rays(PinholeCamera(width, height, 400.0, 400.0, width / 2, height / 2), k)
    shape = camera.height, camera.width
    depth, labels = np.full(shape, 3.0), np.zeros(shape, np.uint8)
    hers = slice(camera.height // 4, -camera.height // 4), slice(width * k // 3, -width * k // 3)
    depth[hers], labels[hers] = 2.0, HERS
    return View(camera, depth, np.zeros(shape), np.full(shape, 0.6), labels)


@pytest.mark.parametrize("k", [1, 2])
def test_perfect_readings_keep_the_labels_of_their_rays(k):
    view = scene(k)
    assert (labels_shown(view, view.depth_m[::k, ::k]) == view.labels[::k, ::k]).all()


def test_a_reading_of_her_beside_her_is_hers_and_one_of_the_wall_on_her_is_not():
    view = scene()
    left = int(np.flatnonzero(view.labels[60])[0])
    depth = view.depth_m.copy()
    depth[60, left - 3], depth[61, left + 2] = 2.01, 3.02
    shown = labels_shown(view, depth)
    assert shown[60, left - 3] == HERS and shown[61, left + 2] == 0
    assert (shown != view.labels).sum() == 2


def test_far_off_readings_between_surfaces_and_holes_keep_their_own():
    view = scene()
    left = int(np.flatnonzero(view.labels[60])[0])
    depth = view.depth_m.copy()
    depth[60, left - REACH - 1] = 2.0
    depth[61, left - 1], depth[62, left + 1] = 2.5, 2.5
    depth[63, left] = 0.0
    assert (labels_shown(view, depth) == view.labels).all()


@pytest.mark.parametrize(
    ("sensor", "width", "fattens"),
    [(KinectV1(), 640, True), (KinectV1(), 320, True), (Stereo(), 640, True),
     (KinectV2(), 512, False)],
)  # fmt: skip
def test_readings_with_her_depth_carry_her_label(sensor, width, fattens):
    height = 3 * width // 4
    sensor = sensor.with_camera(PinholeCamera(width, height, 400.0, 400.0, width / 2, height / 2))
    view = scene(sensor.supersampling, height, width)
    depth = sensor.measure(view, np.random.default_rng(0))
    hers = (depth > 1.9) & (depth < 2.1)
    shown = labels_shown(view, depth)
    assert hers.sum() > 5000 and (shown[hers] == HERS).all()
    assert (shown[depth > 2.9] == HERS).mean() < 1e-4  # stereo has outliers
    k = sensor.supersampling
    assert ((view.labels[::k, ::k][hers] == 0).sum() > 100) == fattens

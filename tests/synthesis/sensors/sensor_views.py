# SPDX-License-Identifier: Apache-2.0
"""Views worked out by hand."""

import numpy as np

from synthesis.render.view import View
from synthesis.sensors.sensor import rays


def plane(sensor, depth_m, tilt_deg=0.0, albedo=0.7):
    """An endless plane that crosses the axis at a depth, turned about the horizontal."""
    camera = rays(sensor.camera, sensor.supersampling)
    x, y = _slopes(camera)
    tilt = np.radians(tilt_deg)
    facing = np.cos(tilt) + y * np.sin(tilt) + 0.0 * x
    there = facing > 1e-2
    depth = np.where(there, depth_m * np.cos(tilt) / np.where(there, facing, 1.0), 0.0)
    angle = np.arccos(np.clip(facing / np.sqrt(1.0 + x**2 + y**2), 0.0, 1.0))
    return _view(camera, depth, np.where(there, angle, 0.0), albedo)


def screen(sensor, near_m, far_m, left_m, right_m, albedo=0.7):
    """An upright strip before a wall; infinite sides leave one edge or none."""
    camera = rays(sensor.camera, sensor.supersampling)
    x, y = _slopes(camera)
    strip = (x * near_m >= left_m) & (x * near_m < right_m) & (y < np.inf)
    depth = np.where(strip, near_m, far_m)
    return _view(camera, depth, np.zeros(depth.shape), albedo)


def nothing_but_a_disc(sensor, depth_m, radius_m):
    camera = rays(sensor.camera, sensor.supersampling)
    x, y = _slopes(camera)
    depth = np.where(x**2 + y**2 < (radius_m / depth_m) ** 2, depth_m, 0.0)
    return _view(camera, depth, np.zeros(depth.shape), 0.7)


def frames(sensor, view, n):
    rng = np.random.default_rng(0)
    return np.stack([sensor.measure(view, rng) for _ in range(n)])


def _slopes(camera):
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy)[:, None] / camera.fy
    return x, y


def _view(camera, depth, angle, albedo):
    there = depth > 0
    return View(
        camera, depth, angle, np.where(there, albedo, 0.0), np.zeros(depth.shape, dtype=np.uint8)
    )

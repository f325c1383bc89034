# SPDX-License-Identifier: Apache-2.0
"""Kinect v1: structured light, 640 x 480 or every second sample of it.

The camera matches dots of an infrared projector 7.5 cm to its right (`synthesis.sensors.matching`).
Disparity d = f b / z, f in samples, is reported in eighths of a sample, which makes steps of
z^2 / (8 f b), about 2.8e-3 z^2 m [KE12]. The random error is 1.425e-3 z^2 m, half a step [KE12];
rounding is 1/12 of a squared step of that.

Measured on real recordings (`tests/benchmarks/sensor_statistics.py`): half a step in planes, an
error that neighbours share over a window of 9 samples, about three quarters of its variance fixed
in place, a jump of disparity at the middle column, no readings in the 8 columns at the right.

Density of the dots, share of them that must agree and the median filter are fitted to the fraying
and the gaps of the recordings' edges. Assumptions: brightness of the dots, light below which one is
lost (the light falls with z^2, albedo and the angle; gloss is not modelled), size of the smooth
disparity bias of a device. [NIL12] measured a lateral error of 0.8 + 0.035 theta/(pi/2 -
theta) px; here it follows from the windows and is not put in.

[KE12] Khoshelham & Elberink, Accuracy and Resolution of Kinect Depth Data for Indoor Mapping
    Applications, Sensors 12(2), 2012.
[NIL12] Nguyen, Izadi, Lovell, Modeling Kinect Sensor Noise for Improved 3D Reconstruction and
    Tracking, 3DIMPVT 2012.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from synthesis.render.view import View
from synthesis.sensors.matching import agree_at_least, cells, dot_pattern, match, see_dots
from synthesis.sensors.noise import check_rays, pixel_field, smooth_field

CAMERA = PinholeCamera(width=640, height=480, fx=585.0, fy=585.0, cx=319.5, cy=239.5)
CAMERA_320 = PinholeCamera(width=320, height=240, fx=292.5, fy=292.5, cx=159.75, cy=119.75)


@dataclass(frozen=True)
class KinectV1:
    """The structured-light model."""

    camera: PinholeCamera = CAMERA
    """Camera of the images it delivers."""
    supersampling: int = 1
    """Samples a pixel along each axis: 1 at 640 x 480, 2 at 320 x 240."""
    device: int = 0
    """Draws what stays with one device: its dots and its bias."""
    baseline_m: float = 0.075
    """Projector to camera [m], [KE12]."""
    subpixels: int = 8
    """Disparity steps a sample, [KE12]."""
    fixed_steps: float = 0.42
    """Standard deviation of the error that stays with a surface [steps], fitted to planes."""
    noise_steps: float = 0.25
    """Standard deviation of the error of one frame [steps], fitted to still pixels."""
    bias_steps: float = 0.5
    """Standard deviation of the smooth disparity bias over the image [steps], assumed."""
    jump_steps: float = -0.7
    """Jump of the disparity at the middle column [steps], measured."""
    window_px: int = 9
    """Side of the matching window [samples], measured."""
    cell_px: int = 4
    """Side of the square that holds one dot [samples], fitted to the fraying of edges."""
    agreement: float = 0.5
    """Share of a full window's dots that must agree, fitted to edges and holes."""
    tolerance_px: float = 1.0
    """Dots within this disparity agree [samples], assumed."""
    least_signal: float = 0.004
    """Albedo times cosine over z^2 below which a mean dot is lost [1/m^2], assumed."""
    smoothing_px: int = 3
    """Side of the median filter over disparities and holes [samples], fitted to edges."""
    range_m: tuple[float, float] = (0.5, 8.0)
    """Depths that are reported [m]."""
    dead_columns: int = 8
    """Samples at the right without readings, measured."""

    def with_camera(self, camera: PinholeCamera) -> KinectV1:
        """The same sensor with other intrinsics; at most 400 px wide counts as 320 x 240."""
        return replace(self, camera=camera, supersampling=2 if camera.width <= 400 else 1)

    def measure(self, view: View, rng: np.random.Generator) -> Float[ndarray, "h w"]:
        """Depth image [m], 0 = no reading, shape (camera.height, camera.width).

        Args:
            view: Rays of `rays(camera, supersampling)`.
            rng: Draws the noise of this frame.

        Raises:
            SceneError: if the view has other rays.
        """
        check_rays(view, self.camera, self.supersampling)
        h, w = view.depth_m.shape
        fb = view.camera.fx * self.baseline_m
        shape = h, w + int(fb / self.range_m[0]) + 8
        grid = cells(shape, self.cell_px)
        fixed = self.fixed_steps * pixel_field(grid, self.device, 0)
        fresh = self.noise_steps * rng.standard_normal(grid, dtype=np.float32)
        # a window's mean of (window / cell)^2 dots has the error that is asked for
        errors_px = (fixed + fresh) * (self.window_px / self.cell_px / self.subpixels)
        disparity, seen, carried = see_dots(
            np.where(view.depth_m >= self.range_m[0], view.depth_m, 0.0),
            view.angle_rad,
            view.infrared,
            dot_pattern(shape, self.cell_px, self.device),
            errors_px,
            fb,
            False,
            2.0,
            self.least_signal,
            self.cell_px,
        )
        least = agree_at_least(self.window_px, self.cell_px, self.agreement)
        disparity = match(disparity, seen, carried, self.window_px // 2, least, self.tolerance_px)
        disparity = np.asarray(cv2.medianBlur(disparity, self.smoothing_px))
        return self._report(disparity, fb)[:: self.supersampling, :: self.supersampling]

    def _report(self, disparity: Float[ndarray, "h w"], fb: float) -> Float[ndarray, "h w"]:
        """Depth of the samples [m] from their disparity [px]."""
        h, w = disparity.shape
        bias = self.bias_steps * smooth_field((h, w), self.device)
        jump = self.jump_steps * (np.arange(w) >= w // 2)
        steps = np.rint(self.subpixels * disparity + bias + jump)
        depth = self.subpixels * fb / np.maximum(steps, 1.0)
        valid = (disparity > 0) & (depth >= self.range_m[0]) & (depth <= self.range_m[1])
        valid[:, w - self.dead_columns :] = False
        return np.where(valid, depth, 0.0)

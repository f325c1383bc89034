# SPDX-License-Identifier: Apache-2.0
"""Active stereo, like an Intel RealSense D435: two infrared imagers and a projector of texture.

Both imagers see the projected and the natural texture; disparity d = f b / z is matched with the
left one as reference (`synthesis.sensors.matching`). The error of depth is

    RMS = z^2 s / (f b)

with a disparity error s of about 0.08 px on well textured surfaces [GSW]. Neighbours share it,
since windows overlap: surfaces look like orange peel. What the right imager does not see gives no
depth: a band of f b / z columns at the left [D400] and shadows to the left of near things. The
windows fatten edges. Where little light returns the texture drowns: holes.

Assumptions: side of the window, density of texture, share of it that must agree, light below which
it is lost, three fifths of the error's variance fixed in place, far limit.

[GSW] Grunnet-Jepsen, Sweetser, Woodfill, Best-Known-Methods for Tuning Intel RealSense D400 Depth
    Cameras for Best Performance, Intel.
[D400] Intel RealSense D400 Series Product Family Datasheet, "Invalid Depth Band".
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
from synthesis.sensors.noise import check_rays, pixel_field

CAMERA = PinholeCamera(width=640, height=480, fx=385.0, fy=385.0, cx=319.5, cy=239.5)
CAMERA_848 = PinholeCamera(width=848, height=480, fx=424.0, fy=424.0, cx=423.5, cy=239.5)

LEFT = 0.87
"""Share of the disparity's error that the median filter leaves, measured."""


@dataclass(frozen=True)
class Stereo:
    """The active-stereo model."""

    camera: PinholeCamera = CAMERA
    """Camera of the images it delivers, the left imager."""
    supersampling: int = 1
    """Rays a pixel along each axis."""
    device: int = 0
    """Draws what stays with one device."""
    baseline_m: float = 0.050
    """Left imager to right [m]: 0.050 of a D435, 0.095 of a D455."""
    subpixel_px: float = 0.08
    """Standard deviation of the disparity [px], [GSW]."""
    fixed_share: float = 0.6
    """Share of its variance that stays with a surface, assumed."""
    subpixels: int = 32
    """Disparity steps a pixel."""
    window_px: int = 11
    """Side of the matching window [px], assumed."""
    cell_px: int = 4
    """Side of the square that holds one bit of texture [px], assumed."""
    agreement: float = 0.5
    """Share of a full window's texture that must agree, assumed."""
    tolerance_px: float = 1.0
    """Texture within this disparity agrees [px], assumed."""
    least_signal: float = 0.01
    """Albedo times cosine over z below which texture is lost [1/m], assumed.

    Over z and not z^2, since a part of the light is the room's."""
    smoothing_px: int = 5
    """Side of the median filter over disparities and holes [px], assumed."""
    range_m: tuple[float, float] = (0.28, 10.0)
    """Depths that are reported [m]."""

    def with_camera(self, camera: PinholeCamera) -> Stereo:
        """The same sensor with other intrinsics."""
        return replace(self, camera=camera)

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
        fixed = np.sqrt(self.fixed_share) * pixel_field(grid, self.device, 0)
        fresh = np.sqrt(1.0 - self.fixed_share) * rng.standard_normal(grid, dtype=np.float32)
        # a window's mean of (window / cell)^2 bits has the error that is asked for
        errors_px = (fixed + fresh) * (self.subpixel_px / LEFT * self.window_px / self.cell_px)
        disparity, seen, carried = see_dots(
            np.where(view.depth_m >= self.range_m[0], view.depth_m, 0.0),
            view.angle_rad,
            view.infrared,
            dot_pattern(shape, self.cell_px, self.device),
            errors_px.astype(np.float32),
            fb,
            True,
            1.0,
            self.least_signal,
            self.cell_px,
        )
        least = agree_at_least(self.window_px, self.cell_px, self.agreement)
        disparity = match(disparity, seen, carried, self.window_px // 2, least, self.tolerance_px)
        disparity = np.asarray(cv2.medianBlur(disparity, self.smoothing_px))
        steps = np.rint(self.subpixels * disparity)
        depth = self.subpixels * fb / np.maximum(steps, 1.0)
        valid = (steps > 0) & (depth >= self.range_m[0]) & (depth <= self.range_m[1])
        return np.where(valid, depth, 0.0)[:: self.supersampling, :: self.supersampling]


def stereo_sigma_m(
    depth_m: Float[ndarray, "*n"], fx_px: float, baseline_m: float, subpixel_px: float = 0.08
) -> Float[ndarray, "*n"]:
    """Published standard deviation of a reading [m], z^2 s / (f b), [GSW].

    Args:
        depth_m: Depth along z [m].
        fx_px: Focal length [px].
        baseline_m: Between the imagers [m].
        subpixel_px: Standard deviation of the disparity [px].
    """
    return depth_m**2 * subpixel_px / (fx_px * baseline_m)

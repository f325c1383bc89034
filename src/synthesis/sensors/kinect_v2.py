# SPDX-License-Identifier: Apache-2.0
"""Kinect v2: time of flight, 512 x 424.

Random error, theta the angle between ray and normal, z in metres [FBRKHS15]:

    sigma_z = 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) theta^2 / (pi/2 - theta)^2  mm

That was measured on a bright surface near the middle of the image. The light that returns is
A = albedo cos(theta) / z^2 times a falloff to the corners; the error grows as its root falls short
of the bright surface's, as photon noise does. Less light than a threshold gives no reading, so
dark, grazing and far surfaces and the corners are lost [WS16, SLK15]. A pixel covers an area: on an
edge it mixes the light of both sides and reads between them, a flying pixel [WS16, SLK15]; the
driver drops most of the far-off ones. Stray light from the neighbourhood pulls weak pixels
(a part of multipath [SLK15]); light that bounces in corners of a room is not modelled. Depth
wiggles by a few millimetres with distance [SLK15].

Assumptions: the root law, the falloff, the threshold, the share of dropped flying pixels, the
stray light's share, size of the fixed errors, correlation of neighbours by the driver's filter.

[FBRKHS15] Fankhauser et al., Kinect v2 for Mobile Robot Navigation: Evaluation and Modeling,
    ICAR 2015.
[WS16] Wasenmueller & Stricker, Comparison of Kinect v1 and v2 Depth Images in Terms of Accuracy
    and Precision, ACCV Workshops 2016.
[SLK15] Sarbolandi, Lefloch, Kolb, Kinect Range Sensing: Structured-Light versus Time-of-Flight
    Kinect, CVIU 139, 2015.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from statistics import NormalDist

import cv2
import numpy as np
from jaxtyping import Float, Float32
from numba import njit
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from synthesis.render.view import View
from synthesis.sensors.noise import check_rays, pixel_field, smooth_field

CAMERA = PinholeCamera(width=512, height=424, fx=365.5, fy=365.5, cx=255.5, cy=211.5)
STEEPEST_RAD = np.radians(82.0)
"""Beyond this angle the error grows no further: the formula's own does without bound [rad]."""
_COARSE = 16


@dataclass(frozen=True)
class KinectV2:
    """The time-of-flight model."""

    camera: PinholeCamera = CAMERA
    """Camera of the images it delivers."""
    supersampling: int = 1
    """Rays a pixel along each axis; the light of an edge is mixed from neighbouring rays."""
    device: int = 0
    """Draws what stays with one device."""
    bright_albedo: float = 0.7
    """Albedo on which the error is the published one, assumed."""
    least_light: float = 0.004
    """Albedo times cosine over z^2 below which there is no reading [1/m^2], assumed."""
    edge_share: float = 0.03
    """Depth between neighbouring rays that makes an edge, as a share of it."""
    dropped_share: float = 0.75
    """Share of far-off flying pixels that the driver drops, assumed."""
    fly_m: float = 0.05
    """A reading this far from both sides of an edge is far off [m], assumed."""
    stray_share: float = 0.01
    """Light of the neighbourhood that strays into a pixel, assumed."""
    wiggle_m: float = 0.003
    """Amplitude of the error that goes up and down with distance [m], order of [SLK15]."""
    wiggle_period_m: float = 0.94
    """Its period: half the wavelength of the 80 MHz modulation over two [m], assumed."""
    fixed_m: float = 0.001
    """Standard deviation of the error that stays with a pixel [m], assumed."""
    range_m: tuple[float, float] = (0.5, 4.5)
    """Depths that are reported [m], the maker's."""

    def with_camera(self, camera: PinholeCamera) -> KinectV2:
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
        k = self.supersampling
        shape = (self.camera.height, self.camera.width)
        depth, light, sigma = _weigh(
            np.ascontiguousarray(view.depth_m[::k, ::k]),
            np.ascontiguousarray(view.angle_rad[::k, ::k]),
            np.ascontiguousarray(view.infrared[::k, ::k]),
            corner_falloff(self.camera),
            self.bright_albedo,
        )
        stray, stray_depth = _strayed(depth, light, self.stray_share)
        return _read(
            depth,
            light,
            sigma,
            stray,
            stray_depth,
            pixel_field((2, *shape), self.device, 1),
            self.fixed_m * smooth_field(shape, self.device),
            rng.standard_normal(shape, dtype=np.float32),
            # light flickers in patches of 2 x 2
            rng.standard_normal(tuple(n // 2 + 1 for n in shape), dtype=np.float32),
            self.edge_share,
            self.fly_m,
            # the sum of two normal numbers stays below this so often
            np.sqrt(2.0) * NormalDist().inv_cdf(self.dropped_share),
            self.least_light,
            self.wiggle_m,
            2.0 * np.pi / self.wiggle_period_m,
            self.fixed_m,
            self.range_m[0],
            self.range_m[1],
        )


def time_of_flight_sigma_m(
    depth_m: Float[ndarray, "*n"], angle_rad: Float[ndarray, "*n"]
) -> Float[ndarray, "*n"]:
    """Standard deviation of a reading on a bright surface [m], [FBRKHS15].

    Args:
        depth_m: Depth along z [m].
        angle_rad: Angle between ray and normal [rad].
    """
    theta = np.minimum(angle_rad, STEEPEST_RAD)
    grazing = theta**2 / (np.pi / 2.0 - theta) ** 2
    return 1e-3 * (1.5 - 0.5 * depth_m + 0.3 * depth_m**2 + 0.1 * depth_m**1.5 * grazing)


@lru_cache(maxsize=8)
def corner_falloff(camera: PinholeCamera) -> Float32[ndarray, "h w"]:
    """Share of the light that reaches each pixel: cos^4, and a round edge beyond 41 degrees.

    Args:
        camera: The sensor's camera.

    Returns:
        Share, 1 in the middle, shape (height, width).
    """
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    square = x**2 + y[:, None] ** 2
    edge = np.clip((0.94 - np.sqrt(square)) / 0.12, 0.0, 1.0)
    share = (edge / (1.0 + square) ** 2).astype(np.float32)
    share.setflags(write=False)
    return share


def _strayed(
    depth: Float32[ndarray, "h w"], light: Float32[ndarray, "h w"], share: float
) -> tuple[Float32[ndarray, "h w"], Float32[ndarray, "h w"]]:
    """Light that strays into each pixel and the depth it comes from [m]."""
    h, w = depth.shape
    size = (max(w // _COARSE, 1), max(h // _COARSE, 1))
    both = cv2.resize(np.dstack([light, light * depth]), size, interpolation=cv2.INTER_AREA)
    coarse = np.asarray(cv2.blur(both, (7, 7)), dtype=np.float32)
    coarse[..., 1] /= np.maximum(coarse[..., 0], 1e-9)
    fine = np.asarray(cv2.resize(coarse, (w, h), interpolation=cv2.INTER_LINEAR))
    return share * fine[..., 0], np.ascontiguousarray(fine[..., 1])


@njit(cache=True)
def _weigh(depth_m, angle_rad, albedo, falloff, bright):
    """Depth, light and standard deviation of every ray, float32."""
    h, w = depth_m.shape
    depth = np.zeros((h, w), dtype=np.float32)
    light = np.zeros((h, w), dtype=np.float32)
    sigma = np.zeros((h, w), dtype=np.float32)
    for v in range(h):
        for u in range(w):
            z = depth_m[v, u]
            share = falloff[v, u]
            if z <= 0.0 or albedo[v, u] <= 0.0 or share <= 0.0:
                continue
            theta = min(angle_rad[v, u], STEEPEST_RAD)
            grazing = (theta / (np.pi / 2.0 - theta)) ** 2
            depth[v, u] = z
            light[v, u] = albedo[v, u] * np.cos(angle_rad[v, u]) / (z * z) * share
            published = 1e-3 * (1.5 - 0.5 * z + 0.3 * z * z + 0.1 * z * np.sqrt(z) * grazing)
            sigma[v, u] = published * np.sqrt(bright / (albedo[v, u] * share))
    return depth, light, sigma


@njit(cache=True)
def _read(
    depth, light, sigma, stray, stray_depth, fixed, bias, noise, flicker, edge_share, fly_m,
    dropped, least, wiggle, wave, fixed_m, nearest_m, farthest_m
):  # fmt: skip
    h, w = depth.shape
    out = np.zeros((h, w))
    for v in range(h):
        for u in range(w):
            # a pixel's area reaches into the rays beside it, by how its corner happens to lie
            x = 0.3 * fixed[0, v, u] + 0.1 * flicker[v // 2, u // 2]
            y = 0.3 * fixed[1, v, u] + 0.1 * noise[v, u]
            x, y = min(max(x, -0.5), 0.5), min(max(y, -0.5), 0.5)
            ub = min(max(u + (1 if x > 0 else -1), 0), w - 1)
            vb = min(max(v + (1 if y > 0 else -1), 0), h - 1)
            x, y = abs(x), abs(y)
            z, a, s = depth[v, u], light[v, u], sigma[v, u]
            z1, z2, z3 = depth[v, ub], depth[vb, u], depth[vb, ub]
            near, far = min(z, z1, z2, z3), max(z, z1, z2, z3)
            if far <= 0.0:
                continue
            flies = False
            if far - near > edge_share * far:
                weights = ((1 - x) * (1 - y) * a, x * (1 - y) * light[v, ub],
                           (1 - x) * y * light[vb, u], x * y * light[vb, ub])  # fmt: skip
                a = weights[0] + weights[1] + weights[2] + weights[3]
                if a <= 0.0:
                    continue
                z = weights[0] * z + weights[1] * z1 + weights[2] * z2 + weights[3] * z3
                z /= a
                s = max(s, sigma[v, ub], sigma[vb, u], sigma[vb, ub])
                low = near if near > 0.0 else z
                flies = z - low > fly_m and far - z > fly_m
            patch = 1.0 + 0.15 * (fixed[1, v // 3, u // 3] + flicker[v // 2, u // 2])
            if a * patch < least:
                continue
            if flies and fixed[0, v, u] + flicker[v // 2, u // 2] < dropped:
                continue
            z += stray[v, u] * (stray_depth[v, u] - z) / (a + stray[v, u])
            n = noise[v, u]
            n += 0.25 * (noise[v, u - 1] + noise[v, (u + 1) % w])
            n += 0.25 * (noise[v - 1, u] + noise[(v + 1) % h, u])
            z += s * n / np.float32(1.118034) + wiggle * np.sin(wave * z) + bias[v, u]
            z += 0.5 * fixed_m * fixed[0, v, u]
            if nearest_m <= z <= farthest_m:
                out[v, u] = z
    return out

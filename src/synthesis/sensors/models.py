# SPDX-License-Identifier: Apache-2.0
"""How two kinds of depth sensor misread a view.

Structured light (Kinect v1), f in samples, b the baseline between projector and camera:

* disparity d = f b / z is reported in steps of 1/8 sample, which makes steps of z^2 / (8 f b),
  about 2.8e-3 z^2 m;
* the random error of z is 1.425e-3 z^2 m, half a step of disparity [KE12]. Rounding contributes
  1/12 of a squared step, so the noise before rounding has variance 1/4 - 1/12. Neighbours share
  it, since their matching windows overlap;
* edges are ragged: a sample near one reads another sample, about one away.

Time of flight (Kinect v2), theta the angle between ray and normal:

* sigma_z = 1.5 - 0.5 z + 0.3 z^2 + 0.1 z^(3/2) theta^2 / (pi/2 - theta)^2  mm, z in metres, after
  [FBRKHS15];
* samples on a depth edge mix what lies on both sides ("flying pixels", [WS16]).

The widths of the windows, the share of flying pixels that the sensor's own filter passes and the
loss at grazing angles are assumptions. Every frame draws anew, whereas a part of a real sensor's
error stays from frame to frame.

[KE12] Khoshelham & Elberink, Accuracy and Resolution of Kinect Depth Data for Indoor Mapping
    Applications, Sensors 12(2), 2012.
[FBRKHS15] Fankhauser et al., Kinect v2 for Mobile Robot Navigation: Evaluation and Modeling,
    ICAR 2015.
[WS16] Wasenmueller & Stricker, Comparison of Kinect v1 and v2 Depth Images in Terms of Accuracy
    and Precision, ACCV Workshops 2016.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from synthesis.render.camera import SUPERSAMPLING, View

BASELINE_M = 0.075
"""Kinect v1: projector to camera [m]."""
SUBPIXELS = 8
"""Kinect v1: disparity steps a sample."""
NOISE_STEPS = np.sqrt(0.5**2 - 1.0 / 12.0)
"""Kinect v1: standard deviation of disparity before rounding [steps]."""
WINDOW_PX = 2.5
"""Kinect v1: standard deviation of the Gaussian that correlates its noise [samples]."""
LATERAL_PX = 1.0
"""Kinect v1: standard deviation of the lateral reading error [samples]."""
EDGE_M = 0.05
"""Depth range among neighbouring samples that makes an edge [m]."""
FLYING_SHARE = 0.3
"""Kinect v2: share of edge samples that fly instead of being right."""
GRAZING_RAD = (np.radians(70.0), np.radians(85.0))
"""Kinect v2: angles at which readings begin to be lost and at which all are [rad]."""

_NOWHERE_M = 1e3

Sensor = Callable[[View, np.random.Generator], Float[ndarray, "h w"]]
"""Depth as a sensor reports it [m], 0 = no reading, shape (height, width) of the image."""


def perfect(view: View, rng: np.random.Generator) -> Float[ndarray, "h w"]:
    """The true depth [m], shape (height, width); draws nothing."""
    return view.depth_m


def kinect_v1(view: View, rng: np.random.Generator) -> Float[ndarray, "h w"]:
    """Depth of a structured-light camera [m], 0 = no reading, shape (height, width).

    Args:
        view: What is there.
        rng: Draws the noise.
    """
    depth = view.sample_depth_m
    height, width = depth.shape
    shift = [np.rint(LATERAL_PX * _shared_noise(depth.shape, rng)).astype(int) for _ in range(2)]
    rows = np.clip(np.arange(height)[:, None] + shift[0], 0, height - 1)
    columns = np.clip(np.arange(width) + shift[1], 0, width - 1)
    filled = np.where(depth > 0, depth, _NOWHERE_M)
    on_edge = maximum_filter(filled, size=5) - minimum_filter(filled, size=5) > EDGE_M
    depth = np.where(on_edge, depth[rows, columns], depth)
    steps_m = SUBPIXELS * view.samples.fx * BASELINE_M
    noise = NOISE_STEPS * _shared_noise(depth.shape, rng)
    steps = np.rint(steps_m / np.where(depth > 0, depth, _NOWHERE_M) + noise)
    out = np.where(depth > 0, steps_m / np.maximum(steps, 1.0), 0.0)
    return out[::SUPERSAMPLING, ::SUPERSAMPLING]


def kinect_v2(view: View, rng: np.random.Generator) -> Float[ndarray, "h w"]:
    """Depth of a time-of-flight camera [m], 0 = no reading, shape (height, width).

    Args:
        view: What is there.
        rng: Draws the noise.
    """
    z, (start, end) = view.sample_depth_m, GRAZING_RAD
    sigma = time_of_flight_sigma_m(z, np.minimum(view.sample_angle_rad, end))
    depth = z + sigma * rng.normal(size=z.shape)
    near = minimum_filter(np.where(z > 0, z, _NOWHERE_M), size=3)
    range_m = maximum_filter(z, size=3) - near
    flying = (range_m > EDGE_M) & (rng.random(z.shape) < FLYING_SHARE)
    depth = np.where(flying, near + rng.random(z.shape) * range_m, depth)
    lost = rng.random(z.shape) < (view.sample_angle_rad - start) / (end - start)
    return np.where((z > 0) & ~lost, depth, 0.0)[::SUPERSAMPLING, ::SUPERSAMPLING]


def time_of_flight_sigma_m(
    depth_m: Float[ndarray, "*n"], angle_rad: Float[ndarray, "*n"]
) -> Float[ndarray, "*n"]:
    """Standard deviation of a Kinect v2 reading [m], [FBRKHS15].

    Args:
        depth_m: Depth along z [m].
        angle_rad: Angle between ray and normal [rad], below pi/2.
    """
    grazing = angle_rad**2 / (np.pi / 2.0 - angle_rad) ** 2
    return 1e-3 * (1.5 - 0.5 * depth_m + 0.3 * depth_m**2 + 0.1 * depth_m**1.5 * grazing)


def _shared_noise(shape: tuple[int, ...], rng: np.random.Generator) -> Float[ndarray, "h w"]:
    """Normal noise of unit variance that neighbours within `WINDOW_PX` share."""
    unit = 2.0 * np.sqrt(np.pi) * WINDOW_PX
    return unit * gaussian_filter(rng.normal(size=shape), WINDOW_PX, mode="wrap")


SENSORS: dict[str, Sensor] = {"perfect": perfect, "kinect_v1": kinect_v1, "kinect_v2": kinect_v2}
"""Every sensor by name."""

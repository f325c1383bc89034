# SPDX-License-Identifier: Apache-2.0
"""What the rays of a camera meet."""

from __future__ import annotations

from dataclasses import dataclass

from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.geometry import PinholeCamera


@dataclass(frozen=True)
class View:
    """One ray a pixel, without noise."""

    camera: PinholeCamera
    """Camera of the rays; pixel centres lie at integer coordinates."""
    depth_m: Float[ndarray, "h w"]
    """Depth along z [m], 0 = nothing there."""
    angle_rad: Float[ndarray, "h w"]
    """Angle between the ray and the surface's normal, 0..pi/2; 0 where nothing is."""
    infrared: Float[ndarray, "h w"]
    """Reflectance for the sensor's own light, 0..1; 0 where nothing is."""
    labels: UInt8[ndarray, "h w"]
    """Body part seen, 0 = background."""
    color: Float[ndarray, "h w 3"] | None = None
    """Linear red, green, blue radiance (1 = white paper in full light); None if not asked for."""


def pixel_radiance(view: View, supersampling: int) -> Float[ndarray, "h w 3"]:
    """Radiance of an image's pixels: the mean of their k x k rays, shape (height, width, 3)."""
    assert view.color is not None
    k = supersampling
    if k == 1:
        return view.color
    height, width, _ = view.color.shape
    return view.color.reshape(height // k, k, width // k, k, 3).mean(axis=(1, 3))

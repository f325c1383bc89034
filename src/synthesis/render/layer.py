# SPDX-License-Identifier: Apache-2.0
"""What the rays of an image bring back, while meshes are put in one after the other."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from synthesis.render.shadow import lit_share
from synthesis.render.view import View


@dataclass(frozen=True)
class Layer:
    """What N rays bring back, before shadows; written as meshes are put in."""

    depth_m: Float[ndarray, " n"]
    """Depth along the camera's z [m], infinite where nothing is."""
    angle_rad: Float[ndarray, " n"]
    """Angle between ray and surface's normal."""
    infrared: Float[ndarray, " n"]
    """Reflectance for the sensor's own light."""
    labels: UInt8[ndarray, " n"]
    """Body parts."""
    normal: Float[ndarray, "c 3"]
    """Smooth unit normal; this and all below without rows if colour is not wanted."""
    place: Float[ndarray, "c 3"]
    """Where rays to the key lamp start, world frame [m]."""
    diffuse: Float[ndarray, "c 3"]
    """Radiance that is not the key lamp's."""
    key: Float[ndarray, "c 3"]
    """Radiance that is."""
    clear: UInt8[ndarray, " c"]
    """1 where nothing is known to hide the key lamp."""

    def copy(self) -> Layer:
        """The same in other memory."""
        return Layer(*(getattr(self, field.name).copy() for field in fields(self)))


def nothing(count: int, haze: Float[ndarray, " 3"], color: bool) -> Layer:
    """The layer of rays that meet nothing.

    Args:
        count: Rays.
        haze: Their radiance.
        color: Whether colour is wanted.
    """
    rows = count if color else 0
    return Layer(
        depth_m=np.full(count, np.inf),
        angle_rad=np.zeros(count),
        infrared=np.zeros(count),
        labels=np.zeros(count, dtype=np.uint8),
        normal=np.zeros((rows, 3), dtype=np.float32),
        place=np.zeros((rows, 3), dtype=np.float32),
        diffuse=np.tile(haze.astype(np.float32), (rows, 1)),
        key=np.zeros((rows, 3), dtype=np.float32),
        clear=np.zeros(rows, dtype=np.uint8),
    )


def as_view(layer: Layer, camera: PinholeCamera, color: bool) -> View:
    """The image of a layer, in memory of its own."""
    shape = (camera.height, camera.width)
    radiance = None
    if color:
        clear, normal, place = layer.clear, layer.normal, layer.place
        share = lit_share(clear.reshape(shape), normal.reshape(*shape, 3), place.reshape(*shape, 3))
        radiance = layer.diffuse.reshape(*shape, 3) + share[..., None] * layer.key.reshape(
            *shape, 3
        )
    return View(
        camera=camera,
        depth_m=np.where(np.isfinite(layer.depth_m), layer.depth_m, 0.0).reshape(shape),
        angle_rad=layer.angle_rad.reshape(shape).copy(),
        infrared=layer.infrared.reshape(shape).copy(),
        labels=layer.labels.reshape(shape).copy(),
        color=radiance,
    )

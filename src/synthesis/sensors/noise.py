# SPDX-License-Identifier: Apache-2.0
"""What several sensor models share: checks, smooth fields and the flaws one device keeps."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from jaxtyping import Float, Float32
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from synthesis.render.view import View
from synthesis.sensors.sensor import rays


def check_rays(view: View, camera: PinholeCamera, supersampling: int) -> None:
    """Pass if a view has the rays that a sensor asks for.

    Raises:
        SceneError: if it has not.
    """
    wanted = rays(camera, supersampling)
    if view.camera != wanted:
        raise SceneError(f"view of {view.camera}: the sensor needs the rays of {wanted}")
    if view.depth_m.shape != (wanted.height, wanted.width):
        raise SceneError(
            f"view of shape {view.depth_m.shape}; allowed: {(wanted.height, wanted.width)}"
        )


@lru_cache(maxsize=8)
def smooth_field(shape: tuple[int, int], device: int, waves: int = 3) -> Float[ndarray, "h w"]:
    """A smooth random field of mean 0 and variance 1 that one device keeps.

    Sum of cosines with up to `waves` half periods across the image, random weights that fall with
    frequency.

    Args:
        shape: (height, width).
        device: Number of the device; the same number gives the same field.
        waves: Half periods along each axis at most.

    Returns:
        The field, read-only, shape (height, width).
    """
    rng = np.random.default_rng([device, 1])
    weight = rng.normal(size=(waves + 1, waves + 1)) / (1.0 + np.add.outer(*2 * [range(waves + 1)]))
    rows, columns = (
        np.cos(np.pi * np.outer(np.arange(n) / max(n - 1, 1), np.arange(waves + 1))) for n in shape
    )
    field = rows @ weight @ columns.T
    field = (field - field.mean()) / max(float(field.std()), 1e-12)
    field.setflags(write=False)
    return field


@lru_cache(maxsize=8)
def pixel_field(shape: tuple[int, ...], device: int, salt: int) -> Float32[ndarray, "*shape"]:
    """Independent normal numbers of unit variance that one device keeps.

    Args:
        shape: Shape of the field.
        device: Number of the device; the same number gives the same field.
        salt: Tells the fields of one device apart.

    Returns:
        The field, read-only, float32, shape `shape`.
    """
    field = np.random.default_rng([device, 2, salt]).standard_normal(shape, dtype=np.float32)
    field.setflags(write=False)
    return field

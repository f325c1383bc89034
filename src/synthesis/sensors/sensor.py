# SPDX-License-Identifier: Apache-2.0
"""What every sensor model offers."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from synthesis.render.view import View


class Sensor(Protocol):
    """A depth sensor as a function of what is there."""

    @property
    def camera(self) -> PinholeCamera:
        """Camera of the images it delivers."""
        ...

    @property
    def supersampling(self) -> int:
        """Rays a pixel along each axis that `measure` wants."""
        ...

    def with_camera(self, camera: PinholeCamera) -> Sensor:
        """The same sensor with other intrinsics."""
        ...

    def measure(self, view: View, rng: np.random.Generator) -> Float[ndarray, "h w"]:
        """Depth image [m], 0 = no reading, shape (camera.height, camera.width).

        Args:
            view: Rays of `rays(camera, supersampling)`.
            rng: Draws the noise of this frame.
        """
        ...


def rays(camera: PinholeCamera, supersampling: int) -> PinholeCamera:
    """The camera with k rays a pixel along each axis; `rays(camera, k).scaled(k)` is `camera`."""
    k = supersampling
    return PinholeCamera(
        k * camera.width,
        k * camera.height,
        k * camera.fx,
        k * camera.fy,
        k * camera.cx,
        k * camera.cy,
    )

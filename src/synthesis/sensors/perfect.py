# SPDX-License-Identifier: Apache-2.0
"""A sensor that makes no errors."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from synthesis.render.view import View
from synthesis.sensors.kinect_v2 import CAMERA
from synthesis.sensors.noise import check_rays


@dataclass(frozen=True)
class Perfect:
    """The true depth at the pixels' centres."""

    camera: PinholeCamera = CAMERA
    """Camera of the images it delivers."""
    supersampling: int = 1
    """Rays a pixel along each axis."""

    def with_camera(self, camera: PinholeCamera) -> Perfect:
        """The same sensor with other intrinsics."""
        return replace(self, camera=camera)

    def measure(self, view: View, rng: np.random.Generator) -> Float[ndarray, "h w"]:
        """Depth image [m], 0 = nothing there, shape (camera.height, camera.width).

        Args:
            view: Rays of `rays(camera, supersampling)`.
            rng: Not used.

        Raises:
            SceneError: if the view has other rays.
        """
        check_rays(view, self.camera, self.supersampling)
        return view.depth_m[:: self.supersampling, :: self.supersampling]

# SPDX-License-Identifier: Apache-2.0
"""How large a real scene must be made so that the person stands in it, not behind it.

A scene scaled about the camera looks the same in colour, fills the same part of the image, and all
of it moves away in proportion; a person fits among its furniture instead of behind it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from kintrack.raster import rasterise
from synthesis.mesh import Mesh
from synthesis.occlusion.silhouette import Silhouette, hidden_share

SCALES = (1.0, 4.0)
"""Least and greatest scale."""
RATIO = 1.05
"""From one scale that is tried to the next."""


def scale_behind(
    scene_camera: Mesh, camera: PinholeCamera, persons: Sequence[Silhouette], share: float
) -> float:
    """The least scale, about the camera, at which a scene hides no more of a person than wanted.

    Args:
        scene_camera: The scene, camera frame.
        camera: Camera of the silhouettes.
        persons: The person in some frames.
        share: Largest hidden share, mean over frames.

    Returns:
        The scale, 1 for the scene as it is.

    Raises:
        SceneError: if it hides more at any scale, or nobody is in the image.
    """
    if not persons:
        raise SceneError("no person in any frame; somebody must be in the image")
    depth: Float[ndarray, "h w"] = rasterise(scene_camera.vertices, scene_camera.faces, camera)[0]
    depth = np.where(np.isfinite(depth), depth, 0.0)
    scale = SCALES[0]
    while np.mean([hidden_share(person, scale * depth) for person in persons]) > share:
        scale *= RATIO
        if scale > SCALES[1]:
            raise SceneError(
                f"the scene hides more than {share} of the person even {SCALES[1]} times as large"
            )
    return scale

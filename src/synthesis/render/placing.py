# SPDX-License-Identifier: Apache-2.0
"""Poses of cameras in a world with z up."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA


def level_camera(distance_m: float, height_m: float) -> Float[ndarray, "4 4"]:
    """T_world_camera of a level camera on the x axis that looks back at the origin.

    Args:
        distance_m: From the origin, along x [m].
        height_m: Above the floor z = 0 [m].
    """
    T_world_placed = np.diag([-1.0, -1.0, 1.0, 1.0])
    T_world_placed[:3, 3] = [distance_m, 0.0, height_m]
    return T_world_placed @ T_LEVEL_WORLD_CAMERA


def looking_at(
    position: Float[ndarray, " 3"], target: Float[ndarray, " 3"]
) -> Float[ndarray, "4 4"]:
    """T_world_camera of a camera that has a point in its middle and no roll.

    Straight up or down, where no roll has no meaning, the right of the image is -y.

    Args:
        position: Where the camera is, world frame [m].
        target: What it looks at, world frame [m].

    Raises:
        SceneError: if it would look at itself, or a coordinate is not finite.
    """
    position, target = np.asarray(position, dtype=float), np.asarray(target, dtype=float)
    forward = target - position
    distance = np.linalg.norm(forward)
    if not (np.isfinite(distance) and distance > 1e-9):
        raise SceneError(
            f"a camera at {position.tolist()} cannot look at {target.tolist()}; "
            f"two different places are needed"
        )
    forward = forward / distance
    right = np.array([forward[1], -forward[0], 0.0])
    level = np.linalg.norm(right)
    right = right / level if level > 1e-9 else np.array([0.0, -1.0, 0.0])
    T_world_camera = np.eye(4)
    T_world_camera[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    T_world_camera[:3, 3] = position
    return T_world_camera

# SPDX-License-Identifier: Apache-2.0
"""Where a camera stands to film a person, and how it drifts."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import gaussian_filter1d

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from synthesis.render.placing import looking_at

DISTANCE_M = (1.6, 3.6)
"""Nearest and farthest place of a camera, from the middle of the motion [m]."""
HEIGHT_M = (0.6, 1.9)
"""Lowest and highest camera [m]."""
ASIDE_RAD = np.radians(50.0)
"""How far aside a camera may stand that somebody faces [rad]."""
CLEAR_M = 0.7
"""Least distance of the camera from any joint [m]."""
INSIDE, INSIDE_TRUNCATED = 0.97, (0.4, 0.9)
"""Share of joints inside the image: least for a whole person, range for a truncated one."""
DRIFT_M, DRIFT_RAD, DRIFT_S = 0.10, 0.03, 0.6
"""Standard deviation of the camera's drift [m], [rad] and the time it takes [s]."""
ATTEMPTS = 200


def film_from(
    joints_world: Float[ndarray, "n j 3"],
    camera: PinholeCamera,
    rng: np.random.Generator,
    *,
    facing_rad: float | None = None,
    moving: bool = False,
    truncated: bool = False,
    rate_hz: float = 30.0,
) -> Float[ndarray, "n 4 4"]:
    """Draw a camera that has the person in view.

    Args:
        joints_world: Joint centres through the motion [m], shape (N, J, 3).
        camera: The camera.
        rng: Draws place, direction and drift.
        facing_rad: Where the camera stands, about z, but for `ASIDE_RAD`; anywhere if None.
        moving: Whether it drifts.
        truncated: Whether a part of the person shall be outside.
        rate_hz: Frames per second.

    Returns:
        T_world_camera of every frame.

    Raises:
        SceneError: if the motion fits into no image.
    """
    middle = 0.5 * (joints_world.min(axis=(0, 1)) + joints_world.max(axis=(0, 1)))
    low, high = INSIDE_TRUNCATED if truncated else (INSIDE, 1.0)
    for n in range(ATTEMPTS):
        if facing_rad is None:
            azimuth = rng.uniform(-np.pi, np.pi)
        else:
            azimuth = facing_rad + rng.uniform(-ASIDE_RAD, ASIDE_RAD)
        spread = DISTANCE_M[1] - DISTANCE_M[0]
        distance = DISTANCE_M[0] + spread * rng.random() + 0.02 * n * (not truncated)
        place = middle + distance * np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        place[2] = rng.uniform(*HEIGHT_M)
        aim = middle + rng.normal(0.0, 0.25 if truncated else 0.08, 3)
        if np.linalg.norm(joints_world - place, axis=-1).min() < CLEAR_M:
            continue
        Ts = np.tile(looking_at(place, aim), (len(joints_world), 1, 1))
        if moving:
            Ts = _drifting(Ts, rng, rate_hz)
        if low <= _inside(joints_world, camera, Ts) <= high:
            return Ts
    raise SceneError(f"no camera found in {ATTEMPTS} draws that has this motion in view")


def _drifting(Ts, rng: np.random.Generator, rate_hz: float) -> ndarray:
    """Poses that wander smoothly about the given ones."""
    import pinocchio as pin

    sigma = DRIFT_S * rate_hz
    noise = gaussian_filter1d(rng.normal(size=(len(Ts) + int(6 * sigma), 6)), sigma, axis=0)
    noise = noise[int(3 * sigma) :][: len(Ts)] * np.sqrt(2.0 * np.sqrt(np.pi) * sigma)
    noise = (noise - noise[0]) * np.repeat([DRIFT_M, DRIFT_RAD], 3)
    return np.stack([T @ pin.exp6(step).homogeneous for T, step in zip(Ts, noise, strict=True)])


def _inside(joints_world, camera: PinholeCamera, Ts) -> float:
    """Share of joints in front of the camera and inside the image."""
    inside = 0
    for joints, T in zip(joints_world, Ts, strict=True):
        points = transform_points(invert_rigid(T), joints)
        ahead = points[points[:, 2] > 0.2]
        u, v = camera.project(ahead).T
        inside += np.sum((u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height))
    return float(inside) / joints_world[..., 0].size

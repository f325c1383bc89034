# SPDX-License-Identifier: Apache-2.0
"""Pinhole camera, rigid transforms and robust weights.

Conventions of the whole project (`docs/conventions.md`):

* SI units: metres, radians, seconds. Readers convert at the border.
* Camera frame: x right, y down, z forward (OpenCV, REP-103 optical). World: z up.
  Body root: x forward, y left, z up, origin between the hips.
* `T_world_camera` maps camera coordinates to world: `p_world = T_world_camera @ p_camera`.
* Quaternions x y z w, twists linear then angular (Pinocchio). Left and right are the person's.
* Labels: 0 background, 1 head, 2 torso, 3 right_arm, 4 left_arm, 5 right_leg, 6 left_leg.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numba import njit
from numpy import ndarray

from kintrack.errors import ConfigError

LABELS = ("background", "head", "torso", "right_arm", "left_arm", "right_leg", "left_leg")

T_LEVEL_WORLD_CAMERA = np.array(
    [[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""World of a level camera that nobody has placed: its own centre, x along the view, z up."""
UP_WORLD = np.array([0.0, 0.0, 1.0])
"""Up in the world frame."""


@dataclass(frozen=True)
class PinholeCamera:
    """An undistorted pinhole camera; pixel centres lie at integer coordinates."""

    width: int
    """Image width [px]."""
    height: int
    """Image height [px]."""
    fx: float
    """Focal length along u [px]."""
    fy: float
    """Focal length along v [px]."""
    cx: float
    """Principal point u [px]."""
    cy: float
    """Principal point v [px]."""

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value <= 0:
                raise ConfigError(f"camera {name} = {value!r}: a positive whole number is needed")
        for name in ("fx", "fy"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"camera {name} = {value!r}: a focal length above 0 px is needed")
        for name in ("cx", "cy"):
            if not math.isfinite(getattr(self, name)):
                raise ConfigError(f"camera {name} = {getattr(self, name)!r}: must be finite")

    def project(self, points_camera: Float[ndarray, "*n 3"]) -> Float[ndarray, "*n 2"]:
        """Pixel coordinates of points: u = fx x/z + cx, v = fy y/z + cy.

        Args:
            points_camera: Points with z > 0 [m], shape (..., 3).

        Returns:
            Pixels (u, v) [px], shape (..., 2).
        """
        x, y, z = np.moveaxis(np.asarray(points_camera, dtype=float), -1, 0)
        return np.stack([self.fx * x / z + self.cx, self.fy * y / z + self.cy], axis=-1)

    def back_project(self, depth_m: Float[ndarray, "h w"]) -> Float[ndarray, "h w 3"]:
        """Points seen by each pixel; zero where the depth is not above zero or not finite.

        Args:
            depth_m: Depth along z [m], shape (height, width).

        Returns:
            Points in the camera frame [m], shape (height, width, 3).
        """
        return _back_project(depth_m, self.fx, self.fy, self.cx, self.cy)

    def scaled(self, factor: int) -> PinholeCamera:
        """The camera whose pixel (i, j) is this one's pixel (i * factor, j * factor)."""
        return PinholeCamera(
            width=(self.width - 1) // factor + 1,
            height=(self.height - 1) // factor + 1,
            fx=self.fx / factor,
            fy=self.fy / factor,
            cx=self.cx / factor,
            cy=self.cy / factor,
        )


@njit(cache=True, nogil=True)
def _back_project(depth, fx, fy, cx, cy):
    h, w = depth.shape
    out = np.zeros((h, w, 3))
    for v in range(h):
        for u in range(w):
            z = np.float64(depth[v, u])
            if z > 0.0 and z < np.inf:
                out[v, u, 0] = (u - cx) / fx * z
                out[v, u, 1] = (v - cy) / fy * z
                out[v, u, 2] = z
    return out


def camera_pose(pitch_deg: float) -> Float[ndarray, "4 4"]:
    """T_world_camera of a camera at the world's origin that looks down by an angle.

    Args:
        pitch_deg: Angle below the horizon [deg], -90 to 90.

    Returns:
        T_world_camera, shape (4, 4).

    Raises:
        ConfigError: if the angle is out of range.
    """
    if not -90.0 <= pitch_deg <= 90.0:
        raise ConfigError(f"camera pitch = {pitch_deg!r} deg: -90 to 90 are allowed")
    c, s = math.cos(math.radians(pitch_deg)), math.sin(math.radians(pitch_deg))
    tilt = np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])
    return tilt @ T_LEVEL_WORLD_CAMERA


def invert_rigid(T_a_b: Float[ndarray, "*n 4 4"]) -> Float[ndarray, "*n 4 4"]:
    """Inverse of rigid transforms: T_b_a from T_a_b, shape (..., 4, 4)."""
    T_b_a = np.zeros_like(T_a_b)
    R_b_a = np.swapaxes(T_a_b[..., :3, :3], -1, -2)
    T_b_a[..., :3, :3] = R_b_a
    T_b_a[..., :3, 3] = -np.einsum("...ij,...j->...i", R_b_a, T_a_b[..., :3, 3])
    T_b_a[..., 3, 3] = 1.0
    return T_b_a


def transform_points(
    T_a_b: Float[ndarray, "4 4"], points_b: Float[ndarray, "*n 3"]
) -> Float[ndarray, "*n 3"]:
    """Points of frame b expressed in frame a, shape (..., 3)."""
    return points_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]


def tukey_weights(r: Float[ndarray, " n"], scale: float) -> Float[ndarray, " n"]:
    """Tukey's biweight: (1 - (r / 4.685 s)^2)^2 inside, 0 outside (Holland & Welsch 1977).

    Args:
        r: Residuals, shape (N,), unit of `scale`.
        scale: Robust standard deviation of the inliers, same unit as `r`.

    Returns:
        Weights in [0, 1], shape (N,).
    """
    x = np.clip(np.abs(r) / (4.685 * scale), 0.0, 1.0)
    return (1.0 - x * x) ** 2


def huber_weights(r: Float[ndarray, " n"], scale: float) -> Float[ndarray, " n"]:
    """Huber's weights: 1 up to 1.345 s, then 1.345 s / |r| (Huber 1964), shape (N,)."""
    k = 1.345 * scale
    return k / np.maximum(np.abs(r), k)


def robust_scale(r: Float[ndarray, " n"]) -> float:
    """Standard deviation from the median absolute residual, 1.4826 median |r| (Hampel 1974)."""
    return float(1.4826 * np.median(np.abs(r)))

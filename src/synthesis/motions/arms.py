# SPDX-License-Identifier: Apache-2.0
"""Shoulder and elbow angles from where the upper arm and the forearm point."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.modelling.skeleton import SCAPULAR_PLANE_DEG

Direction = tuple[float, float, float]
"""Forward, outward (to the arm's own side), up; any length."""


def arm(
    upper: Direction, forearm: Direction, clavicle_deg: float = 0.0, pronation_deg: float = 0.0
) -> dict[str, float]:
    """Hinge angles of an arm, relative to the chest.

    Upper arm: u = Rx(c) Rz(-s) Rx(e) Ry(-p) (0, 0, -1) for clavicle c, scapular plane s,
    elevation e and plane p. The forearm then gives shoulder rotation and elbow flexion.

    Args:
        upper: Where the upper arm points.
        forearm: Where the forearm points.
        clavicle_deg: Elevation of the clavicle [deg].
        pronation_deg: Twist of the forearm [deg].

    Returns:
        Angle by hinge name without side [deg].
    """
    u, f = (np.array(d) / np.linalg.norm(d) for d in (upper, forearm))
    s, c = np.radians(SCAPULAR_PLANE_DEG), np.radians(clavicle_deg)
    x, y, z = (_rotation(0, c) @ _rotation(2, -s)).T @ u
    p, e = np.arcsin(np.clip(x, -1.0, 1.0)), np.arctan2(y, -z)
    R_upper = _rotation(0, c) @ _rotation(2, -s) @ _rotation(0, e) @ _rotation(1, -p)
    gx, gy, gz = (R_upper @ _rotation(2, s)).T @ f
    flexion = np.arctan2(np.hypot(gx, gy), -gz)
    return {
        "clavicle_elevation": clavicle_deg,
        "shoulder_elevation": float(np.degrees(e)),
        "shoulder_plane": float(np.degrees(p)),
        "shoulder_rotation": float(np.degrees(np.arctan2(-gy, gx))),
        "elbow_flexion": float(np.degrees(flexion)),
        "forearm_pronation": pronation_deg,
    }


def _rotation(axis: int, angle_rad: float) -> Float[ndarray, "3 3"]:
    """Rotation about a principal axis, shape (3, 3)."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = np.cos(angle_rad)
    R[j, i] = np.sin(angle_rad)
    R[i, j] = -R[j, i]
    return R

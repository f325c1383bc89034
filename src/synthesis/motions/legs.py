# SPDX-License-Identifier: Apache-2.0
"""Feet that stay where they are put: foot poses from footholds, and the legs that reach them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import Body
from synthesis.people.person import SIDES, Person

LEG_HINGES = (
    "hip_flexion",
    "hip_abduction",
    "hip_rotation",
    "knee_flexion",
    "ankle_dorsiflexion",
    "ankle_inversion",
)
ITERATIONS = 30
DAMPING = 1e-5
"""Added to the diagonal of J^T J [m^2 or rad^2 per rad^2]."""
CONVERGED = 1e-6
"""Largest remaining error that ends the iteration [m or rad]."""


def yaw_matrix(yaw_rad: float) -> Float[ndarray, "3 3"]:
    """Rotation about z, shape (3, 3)."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def foot_pose(
    person: Person,
    side: str,
    foothold: Float[ndarray, " 3"],
    pitch_rad: float,
    lift_m: float,
) -> pin.SE3:
    """Pose of a foot that rolls over its toe or its heel without sliding.

    The foot's lowest point is `lift_m` above the floor z = 0. The toe (pitch above zero, heel up)
    or the heel (below zero) keeps the horizontal place it has when the foot is flat.

    Args:
        person: Whose foot.
        side: `l` or `r`.
        foothold: x, y [m] of the flat foot's frame and its yaw [rad], shape (3,).
        pitch_rad: Heel-up angle [rad].
        lift_m: Height of the lowest point [m].

    Returns:
        T_world_foot.
    """
    c, s = np.cos(pitch_rad), np.sin(pitch_rad)
    R_yaw = yaw_matrix(foothold[2])
    R = R_yaw @ np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    pivot = person.toe[side] if pitch_rad > 0 else person.heel[side]
    p = np.array([*foothold[:2], 0.0]) + R_yaw @ pivot - R @ pivot
    p[2] = lift_m - (person.foot_points[side] @ R[2]).min()
    return pin.SE3(R, p)


def solve_legs(
    body: Body, q: Float[ndarray, " nq"], targets: dict[str, pin.SE3]
) -> Float[ndarray, " nq"]:
    """Bend the legs so that the feet reach their targets; the rest of q is kept.

    Six hinges a leg for six coordinates of a foot: damped Gauss-Newton on log(T_foot^-1 T_target),
    kept within the limits.

    Args:
        body: The body.
        q: Configuration to start from, shape (nq,).
        targets: T_world_foot by side.

    Returns:
        Configuration, shape (nq,).
    """
    model, data, q = body.model, body.model.createData(), np.array(q)
    for side in SIDES:
        frame = model.getFrameId(f"{side}_foot")
        dofs = np.array([body.dof(f"{side}_{hinge}") for hinge in LEG_HINGES])
        for _ in range(ITERATIONS):
            pin.computeJointJacobians(model, data, q)
            pin.updateFramePlacement(model, data, frame)
            J = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL)[:, dofs]
            error = pin.log6(data.oMf[frame].actInv(targets[side])).vector
            if np.abs(error).max() < CONVERGED:
                break
            step = np.linalg.solve(J.T @ J + DAMPING * np.eye(6), J.T @ error)
            angles = q[dofs + 1] + np.clip(step, -0.3, 0.3)
            q[dofs + 1] = np.clip(angles, body.lower[dofs], body.upper[dofs])
    return q

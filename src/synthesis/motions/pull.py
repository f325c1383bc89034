# SPDX-License-Identifier: Apache-2.0
"""The residual of retargeting: where bones and link axes point, where joints are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy import ndarray

from kintrack.body import BodyState, joint_jacobians
from kintrack.residuals.linearization import Linearization, Residual


@dataclass(frozen=True)
class Pull(Residual):
    """Directions of bones and link axes and places of joints; 0.5 sum_i (r_i / sigma_i)^2.

    r = (x_child - x_parent) / length - direction for bones, R_link e_axis - direction for axes,
    x - place for joints.
    """

    bones: tuple[ndarray, ndarray, ndarray, ndarray]
    """Rows of parents and children in `JOINT_NAMES`, directions (B, 3), sigma (B,) [rad]."""
    axes: tuple[ndarray, ndarray, ndarray, ndarray]
    """Rows of the links, their axes (A,), directions (A, 3), sigma (A,) [rad]."""
    joints: tuple[ndarray, ndarray, ndarray]
    """Rows in `JOINT_NAMES`, places (P, 3), sigma (P,) [m]."""

    def _residual(self, state: BodyState) -> tuple[ndarray, ndarray, ndarray]:
        """Residuals (B + A + P, 3), bone lengths (B, 1), world axes (A, 3)."""
        x = state.joint_positions_world
        parents, children, directions, _ = self.bones
        span = x[children] - x[parents]
        lengths = np.linalg.norm(span, axis=1, keepdims=True)
        links, which, wanted, _ = self.axes
        axes = state.Ts_world_link[links, :3, which]
        rows, places, _ = self.joints
        r = np.concatenate([span / lengths - directions, axes - wanted, x[rows] - places])
        return r, lengths, axes

    def _weights(self) -> ndarray:
        """1 / sigma^2 of every row."""
        sigma = np.concatenate([self.bones[3], self.axes[3], self.joints[2]])
        return np.repeat(sigma**-2.0, 3)

    def linearize(self, state: BodyState) -> Linearization:
        """Residuals, Jacobian and weights."""
        r, lengths, axes = self._residual(state)
        J = joint_jacobians(state)
        parents, children, _, _ = self.bones
        turning = np.where(state.body.support[self.axes[0]][:, None, :], state.J_world[3:], 0.0)
        J_axes = np.cross(turning, axes[:, :, None], axis=1)  # omega x a
        J_bones = (J[children] - J[parents]) / lengths[:, :, None]
        stacked = np.concatenate([J_bones, J_axes, J[self.joints[0]]])
        return Linearization(r.ravel(), stacked.reshape(-1, state.body.nv), self._weights())

    def cost(self, state: BodyState) -> float:
        """0.5 sum_i w_i r_i^2."""
        r = self._residual(state)[0].ravel()
        return 0.5 * float(r @ (self._weights() * r))

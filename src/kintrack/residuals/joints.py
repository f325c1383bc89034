# SPDX-License-Identifier: Apache-2.0
"""Joint centres pulled to places that are known roughly.

r_j = x_j(q) - t_j,  dr_j/dv = J_j
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.body import BodyState, joint_jacobians
from kintrack.residuals.linearization import Linearization, Residual


@dataclass(frozen=True)
class JointResidual(Residual):
    """0.5 sum_j |x_j - t_j|^2 / sigma^2."""

    joint: Int[ndarray, " n"]
    """Rows of `JOINT_NAMES`."""
    places_world: Float[ndarray, "n 3"]
    """Where they should be [m]."""
    sigma_m: float
    """Standard deviation of the places along each axis [m]."""

    def _residual(self, state: BodyState) -> Float[ndarray, "n 3"]:
        return state.joint_positions_world[self.joint] - self.places_world

    def linearize(self, state: BodyState) -> Linearization:
        """Rows x_j - t_j, axis by axis."""
        r = self._residual(state).ravel()
        J = joint_jacobians(state)[self.joint].reshape(len(r), -1)
        return Linearization(r, J, np.full(len(r), self.sigma_m**-2.0))

    def cost(self, state: BodyState) -> float:
        """Half the weighted sum of squared distances."""
        return 0.5 * float(np.sum(self._residual(state) ** 2)) / self.sigma_m**2

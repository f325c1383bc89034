# SPDX-License-Identifier: Apache-2.0
"""Rough places of the parts pull at joints that are far from them [Wan19, 6].

With d_j = x_j(q) - t_j and a distance rho that costs nothing, since a target is that rough,

    r_j = d_j max(0, 1 - rho / |d_j|),   dr_j/dv = ((1 - rho / |d|) I + rho d d^T / |d|^3) J_j

outside rho and 0 inside. With rho = 0 it is the paper's sum_j |t_j - x_j|^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.body import BodyState, joint_jacobians
from kintrack.residuals.joints import JointResidual
from kintrack.residuals.linearization import Linearization, Residual


@dataclass(frozen=True)
class TargetResidual(Residual):
    """0.5 sum_j max(0, |x_j - t_j| - free)^2 / sigma^2."""

    joint: Int[ndarray, " n"]
    """Rows of `JOINT_NAMES`."""
    places_world: Float[ndarray, "n 3"]
    """Targets [m]."""
    sigma_m: float
    """Standard deviation beyond the free distance; large for a low weight [m]."""
    free_m: float = 0.0
    """Distance that costs nothing, rho [m]."""

    def _offsets(self, state: BodyState) -> tuple[Float[ndarray, "n 3"], Float[ndarray, " n"]]:
        """d_j and rho / |d_j|, at most 1."""
        d = state.joint_positions_world[self.joint] - self.places_world
        length = np.linalg.norm(d, axis=1)
        return d, self.free_m / np.maximum(length, max(self.free_m, 1e-12))

    def linearize(self, state: BodyState) -> Linearization:
        """Rows of the module's equation, axis by axis."""
        d, share = self._offsets(state)
        r = d * (1.0 - share)[:, None]
        square = np.maximum(np.sum(d * d, axis=1), 1e-12)
        along = d[:, :, None] * d[:, None, :] / square[:, None, None]
        turn = (1.0 - share)[:, None, None] * np.eye(3) + share[:, None, None] * along
        turn[share >= 1.0] = 0.0
        J = turn @ joint_jacobians(state)[self.joint]
        weights = np.full(r.size, self.sigma_m**-2.0)
        return Linearization(r.ravel(), J.reshape(r.size, J.shape[-1]), weights)

    def frozen(self, state: BodyState) -> JointResidual:
        """The same pull as plain squares: towards the near end of the free distance.

        Joints within it are left out. Value and gradient at the state are those of this term.
        """
        d, share = self._offsets(state)
        far = share < 1.0
        places = self.places_world + d * share[:, None]
        return JointResidual(self.joint[far], places[far], self.sigma_m)

    def cost(self, state: BodyState) -> float:
        """Half the weighted sum of squared distances beyond the free one."""
        d, share = self._offsets(state)
        return 0.5 * float(np.sum((d * (1.0 - share)[:, None]) ** 2)) / self.sigma_m**2

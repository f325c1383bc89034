# SPDX-License-Identifier: Apache-2.0
"""Quadratic pulls on the configuration: towards the resting pose, towards the prediction.

r = difference(q0, q) in the tangent space, weighted by an information matrix W = L L^T: the rows
are L^T r. For hinges dr/dv = 1; the root's rotation uses the tangent at q, exact to first order
near the target.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import BodyState
from kintrack.residuals.linearization import Linearization, Residual


@dataclass(frozen=True)
class TangentPrior(Residual):
    """0.5 |L^T difference(q0, q)|^2; used for the pose prior and for the motion model."""

    q0: Float[ndarray, " nq"]
    """Expected configuration."""
    root: Float[ndarray, "nv n"]
    """L, a root of the information matrix [1/m or 1/rad]."""

    def _residual(self, state: BodyState) -> Float[ndarray, " n"]:
        return self.root.T @ pin.difference(state.body.model, self.q0, state.q)

    def linearize(self, state: BodyState) -> Linearization:
        """Rows L^T difference(q0, q), with the exact derivative of the difference."""
        model = state.body.model
        dq = pin.dDifference(model, self.q0, state.q, pin.ArgumentPosition.ARG1)
        r = self._residual(state)
        return Linearization(r, self.root.T @ dq, np.ones(len(r)))

    def cost(self, state: BodyState) -> float:
        """Half the squared norm of the residual."""
        r = self._residual(state)
        return 0.5 * float(r @ r)


def diagonal_prior(q0: Float[ndarray, " nq"], sigma: Float[ndarray, " nv"]) -> TangentPrior:
    """Independent standard deviations per velocity component; inf leaves one free."""
    return TangentPrior(q0, np.diag(1.0 / sigma)[:, np.isfinite(sigma)])


def gaussian_prior(q0: Float[ndarray, " nq"], covariance: Float[ndarray, "nv nv"]) -> TangentPrior:
    """A full covariance in the tangent space at q0."""
    return TangentPrior(q0, np.linalg.cholesky(np.linalg.inv(covariance)))

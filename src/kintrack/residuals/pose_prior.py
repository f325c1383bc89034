# SPDX-License-Identifier: Apache-2.0
"""Which postures legs take: a mixture of Gaussians over their hinge angles.

p(theta) = sum_k w_k N(theta; mu_k, s^2 S_k + f^2 I). Whoever sits bends hips and knees, both legs
alike. As in Olson & Agarwal 2013 ("max-mixtures") the component that is likeliest where the body is
expected stands for the sum, so that the term is quadratic. The mixture is learnt from motions that
may be trained on (`synthesis.motions.habits`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray
from scipy.linalg import solve_triangular

from kintrack.body import Body
from kintrack.errors import ModelError
from kintrack.human import leg_hinges
from kintrack.objective_config import PriorConfig
from kintrack.residuals.prior import TangentPrior
from kintrack.rig import model_folder, read_arrays

PRIOR_FILE = "pose_prior.npz"
"""In the model's folder."""


@dataclass(frozen=True)
class LegPrior:
    """A mixture of K Gaussians over the N hinges of both legs, in the tangent space's order."""

    hinges: Int[ndarray, " n"]
    """The legs' components of the tangent space."""
    weights: Float[ndarray, " k"]
    """w_k; they sum to 1."""
    means_rad: Float[ndarray, "k n"]
    """mu_k."""
    covariances_rad2: Float[ndarray, "k n n"]
    """s^2 S_k + f^2 I."""

    def near(
        self,
        q: Float[ndarray, " nq"],
        doubt: Float[ndarray, " nv"] | None = None,
        hidden: Bool[ndarray, " nv"] | None = None,
    ) -> TangentPrior:
        """The likeliest component at a configuration, as a term.

        Where a leg is hidden, what is seen of both chooses: how a hidden leg was taken to be is no
        evidence of how it is.

        Args:
            q: Where the body is expected.
            doubt: Factor on the deviation of every velocity component; 1 if None.
            hidden: Velocity components that are hidden; none if None.

        Returns:
            The term; all but the legs is free.
        """
        places = self.hinges + 1
        seen = np.ones(len(places), dtype=bool) if hidden is None else ~hidden[self.hinges]
        if not seen.any():
            seen[:] = True
        whitening = self._whitening
        if not seen.all():
            whitening = _whitening_of(self.covariances_rad2[:, seen][:, :, seen])
        off = (q[places] - self.means_rad)[:, seen, None]  # (K, N, 1)
        # the root's inverse G of a covariance: log p = log w + log |G| - |G (q - mu)|^2 / 2
        whitened = (whitening @ off)[..., 0]
        likely = np.log(self.weights) - 0.5 * (whitened**2).sum(axis=1)
        likely += np.log(np.diagonal(whitening, axis1=1, axis2=2)).sum(axis=1)
        best = int(likely.argmax())
        q0 = q.copy()
        q0[places] = self.means_rad[best]
        # L of the information W = L L^T is G^T
        L = np.zeros((len(q) - 1, len(places)))
        L[self.hinges] = self._whitening[best].T
        return TangentPrior(q0, L if doubt is None else L / doubt[:, None])

    @cached_property
    def _whitening(self) -> Float[ndarray, "k n n"]:
        """Inverses of the covariances' lower Cholesky factors."""
        return _whitening_of(self.covariances_rad2)


def _whitening_of(covariances: Float[ndarray, "k n n"]) -> Float[ndarray, "k n n"]:
    factors = np.linalg.cholesky(covariances)
    eye = np.eye(factors.shape[1])
    return np.stack([solve_triangular(factor, eye, lower=True) for factor in factors])


def load_leg_prior(body: Body, config: PriorConfig, folder: Path | None = None) -> LegPrior:
    """Read the mixture that ships.

    Args:
        body: Whose hinges are named.
        config: Spread s and floor f.
        folder: Model folder; the one that ships if None.

    Returns:
        The prior.

    Raises:
        ModelError: if the file is missing or broken, or is of other hinges than the body's legs.
    """
    path = (model_folder() if folder is None else folder) / PRIOR_FILE
    arrays = read_arrays(path, "hinge_names", "weights", "means_rad", "covariances_rad2")
    names = tuple(str(name) for name in arrays["hinge_names"])
    hinges = np.flatnonzero(leg_hinges(body))
    known = tuple(np.array(hinge_names(body))[hinges - 6])
    if names != known:
        raise ModelError(f"{path}: is of the hinges {', '.join(names)}; the body's legs have "
                         f"{', '.join(known)}")  # fmt: skip
    learnt = arrays["covariances_rad2"].astype(float)
    wide = config.spread**2 * learnt + config.floor_rad**2 * np.eye(len(names))
    return LegPrior(
        hinges, arrays["weights"].astype(float), arrays["means_rad"].astype(float), wide
    )


def hinge_names(body: Body) -> tuple[str, ...]:
    """Hinges in the order of the tangent space, after the root's six components."""
    return tuple(list(body.model.names)[2:])

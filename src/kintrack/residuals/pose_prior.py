# SPDX-License-Identifier: Apache-2.0
"""Which postures legs take: a mixture of Gaussians over the pelvis' stance and their hinge angles.

p(c, theta) = sum_k w_k N((c, theta); mu_k, S_k + F), F the variance with which c and theta are
known while tracking. Whoever sits bends hips and knees, both legs alike, over a pelvis that is low.
The stance c, how the pelvis is tilted and how high it is above the floor, is known when legs are
hidden: given c and the hinges that are seen the components' shares change, and each is regressed on
c (Bishop 2006, "Pattern Recognition and Machine Learning", 2.3.1). The Gaussian of the sum's mean
and covariance stands for it, so that the term is quadratic. It is learnt from motions that may be
trained on (`synthesis.motions.habits`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray
from scipy.spatial.transform import Rotation

from kintrack.body import Body
from kintrack.errors import ModelError
from kintrack.human import leg_hinges
from kintrack.objective_config import PriorConfig
from kintrack.residuals.prior import TangentPrior
from kintrack.rig import model_folder, read_arrays

PRIOR_FILE = "pose_prior.npz"
"""In the model's folder."""
STANCE = ("tilt_forward", "tilt_left", "height")
"""Up along the pelvis' forward and left axes; height above the floor [thirds of a leg's length],
a unit in which it varies as much as angles do."""
HEIGHTS_PER_LEG = 3.0
STANCE_SIGMA = (0.1, 0.1, 0.15)
"""Standard deviation of a stance while tracking [as `STANCE`]."""
TELLING = ("hip_flexion", "hip_abduction", "knee_flexion")
"""Hinges of a seen leg that tell its posture; how it is twisted, and its ankle, are hardly seen."""


@dataclass(frozen=True)
class LegPrior:
    """A mixture of K Gaussians over the stance and the N hinges of both legs."""

    hinges: Int[ndarray, " n"]
    """The legs' components of the tangent space."""
    telling: Bool[ndarray, " n"]
    """Which of them are `TELLING`."""
    weights: Float[ndarray, " k"]
    """w_k; they sum to 1."""
    means: Float[ndarray, "k 3+n"]
    """mu_k: stance, then hinges in the tangent space's order [rad]."""
    covariances: Float[ndarray, "k 3+n 3+n"]
    """S_k + F."""

    def near(
        self,
        q: Float[ndarray, " nq"],
        doubt: Float[ndarray, " nv"] | None = None,
        hidden: Bool[ndarray, " nv"] | None = None,
        stance: Float[ndarray, " 3"] | None = None,
    ) -> TangentPrior:
        """The mixture at a configuration, as a term.

        How a leg that is not seen was taken to be is no evidence of how it is.

        Args:
            q: Where the body is expected.
            doubt: Factor on the deviation of every velocity component; 1 if None.
            hidden: Velocity components that are not seen; none if None.
            stance: The pelvis' stance; NaN where unknown, all of it if None.

        Returns:
            The term; all but the legs is free.
        """
        places, n = self.hinges + 1, len(STANCE)
        stance = np.full(n, np.nan) if stance is None else stance
        seen = self.telling if hidden is None else self.telling & ~hidden[self.hinges]
        known = np.concatenate([np.isfinite(stance), seen])
        shares = self._shares(np.concatenate([stance, q[places]]), known)
        means, covariances = self._regressed(stance)
        mean = shares @ means
        off = means - mean
        covariance = np.einsum("k,kij->ij", shares, covariances + off[:, :, None] * off[:, None])
        q0 = q.copy()
        q0[places] = mean
        L = np.zeros((len(q) - 1, len(places)))
        L[self.hinges] = np.linalg.cholesky(np.linalg.inv(covariance))
        return TangentPrior(q0, L if doubt is None else L / doubt[:, None])

    def _shares(
        self, values: Float[ndarray, " 3+n"], known: Bool[ndarray, " 3+n"]
    ) -> Float[ndarray, " k"]:
        """Probability of each component given what is known."""
        covariances = self.covariances[:, known][:, :, known]
        off = values[known] - self.means[:, known]
        distance = (off[:, None] @ np.linalg.solve(covariances, off[..., None])).ravel()
        likely = np.log(self.weights) - 0.5 * (distance + np.linalg.slogdet(covariances)[1])
        shares = np.exp(likely - likely.max())
        return shares / shares.sum()

    def _regressed(
        self, stance: Float[ndarray, " 3"]
    ) -> tuple[Float[ndarray, "k n"], Float[ndarray, "k n n"]]:
        """Means and covariances of the hinges in each component, given the stance."""
        n, known = len(STANCE), np.flatnonzero(np.isfinite(stance))
        cross = self.covariances[:, n:][:, :, known]
        own = self.covariances[:, known][:, :, known]
        gain = np.swapaxes(np.linalg.solve(own, np.swapaxes(cross, 1, 2)), 1, 2)
        off = stance[known] - self.means[:, known]
        means = self.means[:, n:] + (gain @ off[..., None])[..., 0]
        return means, self.covariances[:, n:, n:] - gain @ np.swapaxes(cross, 1, 2)


def stance_of(
    q: Float[ndarray, "*n nq"], leg_m: float, up_world: Float[ndarray, " 3"], floor_m: float
) -> Float[ndarray, "*n 3"]:
    """How the pelvis is tilted and how high it is.

    Args:
        q: Configurations.
        leg_m: Length of a leg, see `kintrack.body.leg_length`.
        up_world: Unit vector that points up.
        floor_m: Where along it the floor is [m]; NaN if unknown, and so is the height then.

    Returns:
        `STANCE`.
    """
    up = Rotation.from_quat(q[..., 3:7]).apply(up_world, inverse=True)
    height = HEIGHTS_PER_LEG * (q[..., :3] @ up_world - floor_m) / leg_m
    return np.concatenate([up[..., :2], height[..., None]], axis=-1)


def load_leg_prior(body: Body, config: PriorConfig, folder: Path | None = None) -> LegPrior:
    """Read the mixture that ships.

    Args:
        body: Whose hinges are named.
        config: Deviation of a hinge while tracking.
        folder: Model folder; the one that ships if None.

    Returns:
        The prior.

    Raises:
        ModelError: if the file is missing or broken, or is of other hinges than the body's legs.
    """
    path = (model_folder() if folder is None else folder) / PRIOR_FILE
    arrays = read_arrays(path, "names", "weights", "means", "covariances")
    names = tuple(str(name) for name in arrays["names"])
    hinges = np.flatnonzero(leg_hinges(body))
    known = (*STANCE, *np.array(hinge_names(body))[hinges - 6])
    if names != known:
        raise ModelError(f"{path}: is of {', '.join(names)}; the stance and the body's legs are "
                         f"{', '.join(known)}")  # fmt: skip
    telling = np.array([name.endswith(TELLING) for name in known[len(STANCE) :]])
    tracked = np.diag([x**2 for x in STANCE_SIGMA] + [config.floor_rad**2] * len(hinges))
    means, covariances = arrays["means"].astype(float), arrays["covariances"].astype(float)
    weights = arrays["weights"].astype(float)
    return LegPrior(hinges, telling, weights, means, covariances + tracked)


def hinge_names(body: Body) -> tuple[str, ...]:
    """Hinges in the order of the tangent space, after the root's six components."""
    return tuple(list(body.model.names)[2:])

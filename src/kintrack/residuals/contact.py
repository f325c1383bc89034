# SPDX-License-Identifier: Apache-2.0
"""Feet on the floor: below it hardly ever, whatever is seen of them, above it while they step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from kintrack.floor import Floor
from kintrack.floor_config import ContactConfig
from kintrack.residuals.surface import SurfaceResidual, plane_roots
from kintrack.skin import Skin


@dataclass(frozen=True)
class Contact:
    """The floor, and what should stand on it."""

    floor: Floor
    """The floor."""
    soles: Int[ndarray, "f s"]
    """Vertices under each of these feet."""
    stands: Bool[ndarray, " f"]
    """Whether a foot is drawn to the floor, too, not only kept from going through it."""

    def lower(self, vertices_world: Float[ndarray, "v 3"]) -> Contact:
        """The same of the lowest foot alone.

        Args:
            vertices_world: All vertices [m].
        """
        above = self.floor.above_m(vertices_world[self.soles.ravel()]).reshape(self.soles.shape)
        return Contact(self.floor, self.soles[[int(above.mean(axis=1).argmin())]], np.ones(1, bool))


def contact_residual(
    skin: Skin, contact: Contact, vertices_world: Float[ndarray, "v 3"], config: ContactConfig
) -> SurfaceResidual:
    """Pairs of soles with the floor below or above them, along its normal, Huber weights frozen.

    With height a_i of S vertices under a foot, w_i = min(1, far / |a_i|) / (S sigma^2); sigma is
    smaller below the floor than above it.

    Args:
        skin: The skin.
        contact: The floor, and soles.
        vertices_world: All vertices now [m].
        config: Deviations.

    Returns:
        The term.
    """
    above = contact.floor.above_m(vertices_world[contact.soles.ravel()])
    counts = np.repeat(contact.stands, contact.soles.shape[1]) | (above < 0)
    vertex, above = contact.soles.ravel()[counts], above[counts]
    points = vertices_world[vertex]
    normal = contact.floor.normal
    sigma = np.where(above < 0, config.below_m, config.above_m)
    robust = np.minimum(1.0, config.far_m / np.maximum(np.abs(above), 1e-9))
    return SurfaceResidual(
        skin=skin,
        vertex=vertex,
        points_world=points - above[:, None] * normal,
        roots=plane_roots(np.tile(normal, (len(vertex), 1)), 0.0),
        weights=robust / (contact.soles.shape[-1] * sigma**2),
        scale_m=config.above_m,
        inliers=len(vertex),
        rms_m=float("nan"),
    )

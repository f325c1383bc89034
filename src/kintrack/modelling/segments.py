# SPDX-License-Identifier: Apache-2.0
"""Mass, inertia and collision capsule of every segment.

Segment masses are shares of the body's mass after [dL96] P. de Leva, J. Biomechanics 29(9), 1996,
Table 4, averaged over women and men. How a segment's mass lies within it (centre and inertia)
comes from the body's own volume at even density.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.modelling.skeleton import Link, links
from kintrack.modelling.volume import inside_points

BODY_MASS_INDEX = 24.0
"""Mass over squared height of the average adult [kg/m^2] (NCD-RisC, Lancet 387, 2016: 24.2)."""

MASS_SHARES = {
    "head": (0.0668, 0.0694),
    "upper_trunk": (0.1545, 0.1596),
    "abdomen": (0.1465, 0.1633),
    "pelvis": (0.1247, 0.1117),
    "upper_arm": (0.0255, 0.0271),
    "forearm": (0.0138, 0.0162),
    "hand": (0.0056, 0.0061),
    "thigh": (0.1478, 0.1416),
    "shank": (0.0481, 0.0433),
    "foot": (0.0129, 0.0137),
}
"""[dL96] share of body mass per segment: women, men."""

GROUPS = {
    "head": ("head", "neck"),
    "upper_trunk": ("chest", "l_clavicle", "r_clavicle"),
    "l_forearm": ("l_forearm", "l_forearm_distal"),
    "r_forearm": ("r_forearm", "r_forearm_distal"),
}
"""Links that share one published segment; its mass is split between them by volume."""


@dataclass(frozen=True)
class SegmentBody:
    """Rigid-body and collision data of one link, in the link's own frame."""

    mass_kg: float
    """Mass [kg]."""
    center_m: Float[ndarray, 3]
    """Centre of mass [m]."""
    inertia_kgm2: Float[ndarray, "3 3"]
    """Inertia about the centre of mass, link axes [kg m^2]."""
    capsule: tuple[ndarray, ndarray, float]
    """Ends of the capsule's axis and its radius [m]."""


def segment_bodies(
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    weights: Float[ndarray, "v l"],
    Ts_root_link: dict[str, ndarray],
    body_kg: float | None = None,
) -> dict[str, SegmentBody]:
    """Mass properties and capsules of all links of a body in bind pose.

    Args:
        vertices: Closed skin in bind pose, root frame [m].
        faces: Its triangles.
        weights: Dense skinning weights over `links()`.
        Ts_root_link: Bind pose of every link.
        body_kg: Mass of the whole body [kg]; by `BODY_MASS_INDEX` if None.

    Returns:
        One `SegmentBody` per link name.
    """
    tree = links()
    owner = weights.argmax(axis=1)
    samples, sample_owner = _volume_samples(vertices, faces, owner)
    whole_kg = BODY_MASS_INDEX * np.ptp(vertices[:, 2]) ** 2 if body_kg is None else body_kg
    masses = _masses(tree, sample_owner, float(whole_kg))
    out = {}
    for i, link in enumerate(tree):
        T = Ts_root_link[link.name]
        inner = (samples[sample_owner == i] - T[:3, 3]) @ T[:3, :3]
        outer = (vertices[owner == i] - T[:3, 3]) @ T[:3, :3]
        center = inner.mean(axis=0)
        d = inner - center
        spread = d.T @ d / len(d) + np.eye(3) * _CELL_M**2 / 12
        inertia = masses[link.name] * (np.trace(spread) * np.eye(3) - spread)
        out[link.name] = SegmentBody(masses[link.name], center, inertia, _capsule(inner, outer))
    return out


_CELL_M = 0.01


def _volume_samples(vertices, faces, owner) -> tuple[ndarray, ndarray]:
    """Centres of 1 cm cells inside the body and the link of each cell's nearest vertex."""
    grid = inside_points(vertices, faces, _CELL_M)
    return grid, owner[cKDTree(vertices).query(grid)[1]]


def _masses(tree: tuple[Link, ...], sample_owner: ndarray, body_kg: float) -> dict[str, float]:
    volume = np.bincount(sample_owner, minlength=len(tree)).astype(float)
    names = [link.name for link in tree]
    grouped = {name: group for group, members in GROUPS.items() for name in members}
    masses = {}
    for i, name in enumerate(names):
        group = grouped.get(name, name)
        members = GROUPS.get(group, (name,))
        share = np.mean(MASS_SHARES[group.removeprefix("l_").removeprefix("r_")])
        part = volume[i] / sum(volume[names.index(m)] for m in members)
        masses[name] = float(share * part * body_kg)
    total = sum(masses.values())
    return {name: m * body_kg / total for name, m in masses.items()}


def _capsule(inner: ndarray, outer: ndarray) -> tuple[ndarray, ndarray, float]:
    """Capsule along the segment's longest direction that holds nine tenths of its skin."""
    center = inner.mean(axis=0)
    axis = np.linalg.svd(inner - center, full_matrices=False)[2][0]
    axis *= np.sign(axis[np.abs(axis).argmax()])
    along = (outer - center) @ axis
    across = np.linalg.norm(outer - center - along[:, None] * axis, axis=1)
    radius = float(np.quantile(across, 0.9))
    lo, hi = np.quantile(along, [0.02, 0.98])
    lo, hi = lo + radius, hi - radius
    if lo > hi:
        lo = hi = 0.5 * (lo + hi)
    return center + lo * axis, center + hi * axis, radius

# SPDX-License-Identifier: Apache-2.0
"""Clothes and hair as a thickness per region, so that what is worn is not taken for the body.

The surface that a camera sees lies outside the body by one thickness per region, the same on both
sides and in every pose, plus folds. Means and spreads are those of 60 dressed training people of
`synthesis.people`, measured along the normals of the bare body (`docs/shape.md`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.human import Human, load_human
from kintrack.shape import ShapeSpace, checked_shape, load_shape_space
from kintrack.skin import vertex_normals


class Region(NamedTuple):
    """One part of the body that is covered evenly."""

    name: str
    """For tables and files."""
    links: tuple[str, ...]
    """Links whose skin it is, without side."""
    mean_m: float
    """What people wear there on average [m]."""
    sigma_m: float
    """Standard deviation between people [m]."""
    fold_m: float
    """Standard deviation within one person: folds, hems, what moves [m]."""


REGIONS = (
    Region("scalp", ("head",), 0.018, 0.010, 0.006),
    Region("neck", ("neck",), 0.035, 0.026, 0.015),
    Region("chest", ("chest", "clavicle"), 0.026, 0.012, 0.014),
    Region("abdomen", ("abdomen",), 0.036, 0.017, 0.012),
    Region("pelvis", ("pelvis",), 0.036, 0.018, 0.018),
    Region("upper_arm", ("upper_arm",), 0.020, 0.012, 0.014),
    Region("forearm", ("forearm", "forearm_distal"), 0.022, 0.020, 0.008),
    Region("thigh", ("thigh",), 0.024, 0.018, 0.017),
    Region("shank", ("shank",), 0.021, 0.019, 0.011),
    Region("foot", ("foot",), 0.009, 0.005, 0.009),
)
"""Everything that is covered; face and hands are bare."""
USUAL_M: Mapping[str, float] = MappingProxyType({r.name: r.mean_m for r in REGIONS})
"""What people wear on average, per region [m]."""
FACE_M = 0.008
"""Spread of faces about the body's [m]."""
HAND_M = 0.020
"""Spread of hands about the skin's, whose fingers are straight and closed [m]."""
LOOSE = 0.5
"""Spread per thickness."""
THICKEST_M = 0.08
"""No region is thicker [m]."""


def coverage(space: ShapeSpace) -> Float[ndarray, "v r"]:
    """How much of each vertex belongs to each of `REGIONS`, 0..1; 0 throughout where bare."""
    out = np.stack([_weights(space, *region.links) for region in REGIONS], axis=1)
    out[:, 0] *= _scalp(space, out[:, 0])
    return out


def _weights(space: ShapeSpace, *stems: str) -> Float[ndarray, " v"]:
    """How much of each vertex some links move, both sides together."""
    names = [name.removeprefix("l_").removeprefix("r_") for name in space.rig.link_names]
    chosen = np.array([name in stems for name in names])
    return np.asarray((space.skin.weights * chosen[space.skin.links]).sum(axis=1))


def _scalp(space: ShapeSpace, head: Float[ndarray, " v"]) -> Float[ndarray, " v"]:
    """1 where hair grows, 0 on the face: top and back of the head, smooth in between."""
    away = space.vertices_m - space.vertices_m[head > 0.6].mean(axis=0)
    x, _, z = (away / np.linalg.norm(away, axis=1, keepdims=True)).T
    t = np.clip((1.2 * (z - 0.4) - x) / 0.3, 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def dressed_space(space: ShapeSpace) -> ShapeSpace:
    """The shape space with the thickness of every region as a further coefficient [m]."""
    normals = vertex_normals(space.vertices_m, space.skin.faces)
    return space.widened(coverage(space).T[:, :, None] * normals)


def dressed_human(
    shape: Float[ndarray, " k"] | None = None,
    clothing_m: Mapping[str, float] = USUAL_M,
    folder: Path | None = None,
) -> Human:
    """A body of some shape, its skin where the clothes are.

    Args:
        shape: Shape coefficients [standard deviations of adults]; the average adult if None.
        clothing_m: Thickness of what is worn per region [m]; empty for none.
        folder: Model folder; the one that ships if None.

    Raises:
        ModelError: if a model file is broken or does not have that many coefficients.
    """
    bare = load_human(folder, shape)
    if not clothing_m:
        return bare
    space = load_shape_space(folder)
    b, worn = checked_shape(space, shape), [clothing_m[region.name] for region in REGIONS]
    skin = _wardrobe(folder).bound(np.concatenate([b, worn]))
    return replace(bare, skin=skin, clothing_m=dict(clothing_m))


@cache
def _wardrobe(folder: Path | None) -> ShapeSpace:
    """`dressed_space` of a folder."""
    return dressed_space(load_shape_space(folder))


def fold_sigma(space: ShapeSpace) -> Callable[[Float[ndarray, " p"]], Float[ndarray, " v"]]:
    """How far the seen surface strays from body plus thickness: a function of the coefficients.

    What hangs loose folds more, so the spread grows with the thickness.
    """
    share = coverage(space)
    hand = _weights(space, "hand")
    face = np.clip(1.0 - share.sum(axis=1) - hand, 0.0, 1.0)
    least = share @ np.array([region.fold_m for region in REGIONS])
    least += face * FACE_M + hand * HAND_M
    return lambda b: np.asarray(np.hypot(least, LOOSE * (share @ b[-len(REGIONS) :])))

# SPDX-License-Identifier: Apache-2.0
"""Shoes and socks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray
from scipy.spatial import ConvexHull

from synthesis.people.drape import step, stretched
from synthesis.people.form import Form, dense_weights
from synthesis.people.scalp import SECTORS, bowl_faces, directions_at, elevations, sectors
from synthesis.people.sheet import Sheet, cut

ROWS = 20
SOLE_M = 0.001
"""How far a shoe reaches below the bare sole [m]."""
EDGE_M = 0.022
"""Height of the sole's rim [m]."""
TOE_CAP_M = 0.012
"""How far the leather stands above the toes [m]."""
OPENING = 6
"""Number of the cut round the ankle."""
SHAFT_WALL_M = 0.008
"""Thickness of a boot's shaft [m]."""


@dataclass(frozen=True)
class Shoe:
    """A kind of shoe."""

    shaft_m: float = 0.0
    """Height of a boot's shaft above the ankle [m]; 0 for a low shoe."""
    wall_m: float = 0.007
    """Thickness of its upper [m]."""
    toe_m: float = 0.010
    """Room before the toes [m]."""
    rim_m: float = 0.003
    """How far the sole stands out [m]."""


def make_shoe(form: Form, side: str, shoe: Shoe) -> Sheet:
    """A shoe for one foot: the hull of the foot with a flat sole, open round the shank.

    Args:
        form: Whose foot.
        side: `l` or `r`.
        shoe: Kind.
    """
    person = form.person
    names = person.skin.link_names
    foot, shank = names.index(f"{side}_foot"), names.index(f"{side}_shank")
    weights = dense_weights(person)
    ankle, opening = form.origin(f"{side}_foot"), form.origin(f"{side}_foot")[2]
    own = weights[:, foot] + weights[:, shank] > 0.6
    points = person.bind_vertices[own & (person.bind_vertices[:, 2] < opening + 0.03)]
    sole = points[:, 2].min()
    R = _heading(points[points[:, 2] < ankle[2]])
    local = (points - ankle) @ R
    middle = 0.5 * (local.min(axis=0) + local.max(axis=0))
    middle[2] = sole - ankle[2] + 0.03
    size = np.array([0.14, 0.055, 0.06])
    shape = (local - middle) / size
    hull = ConvexHull(shape).equations
    grid = np.meshgrid(sectors(), elevations(-0.5 * np.pi + 0.04, ROWS), indexing="xy")
    d = directions_at(np.r_[0.0, grid[0].ravel()], np.r_[0.5 * np.pi, grid[1].ravel()])
    along = d @ hull[:, :3].T
    reach = np.where(along > 1e-6, -hull[:, 3] / np.where(along > 1e-6, along, 1.0), np.inf)
    x = d * reach.min(axis=1)[:, None] * size + middle
    x = x + _outwards(x, middle) * shoe.wall_m
    x[:, 0] += shoe.toe_m * step(x[:, 0], middle[0] + 0.03, middle[0] + 0.13)
    height = x[:, 2] + ankle[2] - sole
    toes = step(x[:, 0], middle[0] - 0.02, middle[0] + 0.07) * step(height, 0.016, 0.03)
    x[:, 2] += TOE_CAP_M * toes
    rim = shoe.rim_m * step(height, EDGE_M + 0.004, EDGE_M - 0.004)
    flat = _outwards(x, middle) * [1.0, 1.0, 0.0]
    x = x + flat * rim[:, None]
    low = height < 0.014
    x[:, 2] = np.where(low, sole - SOLE_M - ankle[2] + 0.1 * np.maximum(height, 0.0), x[:, 2])
    vertices = ankle + x @ R.T
    n = len(vertices)
    full = np.zeros((n, len(names)))
    bend = step(vertices[:, 2], ankle[2] - 0.01, ankle[2] + 0.06)
    full[:, foot], full[:, shank] = 1.0 - bend, bend
    label = np.uint8(6 if side == "l" else 5)
    field = opening - vertices[:, 2]
    faces = bowl_faces(ROWS)
    bottom = 1 + (ROWS - 1) * SECTORS + np.arange(SECTORS)
    lid = np.stack([np.full(SECTORS - 2, bottom[0]), bottom[2:], bottom[1:-1]], axis=1)
    zero = np.zeros(n)
    sheet = Sheet(
        vertices,
        np.concatenate([faces, lid]),
        full,
        np.full(n, label, np.uint8),
        zero,
        zero,
        np.zeros(n, np.uint8),
        np.full(n, -1),
        field[:, None],
    )
    return cut(sheet, field, OPENING)


def make_shafts(form: Form, top_m: float, wall_m: float) -> tuple[Sheet, Bool[ndarray, " v"]]:
    """Both shafts of boots, or socks, from the ankles up to a height above them.

    Args:
        form: Whose legs.
        top_m: Height of the upper edge above the ankles [m].
        wall_m: Distance from the skin [m].

    Returns:
        The sheet, and which vertices of the form it hides.
    """
    legs, n = form.legs, len(form.vertices)
    x = stretched(form, form.vertices + wall_m * form.normals, form.vertices, np.full(n, wall_m), 8)
    edge = form.origin("l_foot")[2] + top_m
    field = np.where(legs.at > 1.2, edge - x[:, 2], -1.0)
    zero = np.zeros(n)
    whole = Sheet(
        x,
        form.faces,
        form.weights,
        form.labels,
        zero,
        zero,
        np.zeros(n, np.uint8),
        np.arange(n),
        field[:, None],
    )
    return cut(whole, field, OPENING), field > 0.05


def _heading(points: Float[ndarray, "n 3"]) -> Float[ndarray, "3 3"]:
    """Axes of a foot as columns: along it, across, up."""
    flat = points[:, :2] - points[:, :2].mean(axis=0)
    axis = np.linalg.eigh(flat.T @ flat)[1][:, 1]
    axis = axis * np.sign(axis[0])
    return np.array([[axis[0], -axis[1], 0.0], [axis[1], axis[0], 0.0], [0.0, 0.0, 1.0]])


def _outwards(x: Float[ndarray, "n 3"], middle: Float[ndarray, " 3"]) -> Float[ndarray, "n 3"]:
    """Unit vectors away from the long axis of a foot."""
    away = x - middle
    away = away * [1.0 / 0.14, 1.0 / 0.055, 1.0 / 0.06] / [0.14, 0.055, 0.06]
    return away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)

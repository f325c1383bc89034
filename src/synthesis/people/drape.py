# SPDX-License-Identifier: Apache-2.0
"""How cloth lies: hulls of the trunk, cloth under tension over a body, folds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import ConvexHull

from synthesis.noise import noise
from synthesis.people.form import Form

ROW_M = 0.015
"""Height of a row of a trunk map [m]."""
SECTORS = 96
"""Directions of a trunk map."""
TENSION_ROUNDS = 30
GROUND_M = 0.002
"""Least distance between cloth and what is under it [m]."""


@dataclass(frozen=True)
class Tube:
    """Radius of a closed surface about a vertical axis."""

    axis_x_m: float
    """Where the axis crosses y = 0 [m]."""
    bottom_m: float
    """Height of the first row [m]."""
    radius_m: Float[ndarray, "k s"]
    """Radius by row, upwards, and by direction from -pi [m]."""

    def radius(self, azimuth: Float[ndarray, " n"], z: Float[ndarray, " n"]) -> ndarray:
        """Radius in directions [rad] at heights [m], shape (N,)."""
        row = np.clip((z - self.bottom_m) / ROW_M, 0.0, len(self.radius_m) - 1.0)
        column = (azimuth + np.pi) / (2.0 * np.pi) * SECTORS
        wrapped = np.concatenate([self.radius_m, self.radius_m[:, :2]], axis=1)
        return map_coordinates(wrapped, [row, column], order=1, mode="nearest")

    def polar(self, points: Float[ndarray, "n 3"]) -> tuple[ndarray, ndarray]:
        """Azimuth [rad] and distance from the axis [m] of points, each (N,)."""
        x, y = points[:, 0] - self.axis_x_m, points[:, 1]
        return np.arctan2(y, x), np.hypot(x, y)


def tube_of(
    points: Float[ndarray, "n 3"],
    bottom_m: float,
    top_m: float,
    slopes: tuple[float, float],
    waist_m: float,
    ease_m: float,
) -> Tube:
    """Cloth that hangs around points: convex across, and narrowing downwards at most by a slope.

    Args:
        points: What it goes around [m].
        bottom_m: Lowest row [m].
        top_m: Highest row [m].
        slopes: How fast the cloth may narrow downwards, above and below the waist [m/m]; below
            zero it widens.
        waist_m: Height of the waist [m].
        ease_m: Distance from the points [m].
    """
    rows = max(2, round((top_m - bottom_m) / ROW_M) + 1)
    chosen = points[(points[:, 2] > bottom_m - ROW_M) & (points[:, 2] < top_m + ROW_M)]
    axis_x = 0.5 * (chosen[:, 0].min() + chosen[:, 0].max())
    angles = (np.arange(SECTORS) / SECTORS * 2.0 - 1.0) * np.pi
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    radius = np.zeros((rows, SECTORS))
    order = np.argsort(chosen[:, 2], kind="stable")
    z, xy = chosen[order, 2], chosen[order, :2] - [axis_x, 0.0]
    for n in range(rows):
        middle = bottom_m + n * ROW_M
        a, b = np.searchsorted(z, [middle - 1.2 * ROW_M, middle + 1.2 * ROW_M])
        if b - a >= 6:
            hull = ConvexHull(xy[a:b]).equations
            along = directions @ hull[:, :2].T
            reach = -hull[:, 2] / np.where(along > 1e-6, along, 1e-6)
            radius[n] = np.where(along > 1e-6, reach, np.inf).min(axis=1)
    radius = np.maximum(radius, 0.02)
    for n in range(rows - 2, -1, -1):
        slope = slopes[0] if bottom_m + n * ROW_M > waist_m else slopes[1]
        radius[n] = np.maximum(radius[n], radius[n + 1] - slope * ROW_M)
    soft = gaussian_filter(radius, (1.5, 1.5), mode=("nearest", "wrap"))
    return Tube(axis_x, bottom_m, np.maximum(radius, soft) + ease_m)


def stretched(
    form: Form,
    wanted: Float[ndarray, "v 3"],
    under: Float[ndarray, "v 3"],
    least_m: Float[ndarray, " v"],
    rounds: int = TENSION_ROUNDS,
    tension: Float[ndarray, " v"] | float = 1.0,
) -> Float[ndarray, "v 3"]:
    """A smooth surface that stays outside another: cloth under tension bridges what is hollow.

    Args:
        form: Normals and neighbours.
        wanted: Where the cloth would like to be [m], shape (V, 3).
        under: What it must not enter [m], shape (V, 3).
        least_m: Least distance along the normals [m], shape (V,).
        rounds: How far the tension reaches.
        tension: How taut the cloth is, 0..1.

    Returns:
        Places [m], shape (V, 3).
    """
    x, normals = wanted, form.normals
    pull = np.broadcast_to(tension, len(x))[:, None]
    for _ in range(rounds):
        step = 0.5 * (form.neighbours @ x - x)
        along = (step * normals).sum(axis=1, keepdims=True)
        x = x + pull * (0.3 * step + 0.7 * along * normals)
        x = outside(form, x, under, least_m)
    return x


def outside(
    form: Form,
    x: Float[ndarray, "v 3"],
    under: Float[ndarray, "v 3"],
    least_m: Float[ndarray, " v"],
) -> Float[ndarray, "v 3"]:
    """Places moved along the normals until they are far enough from what is under them."""
    depth = least_m - ((x - under) * form.normals).sum(axis=1)
    return x + np.maximum(depth, 0.0)[:, None] * form.normals


def near(at: Float[ndarray, " v"], place: float, width: float) -> Float[ndarray, " v"]:
    """A bell, 1 at a place."""
    return np.exp(-(((at - place) / width) ** 2))


def step(at: ndarray | float, start: float, end: float) -> ndarray:
    """From 0 at the start to 1 at the end, smooth; the start may lie above the end."""
    t = np.clip((np.asarray(at) - start) / (end - start), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def folds(
    form: Form, height_m: float, hems: tuple[float, float, float], seed: int
) -> Float[ndarray, " v"]:
    """Height of the folds at every vertex [m], shape (V,).

    Folds lie across the arms and legs, dense at elbows, knees and above the hems. On the trunk they
    are drawn together at the waist and hang below the shoulders.

    Args:
        form: Where.
        height_m: Height of the highest folds [m].
        hems: Where sleeves and legs end, and how high the trunk's hem is [m].
        seed: Of the noise.
    """
    arms, legs, v = form.arms, form.legs, form.vertices
    out = np.zeros(len(v))
    trunk = np.clip(1.0 - arms.share - legs.share, 0.0, 1.0)
    for limb, wave, hem, n in ((arms, 0.032, hems[0], 1), (legs, 0.045, hems[1], 2)):
        swirl = limb.outward * limb.radius_m[:, None] + form.side[:, None] * [0.0, 1.7, 0.0]
        bend = 0.03 * noise(np.column_stack([swirl[:, 0], swirl[:, 2], limb.at]) / 0.09, seed + n)
        place = np.column_stack([(limb.along_m + bend) / wave, swirl[:, [0, 1]] / 0.11])
        ridge = _ridge(place, seed + 10 * n)
        size = 0.35 + 0.65 * near(limb.at, 1.0, 0.30) + 0.6 * near(limb.at, hem, 0.25)
        size += 0.5 * near(limb.at, 0.15, 0.2)
        out += limb.share * np.minimum(size, 1.0) * ridge
    waist = form.origin("abdomen")[2]
    slant = v[:, 2] + 0.35 * np.hypot(v[:, 1], 0.06) + 0.02 * noise(v / 0.12, seed + 5)
    across = _ridge(np.column_stack([slant / 0.04, v[:, 0] / 0.14, v[:, 1] / 0.14]), seed + 6)
    hang = _ridge(np.column_stack([v[:, 0] / 0.05, v[:, 1] / 0.05, slant / 0.30]), seed + 7)
    gather = 0.9 * near(v[:, 2], waist, 0.10)
    fall = 0.25 + 0.55 * near(v[:, 2], hems[2], 0.15)
    broad = _ridge(np.column_stack([slant / 0.10, v[:, 0] / 0.09, v[:, 1] / 0.09]), seed + 8)
    out += trunk * (np.maximum(gather * across, fall * hang) + 0.6 * broad)
    return height_m * form.smoothed(out, 2)


def _ridge(place: Float[ndarray, "n 3"], seed: int) -> Float[ndarray, " n"]:
    value = 0.5 + 0.5 * noise(place, seed)
    return step(value, 0.25, 0.85)

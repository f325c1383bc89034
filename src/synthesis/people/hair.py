# SPDX-License-Identifier: Apache-2.0
"""Hair: shells of the scalp, locks down the back, buns, tails and beards."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import minimum_filter

from synthesis.noise import noise, rough
from synthesis.people.drape import step
from synthesis.people.scalp import (
    Head,
    bowl_faces,
    directions_at,
    elevations,
    of_head,
    sectors,
)
from synthesis.people.sheet import Sheet, cut, smoother

HAIRLINE_DEG = np.array([
    (0, 50), (25, 46), (45, 34), (62, 12), (74, -8), (84, -14), (92, 6), (104, 6), (114, -18),
    (140, -38), (180, -42),
])  # fmt: skip
"""Azimuth from the front and elevation of the hairline [deg]."""
LOWEST_RAD = np.radians(-50.0)
CAP_ROWS, FALL_ROWS = 30, 26
LOCK_M = 0.022
"""Width of a lock [m]."""
LINE = 5
"""Number of the cut along the hairline."""


@dataclass(frozen=True)
class Hair:
    """A hair style."""

    top_m: float = 0.022
    """Thickness on top [m]."""
    sides_m: float = 0.012
    """Thickness at the sides and the back [m]."""
    length_m: float = 0.0
    """How far it falls below the height of the eyes [m]; 0 follows the hairline."""
    tied: str = ""
    """`bun`, `tail` or nothing."""
    receding: float = 0.0
    """How far the hairline has drawn back, 0..1."""
    rough_m: float = 0.005
    """Height of the locks [m]."""


def grow_hair(
    head: Head, hair: Hair, around: Float[ndarray, "n 3"], pressed: float, seed: int
) -> list[Sheet]:
    """Hair of a style.

    Args:
        head: Whose.
        hair: Style.
        around: Neck, trunk and clothes that falling hair stays behind [m].
        pressed: How far a hat presses it down, 0..1.
        seed: Of the locks.

    Returns:
        One sheet, and one more for what is tied.
    """
    rows = elevations(LOWEST_RAD, CAP_ROWS)
    azimuth, elevation = (grid.ravel() for grid in np.meshgrid(sectors(), rows, indexing="xy"))
    azimuth, elevation = np.r_[0.0, azimuth], np.r_[0.5 * np.pi, elevation]
    direction = directions_at(azimuth, elevation)
    field = hairline(head, azimuth, elevation, hair, seed)
    thick = thickness(head, direction, field, hair, seed)
    thick = 0.003 + (thick - 0.003) * (1.0 - 0.8 * pressed * step(elevation, 0.1, 0.5))
    vertices = head.centre + direction * (head.reach(direction) + thick)[:, None]
    faces = bowl_faces(CAP_ROWS)
    if hair.length_m > 0.0:
        field = np.where(np.abs(azimuth) > np.radians(66.0), np.maximum(field, 0.01), field)
        sheets = [_falling(head, hair, vertices, azimuth, elevation, field, around, seed)]
    else:
        sheets = [cut(of_head(head, vertices, faces, field[:, None]), field, LINE)]
    if hair.tied == "bun":
        sheets.append(_ball(head, 0.034 * head.scale, seed))
    if hair.tied == "tail":
        sheets.append(_tail(head, 0.24, around, seed))
    return sheets


def hairline(
    head: Head,
    azimuth: Float[ndarray, " n"],
    elevation: Float[ndarray, " n"],
    hair: Hair,
    seed: int,
) -> Float[ndarray, " n"]:
    """Distance from the hairline, above zero where hair grows [m], shape (N,)."""
    line = np.radians(np.interp(np.degrees(np.abs(azimuth)), *HAIRLINE_DEG.T))
    front = step(np.abs(azimuth), 1.3, 0.4)
    line = line + hair.receding * front * np.radians(34.0)
    ragged = 0.05 * noise(directions_at(azimuth, 0.3 * elevation) * 6.0, seed)
    return (elevation - line + ragged) * 0.09 * head.scale


def thickness(
    head: Head,
    direction: Float[ndarray, "n 3"],
    field_m: Float[ndarray, " n"],
    hair: Hair,
    seed: int,
) -> Float[ndarray, " n"]:
    """Thickness of the hair in each direction [m], shape (N,)."""
    crown = step(direction[:, 2], 0.1, 0.75)
    thick = hair.sides_m + (hair.top_m - hair.sides_m) * crown
    lock = direction * [0.5, 1.0, 0.35] * (0.1 / LOCK_M)
    locks = rough(lock, seed, 2) + 0.6 * noise(direction * 2.2, seed + 9)
    thick = thick + hair.rough_m * locks
    edge = 0.35 + 0.65 * step(field_m, 0.0, 0.03)
    return np.maximum(thick * edge * head.scale, 0.002)


def _falling(
    head: Head,
    hair: Hair,
    cap: Float[ndarray, "v 3"],
    azimuth: Float[ndarray, " v"],
    elevation: Float[ndarray, " v"],
    field: Float[ndarray, " v"],
    around: Float[ndarray, "n 3"],
    seed: int,
) -> Sheet:
    """The cap as far as the height of the eyes, and rows that fall from there."""
    angle = sectors()
    kept = int((elevation[1:] > np.radians(-4.0)).sum()) // len(angle)
    count = 1 + kept * len(angle)
    row = cap[count - len(angle) : count]
    back = step(np.abs(angle), np.radians(80.0), np.radians(125.0))
    end = row[:, 2] - hair.length_m * (0.55 + 0.45 * back) - 0.02 * noise(row / 0.02, seed + 3)
    behind = _back_surface(around)
    rows = []
    for n in range(1, FALL_ROWS + 1):
        t = n / FALL_ROWS
        z = row[:, 2] + (end - row[:, 2]) * t
        inward = 1.0 - 0.12 * step(t * hair.length_m, 0.10, 0.22)
        x = head.centre[0] + (row[:, 0] - head.centre[0]) * inward
        y = row[:, 1] * inward
        lock = np.stack([np.cos(angle), np.sin(angle), 0.4 * z], axis=1) * (0.09 / LOCK_M)
        out = 0.5 * hair.rough_m * noise(lock, seed + 4) * (1.0 + t)
        x, y = x + out * np.cos(angle), y + out * np.sin(angle)
        x = np.minimum(x, behind(y, z) - 0.008 - 0.5 * hair.sides_m * (1.0 - 0.5 * t))
        rows.append(np.stack([x, y, z], axis=1))
    vertices = np.concatenate([cap[:count], *rows])
    total = kept + FALL_ROWS
    start = np.radians(70.0) if hair.length_m < 0.2 else np.radians(78.0)
    free = np.tile((np.abs(angle) - start) * 0.09, FALL_ROWS)
    fields = np.r_[field[:count], free]
    room = np.r_[np.zeros(count), np.repeat(0.03 * np.linspace(0.1, 1.0, FALL_ROWS), len(angle))]
    room *= min(1.0, hair.length_m / 0.3)
    faces = bowl_faces(total)
    mean = smoother(faces, len(vertices))
    soft = vertices
    for _ in range(3):
        soft = np.concatenate([vertices[:count], (0.5 * soft + 0.5 * (mean @ soft))[count:]])
    return cut(of_head(head, soft, faces, fields[:, None], room), fields, LINE)


def _back_surface(around: Float[ndarray, "n 3"]) -> Callable[[ndarray, ndarray], ndarray]:
    """Function of y and z [m] that gives how far back things reach there [m]."""
    cell = 0.02
    low = around.min(axis=0) - cell
    index = ((around - low) / cell).astype(int)
    shape = index.max(axis=0) + 2
    grid = np.full((shape[1], shape[2]), 1.0)
    np.minimum.at(grid, (index[:, 1], index[:, 2]), around[:, 0])
    padded = np.pad(grid, 1, constant_values=1.0)
    grid = minimum_filter(padded, 3)[1:-1, 1:-1]

    def behind(y: ndarray, z: ndarray) -> ndarray:
        a = np.clip(((y - low[1]) / cell).astype(int), 0, shape[1] - 1)
        b = np.clip(((z - low[2]) / cell).astype(int), 0, shape[2] - 1)
        return np.where(z > low[2] + cell * (shape[2] - 2), 1.0, grid[a, b])

    return behind


def _ball(head: Head, radius_m: float, seed: int) -> Sheet:
    """A bun at the back of the head."""
    direction = directions_at(np.array([np.pi]), np.array([np.radians(28.0)]))
    middle = head.centre + direction[0] * (head.reach(direction)[0] + 0.75 * radius_m)
    rows = 14
    grid = np.meshgrid(sectors(), elevations(-0.5 * np.pi + 0.05, rows), indexing="xy")
    d = directions_at(np.r_[0.0, grid[0].ravel()], np.r_[0.5 * np.pi, grid[1].ravel()])
    size = radius_m * (1.0 + 0.12 * rough(d * 2.5, seed)) * (1.0 - 0.2 * np.abs(d[:, 0]))
    return of_head(head, middle + d * size[:, None], bowl_faces(rows), np.ones((len(d), 1)))


def _tail(head: Head, length_m: float, around: Float[ndarray, "n 3"], seed: int) -> Sheet:
    """A tail of hair that hangs from the back of the head."""
    direction = directions_at(np.array([np.pi]), np.array([np.radians(25.0)]))
    start = head.centre + direction[0] * (head.reach(direction)[0] - 0.01)
    rows, angle = 18, sectors()
    behind = _back_surface(around)
    t = np.linspace(0.0, 1.0, rows)[:, None]
    x = start[0] - 0.05 * step(t, 0.0, 0.3) + 0.02 * step(t, 0.3, 1.0)
    z = start[2] + 0.02 * step(t, 0.0, 0.12) - length_m * t**1.3
    radius = 0.012 + 0.02 * step(t, 0.0, 0.35) - 0.026 * step(t, 0.5, 1.0)
    lock = np.stack(
        [np.cos(angle) + 0.0 * t, np.sin(angle) + 0.0 * t, 2.0 * t + 0.0 * angle], axis=2
    )
    radius = radius * (1.0 + 0.25 * noise(lock.reshape(-1, 3) * 2.0, seed).reshape(rows, -1))
    x = np.minimum(x, behind(0.0 * z, z) - radius.max() - 0.004)
    ring = np.stack([x + radius * np.cos(angle), radius * np.sin(angle), z + 0.0 * angle], axis=2)
    vertices = np.concatenate([[start], ring.reshape(-1, 3)])
    room = np.r_[0.0, np.repeat(0.045 * t[:, 0], len(angle))]
    return of_head(head, vertices, bowl_faces(rows), np.ones((len(vertices), 1)), room)

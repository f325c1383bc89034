# SPDX-License-Identifier: Apache-2.0
"""Floor, walls, ceiling, and what hangs on them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.random import Generator

from synthesis.mesh import Material, Mesh, join, mesh_of
from synthesis.objects import finishes
from synthesis.objects.bars import pose, put, tube
from synthesis.objects.openings import curtain, door
from synthesis.objects.plan import Plan, Rect
from synthesis.objects.shapes import box
from synthesis.patterns import Wood, floor_pattern, wall_pattern

BEYOND_M = (3.0, 6.0)
"""How much farther away a wall is that counts as missing [m]."""
THICK_M = 0.12
"""Of walls [m]."""


def shell(
    rng: Generator, plan: Plan, walls: Mapping[str, bool], height: float, ceiling: bool
) -> list[Mesh]:
    """Floor, walls with skirting, and perhaps a ceiling, in the room's frame.

    Args:
        rng: Draws materials.
        plan: The floor.
        walls: Which of back (x), left (y), right (-y) and front (-x) end the plan's floor; the
            others stand far beyond.
        height: Of the walls [m].
        ceiling: Whether there is one.
    """
    beyond = rng.uniform(*BEYOND_M, 2)
    low = plan.low - beyond * [not walls["front"], not walls["right"]]
    high = plan.high + beyond * [not walls["back"], not walls["left"]]
    stuff = Material(floor_pattern(rng), rng.uniform(0.3, 0.6), rng.choice([0.0, 0.05, 0.15]))
    parts = [_level(low, high, 0.0, stuff)]
    if ceiling:
        white = Material(finishes.grey(rng, 0.7, 0.85), rng.uniform(0.6, 0.8))
        parts.append(_level(low, high, height, white, down=True))
    plaster = _plaster(rng)
    accent = _plaster(rng) if rng.random() < 0.3 else plaster
    skirting = finishes.board(rng) if rng.random() < 0.7 else None
    for name, T, length in sides(low, high):
        wall = box((THICK_M, length + 2 * THICK_M, height), accent if name == "back" else plaster)
        wall = wall.moved(T @ pose((-THICK_M / 2, 0, 0)))
        parts.append(replace(wall, coords=wall.vertices))
        if skirting is not None:
            strip = box((0.015, length, 0.08), skirting)
            parts.append(strip.moved(T @ pose((0.0075, 0, 0))))
    return parts


def _plaster(rng: Generator) -> Material:
    """Of walls, whose coords are places in space; wood runs upward."""
    pattern = wall_pattern(rng)
    if isinstance(pattern, Wood):
        pattern = replace(pattern, axis=2)
    return Material(pattern, rng.uniform(0.45, 0.8))


def sides(low: ndarray, high: ndarray) -> list[tuple[str, Float[ndarray, "4 4"], float]]:
    """Name, T_room_wall and length of each wall; its x looks into the room, its y runs along it."""
    x, y = 0.5 * (low + high)
    long_x, long_y = (high - low).tolist()
    return [
        ("back", pose((high[0], y, 0), np.pi), long_y),
        ("left", pose((x, high[1], 0), -np.pi / 2), long_x),
        ("right", pose((x, low[1], 0), np.pi / 2), long_x),
        ("front", pose((low[0], y, 0), 0.0), long_y),
    ]


def _level(low: ndarray, high: ndarray, z: float, stuff: Material, down: bool = False) -> Mesh:
    corners = np.array(
        [[low[0], low[1], z], [high[0], low[1], z], [high[0], high[1], z], [low[0], high[1], z]]
    )
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return mesh_of(corners, faces[:, ::-1] if down else faces, stuff)


def hangings(rng: Generator, plan: Plan, walls: Mapping[str, bool], height: float) -> list[Mesh]:
    """Doors, windows with their curtains and radiators, pictures and posters.

    A door takes the floor before it; so does a radiator.
    """
    parts = []
    for name, T, length in sides(plan.low, plan.high):
        if not walls[name] or name == "front":
            continue
        used: list[tuple[float, float]] = []
        for kind in rng.permutation(["door", "window", "print", "print", "print", "shelf"]):
            chance = {"door": 0.4, "window": 0.4, "print": 0.4, "shelf": 0.15}[kind]
            wide = {"door": 1.1, "window": rng.uniform(0.8, 1.8), "shelf": rng.uniform(0.5, 1.0)}
            size = wide.get(kind, rng.uniform(0.25, 0.9))
            if rng.random() > chance or size > length - 0.2:
                continue
            y = rng.uniform(-0.5, 0.5) * (length - size - 0.2)
            if any(abs(y - other) < 0.5 * (size + room) + 0.1 for other, room in used):
                continue
            mesh, deep = _hanging(rng, kind, size, height)
            foot = (T @ np.array([deep / 2, y, 0, 1]))[:2]
            rect = Rect(foot, np.array([deep, size]), float(np.arctan2(T[1, 0], T[0, 0])))
            if deep and not plan.free(rect, height):
                continue
            if deep:
                plan.taken.append(rect)
            used.append((y, size))
            parts.append(mesh.moved(T @ pose((0.001, y, 0))))
    return parts


def _hanging(rng: Generator, kind: str, size: float, height: float) -> tuple[Mesh, float]:
    """A mesh at y = 0 of a wall, and how deep the floor before it is taken [m]."""
    if kind == "door":
        mesh = door(rng).mesh
        return put(mesh, (0.02, 0, 0)), float(mesh.vertices[:, 0].max()) + 0.05
    if kind == "window":
        return _window(rng, size, height)
    if kind == "shelf":
        board = put(box((0.22, size, 0.025), finishes.board(rng)), (0.11, 0, 1.6))
        pots = [
            put(box(rng.uniform(0.06, 0.2, 3), finishes.cover(rng)), (0.11, y, 1.625))
            for y in np.linspace(-0.35, 0.35, int(rng.integers(1, 5))) * size
        ]
        return join([board, *pots]), 0.23
    return _print(rng, size), 0.0


def _window(rng: Generator, size: float, height: float) -> tuple[Mesh, float]:
    sill, tall = rng.uniform(0.75, 1.0), rng.uniform(1.0, 1.35)
    frame, bar = finishes.paint(rng), 0.06
    pane = Material(finishes.grey(rng, 0.3, 0.9), 0.03, 0.6)
    parts = [put(box((0.01, size, tall), pane), (0.01, 0, sill))]
    for y in (-size / 2, 0.0, size / 2) if size > 1.1 else (-size / 2, size / 2):
        parts.append(put(box((0.05, bar, tall), frame), (0.02, y, sill)))
    for z in (sill - bar / 2, sill + tall - bar / 2):
        parts.append(put(box((0.05, size + bar, bar), frame), (0.02, 0, z)))
    parts.append(put(box((0.2, size + 0.15, 0.03), frame), (0.1, 0, sill - 0.06)))
    deep = 0.0
    if rng.random() < 0.5:
        deep, fins = 0.15, int(size / 0.06)
        white = finishes.paint(rng)
        parts.append(put(box((0.05, 0.9 * size, 0.5), white, 0.01), (0.08, 0, 0.12)))
        for y in (np.arange(fins) - fins / 2 + 0.5) * 0.9 * size / fins:
            parts.append(put(box((0.016, 0.03, 0.46), white), (0.11, y, 0.14)))
    if rng.random() < 0.5:
        cloth = curtain(rng).mesh
        wide, top = np.ptp(cloth.vertices[:, 1]), cloth.vertices[:, 2].max()
        scale = np.diag([1.0, 0.4 * size / wide, min(height - 0.1, sill + tall + 0.2) / top, 1.0])
        for side in (-1, 1):
            parts.append(put(cloth.moved(scale), (0.14, side * 0.5 * size, 0)))
        rod = [[0.14, s * 0.75 * size, scale[2, 2] * top] for s in (-1, 1)]
        parts.append(tube(rod, 0.011, finishes.metal(rng)))
        deep = 0.22
    return join(parts), deep


def _print(rng: Generator, size: float) -> Mesh:
    """A poster or a framed picture, its middle at eye height."""
    tall = size * rng.choice([0.7, 1.0, 1.4])
    low, framed = max(0.9, 1.55 - tall / 2), rng.random() < 0.6
    picture = finishes.printed(rng)
    half = size / 2 - (0.03 if framed else 0.0)
    x, up = (
        0.016 if framed else 0.004,
        (low + (0.03 if framed else 0.0), low + tall - 0.03 * framed),
    )
    corners = np.array([[x, -half, up[0]], [x, half, up[0]], [x, half, up[1]], [x, -half, up[1]]])
    uv = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    face = mesh_of(corners, np.array([[0, 1, 2], [0, 2, 3]]), picture, uv)
    stuff = finishes.board(rng) if framed else finishes.paper(rng)
    parts = [face, put(box((x - 0.001, size, tall), stuff), ((x - 0.001) / 2, 0, low))]
    if framed:
        for z in (low, low + tall - 0.03):
            parts.append(put(box((0.025, size, 0.03), stuff), (0.0125, 0, z)))
        for y in (-size / 2 + 0.015, size / 2 - 0.015):
            parts.append(put(box((0.025, 0.03, tall), stuff), (0.0125, y, low)))
    return join(parts)

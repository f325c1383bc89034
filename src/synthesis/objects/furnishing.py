# SPDX-License-Identifier: Apache-2.0
"""Furniture along the walls, things that stand about, and what lies on floor and tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy import ndarray
from numpy.random import Generator

from synthesis.mesh import Mesh
from synthesis.objects.bars import pose, put
from synthesis.objects.files import standing
from synthesis.objects.furniture import books
from synthesis.objects.plan import Plan, Rect
from synthesis.objects.thing import Thing
from synthesis.objects.walls import sides

Makers = Mapping[str, Callable[[Generator], Thing]]

AT_WALL = ("sofa", "shelf", "cabinet", "desk", "table", "bench", "bedside_table")
"""Kinds that stand with their back to a wall."""
ABOUT = (
    "chair", "desk_chair", "stool", "lamp", "plant", "bin", "box", "suitcase", "trolley", "guitar",
    "bag", "ball", "bottle", "table", "cushion",
)  # fmt: skip
"""Kinds that stand anywhere."""
LEANING = ("broom", "guitar", "pole")
"""Kinds that lean against walls."""
AT_TABLES = ("chair", "desk_chair", "stool")
"""Kinds that face tables."""
ON_TABLES = ("monitor", "laptop", "cup", "bottle", "phone", "bag", "box")
"""Kinds that stand on tables."""
LEAN_RAD = 0.2
"""How far a thing leans."""
TRIES = 20
"""Places that are tried for a thing."""
NEAR_M = 1.6
"""Half of the things that stand anywhere stand about this near to the person [m]."""


def furnish(
    rng: Generator,
    plan: Plan,
    things: Makers,
    walls: Mapping[str, bool],
    clutter: float,
    budget: int,
) -> list[Mesh]:
    """Fill a room.

    Args:
        rng: Draws.
        plan: The floor; what is placed is noted there.
        things: Kinds that may be used.
        walls: Which walls exist.
        clutter: 0 nearly empty, 1 full.
        budget: Most triangles.
    """
    parts: list[Mesh] = []
    present = [(T, length) for name, T, length in sides(plan.low, plan.high) if walls[name]]
    for kinds, most, share in ((AT_WALL, 12, 0.2 + 0.7 * clutter), (LEANING, 2, 0.4 * clutter)):
        known = [name for name in kinds if name in things]
        for _ in range(rng.binomial(most, share) if known else 0):
            thing = things[str(rng.choice(known))](rng)
            if kinds is LEANING:
                thing = _tipped(thing, -LEAN_RAD)
            parts += _place(rng, plan, things, thing, _at_wall(rng, thing, present))
    known = [name for name in ABOUT if name in things]
    for _ in range(rng.binomial(14, 0.15 + 0.65 * clutter) if known else 0):
        thing = things[str(rng.choice(known))](rng)
        if thing.name == "cushion":
            thing = _tipped(thing, np.pi / 2)
        parts += _place(rng, plan, things, thing, _anywhere(rng, plan))
    count = np.cumsum([len(mesh.faces) for mesh in parts])
    return [mesh for mesh, total in zip(parts, count, strict=True) if total <= budget]


def _tipped(thing: Thing, pitch: float) -> Thing:
    """The thing turned about y and set down again, without its places."""
    return Thing(thing.name, standing(put(thing.mesh, pitch=pitch)))


def _at_wall(
    rng: Generator, thing: Thing, present: list[tuple[ndarray, float]]
) -> Callable[[], ndarray]:
    back = 0.03 - float(thing.mesh.vertices[:, 0].min())

    def draw() -> ndarray:
        T, length = present[rng.integers(len(present))]
        return T @ pose((back, rng.uniform(-0.5, 0.5) * length, 0))

    return draw


def _anywhere(rng: Generator, plan: Plan) -> Callable[[], ndarray]:
    def draw() -> ndarray:
        at = rng.uniform(plan.low, plan.high)
        if rng.random() < 0.5:
            at = plan.keep_clear[rng.integers(len(plan.keep_clear))] + rng.normal(0, NEAR_M, 2)
        return pose((*at, 0), rng.uniform(-np.pi, np.pi))

    return draw


def _place(
    rng: Generator, plan: Plan, things: Makers, thing: Thing, draw: Callable[[], ndarray]
) -> list[Mesh]:
    """The thing where it first fits, with what lies on it and stands at it; else nothing."""
    load = _load(rng, things, thing)
    top = max([0.0, *(float(mesh.vertices[:, 2].max()) for mesh in load)])
    drawn = (draw() for _ in range(TRIES))
    T = next((T for T in drawn if _stands(plan, thing.mesh, T, top)), None)
    if T is None:
        return []
    parts = [mesh.moved(T) for mesh in (thing.mesh, *load)]
    known = [name for name in AT_TABLES if name in things]
    if thing.name in ("table", "desk") and known and rng.random() < 0.7:
        half = 0.5 * np.ptp(thing.mesh.vertices, axis=0)
        seat = things[str(rng.choice(known))](rng)
        reach = float(seat.mesh.vertices[:, 0].max()) + 0.08
        for angle, x in ((np.pi, half[0]), (-np.pi / 2, half[1]), (np.pi / 2, half[1])):
            if rng.random() < 0.6:
                away = pose((0, 0, 0), angle + np.pi) @ pose((x + reach, 0, 0), np.pi)
                spot = T @ away @ pose((0, 0, 0), rng.normal(0, 0.2))
                if _stands(plan, seat.mesh, spot):
                    parts.append(seat.mesh.moved(spot))
    return parts


def _stands(plan: Plan, mesh: Mesh, T: ndarray, top_m: float = 0.0) -> bool:
    """Whether there is place for a mesh, which is then taken."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle = (T @ np.array([*(0.5 * (low + high))[:2], 0, 1]))[:2]
    rect = Rect(middle, (high - low)[:2], float(np.arctan2(T[1, 0], T[0, 0])))
    if not plan.free(rect, max(float(high[2]), top_m)):
        return False
    plan.taken.append(rect)
    return True


def _load(rng: Generator, things: Makers, thing: Thing) -> list[Mesh]:
    """What lies on a table, a desk or a low cupboard."""
    low, high = thing.mesh.vertices.min(axis=0), thing.mesh.vertices.max(axis=0)
    if thing.name not in ("table", "desk", "cabinet") or high[2] > 1.2:
        return []
    kinds = [name for name in ON_TABLES if name in things]
    half, parts = 0.3 * (high - low)[:2], []
    spots: list[tuple[ndarray, float]] = []
    for _ in range(rng.integers(0, 5)):
        spot = rng.uniform(-half, half)
        if kinds and rng.random() < 0.7:
            mesh = things[str(rng.choice(kinds))](rng).mesh
        else:
            mesh = books(rng, 0.2, lying=True)
        reach = 0.5 * np.ptp(mesh.vertices[:, :2], axis=0).max()
        if reach > 1.5 * half.min() or any(
            np.linalg.norm(spot - at) < reach + other for at, other in spots
        ):
            continue
        spots.append((spot, reach))
        parts.append(put(mesh, (*spot, high[2]), rng.normal(0, 0.3)))
    return parts

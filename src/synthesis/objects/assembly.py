# SPDX-License-Identifier: Apache-2.0
"""Things that are no kind of thing: parts of any shape put together by chance.

Objects that nobody has modelled have rounded backs, posts, rests and limbs, too. A network that has
met only furniture takes them for people; what has no name teaches it otherwise (domain
randomisation: Tobin et al. 2017).
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Material, Mesh, join
from synthesis.objects import finishes
from synthesis.objects.bars import bent, put, sheet, tube
from synthesis.objects.shapes import box, cylinder
from synthesis.objects.thing import Thing
from synthesis.objects.turned import cushion, lathe, sphere

FINISHES = (
    finishes.wood, finishes.cloth, finishes.upholstery, finishes.paint, finishes.plastic,
    finishes.dark_plastic, finishes.metal, finishes.printed, finishes.cardboard,
)  # fmt: skip
MOST_PARTS = 8
"""Parts of one assembly."""
HIGHEST_M = 1.6
"""No part begins above [m]."""


def assembly(rng: Generator) -> Thing:
    """Two to eight parts one upon the other, the largest half a metre to one metre."""
    size, lean = rng.uniform(0.45, 1.0), rng.normal(0.0, 0.15, 2)
    materials = [FINISHES[rng.integers(len(FINISHES))](rng) for _ in range(3)]
    parts, z = [], 0.0
    for _ in range(int(rng.integers(2, MOST_PARTS + 1))):
        part = _part(rng, size * rng.uniform(0.3, 1.0), materials[rng.integers(3)])
        at = np.append(z * lean + rng.normal(0.0, 0.1 * size, 2), z)
        tilt = rng.normal(0.0, 0.3, 2) if rng.random() < 0.7 else rng.uniform(-1.6, 1.6, 2)
        parts.append(put(part, at, rng.uniform(-np.pi, np.pi), *tilt))
        top = float(parts[-1].vertices[:, 2].max())
        z = max(0.0, rng.uniform(0.3, 1.0) * top + (1.0 - rng.uniform(0.3, 1.0)) * z)
        if z > HIGHEST_M:
            break
    mesh = join(parts)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return Thing("assembly", put(mesh, -np.append(0.5 * (low + high)[:2], low[2])))


def _part(rng: Generator, size: float, material: Material) -> Mesh:
    """One part whose longest side is about so long [m]."""
    x, y, z = size * np.exp(rng.uniform(-1.1, 0.0, 3))
    kind = rng.integers(7)
    if kind == 0:
        return box((x, y, z), material, 0.1 * min(x, y, z))
    if kind == 1:
        return cushion((x, y, z), material, rng.uniform(0.25, 1.0))
    if kind == 2:
        return cylinder(0.4 * min(x, y), z, material, 0.05 * min(x, y, z))
    if kind == 3:
        return sphere(0.35 * min(x, y), material)
    if kind == 4:
        radii = 0.4 * size * rng.uniform(0.15, 1.0, 6)
        heights = size * np.linspace(0.0, 1.0, 6)
        return lathe(np.column_stack([np.append(radii[:-1], 1e-4), heights]), material)
    if kind == 5:
        path = np.cumsum(rng.normal(0.0, 0.5 * size, (4, 3)), axis=0)
        return tube(bent(path, 0.2 * size), rng.uniform(0.01, 0.09) * size + 0.008, material)
    return _shell(rng, size, material)


def _shell(rng: Generator, size: float, material: Material) -> Mesh:
    """An upright plate that bulges, like the back of a seat, a shield or a sign."""
    width, height = size * rng.uniform(0.3, 1.0), size * rng.uniform(0.4, 1.0)
    bulge, twist, waist = rng.normal(0.0, 0.25), rng.normal(0.0, 0.2), rng.uniform(0.4, 1.0)
    s, rows = np.linspace(-1.0, 1.0, 9), []
    for t in np.linspace(0.0, 1.0, 10):
        half = 0.5 * width * (waist + (1.0 - waist) * np.sin(np.pi * t))
        deep = width * (bulge * s**2 + twist * s * t) + 0.2 * bulge * height * np.sin(np.pi * t)
        rows.append(np.column_stack([deep, half * s, np.full(9, height * t)]))
    return sheet(np.array(rows), rng.uniform(0.01, 0.08), material)

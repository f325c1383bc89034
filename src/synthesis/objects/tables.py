# SPDX-License-Identifier: Apache-2.0
"""Tables and desks."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Material, Mesh, join
from synthesis.objects import finishes
from synthesis.objects.bars import put, staple, tube
from synthesis.objects.shapes import box, cylinder
from synthesis.objects.thing import Thing


def table(rng: Generator) -> Thing:
    """A dining or coffee table, with corners or round, on four legs or one foot."""
    low = rng.random() < 0.3
    height = rng.uniform(0.38, 0.48) if low else rng.uniform(0.72, 0.77)
    x, y = rng.uniform(0.55, 0.9), rng.uniform(0.7, 1.6 if not low else 1.2)
    thick, round_ = rng.uniform(0.018, 0.045), rng.random() < 0.3
    top = finishes.board(rng)
    frame = top if rng.random() < 0.5 else finishes.metal(rng)
    if round_:
        r = rng.uniform(0.3, 0.6)
        parts = [put(cylinder(r, thick, top, 0.2 * thick, 36), (0, 0, height - thick))]
        if rng.random() < 0.6:
            foot = min(0.8 * r, 0.38)
            parts.append(cylinder(foot, 0.02, frame, 0.005, 30))
            parts.append(
                put(cylinder(rng.uniform(0.03, 0.05), height - thick - 0.02, frame), (0, 0, 0.02))
            )
            return Thing("table", join(parts))
        x = y = 1.2 * r
    else:
        parts = [
            put(box((x, y, thick), top, 0.15 * thick, rng.uniform(0, 0.04)), (0, 0, height - thick))
        ]
    return Thing("table", join(parts + _legs(rng, x - 0.06, y - 0.06, height - thick, frame)))


def _legs(rng: Generator, x: float, y: float, height: float, frame: Material) -> list[Mesh]:
    """Four legs whose tops stand at (+-x/2, +-y/2), with rails below the board at times."""
    bar, splay = rng.uniform(0.03, 0.065), rng.choice([0.0, 0.0, 0.05])
    square, parts = splay == 0 and rng.random() < 0.7, []
    for sx in (-1, 1):
        for sy in (-1, 1):
            ax, ay = sx * (x - bar) / 2, sy * (y - bar) / 2
            if square:
                parts.append(put(box((bar, bar, height), frame, 0.002), (ax, ay, 0)))
            else:
                foot = [ax + sx * splay, ay + sy * splay, 0]
                parts.append(tube([foot, [ax, ay, height]], [0.3 * bar, 0.5 * bar], frame, 10))
    if rng.random() < 0.6:
        high = rng.uniform(0.05, 0.09)
        for s in (-1, 1):
            rail = box((x - bar, 0.02, high), frame)
            parts.append(put(rail, (0, s * (y - bar) / 2, height - high)))
            rail = box((0.02, y - bar, high), frame)
            parts.append(put(rail, (s * (x - bar) / 2, 0, height - high)))
    return parts


def desk(rng: Generator) -> Thing:
    """A writing desk; who sits at it looks along -x, at its front edge; drawers at times."""
    height, x, y = rng.uniform(0.71, 0.76), rng.uniform(0.6, 0.8), rng.uniform(1.1, 1.7)
    top, thick = finishes.board(rng), rng.uniform(0.02, 0.03)
    frame = finishes.metal(rng) if rng.random() < 0.5 else top
    parts = [put(box((x, y, thick), top, 0.002, 0.006), (0, 0, height - thick))]
    if rng.random() < 0.5:
        for s in (-1, 1):
            parts.append(
                put(box((x - 0.06, 0.03, height - thick), frame), (0, s * (y / 2 - 0.04), 0))
            )
    else:
        for s in (-1, 1):
            side = s * (y / 2 - 0.1)
            parts.append(put(box((x - 0.04, 0.06, 0.025), frame, 0.003), (0, side, 0)))
            parts.append(
                put(box((0.08, 0.045, height - thick - 0.02), frame, 0.003), (-0.05, side, 0.02))
            )
            parts.append(put(box((x - 0.1, 0.05, 0.03), frame), (0, side, height - thick - 0.03)))
    if rng.random() < 0.6:
        parts.append(
            put(box((0.018, y - 0.12, 0.35), top), (-x / 2 + 0.1, 0, height - thick - 0.35))
        )
    if rng.random() < 0.5:
        block = drawers(rng, (x - 0.1, 0.4, height - thick - 0.06), top, int(rng.integers(2, 4)))
        parts.append(put(block, (0, rng.choice([-1, 1]) * (y / 2 - 0.28), 0.04)))
    return Thing("desk", join(parts))


def drawers(rng: Generator, size: tuple[float, float, float], stuff: Material, rows: int) -> Mesh:
    """A carcass with drawers over its whole front."""
    x, y, z = size
    grip = finishes.metal(rng)
    parts = [box(size, stuff, 0.002)]
    each = z / rows
    bar = rng.random() < 0.5
    for k in range(rows):
        front = box((0.018, y - 0.012, each - 0.012), stuff, 0.0015)
        parts.append(put(front, (x / 2 + 0.009, 0, k * each + 0.006)))
        middle = (k + 0.55) * each
        if bar:
            wide, out = min(0.08, 0.3 * y), x / 2 + 0.018
            ends = [(out - 0.005, s * wide, middle) for s in (-1, 1)]
            parts.append(tube(staple(ends[0], ends[1], (0.033, 0, 0), 0.01), 0.005, grip, 6))
        else:
            knob = put(
                cylinder(0.013, 0.025, grip, 0.004, 12), (x / 2 + 0.016, 0, middle), pitch=np.pi / 2
            )
            parts.append(knob)
    return join(parts)

# SPDX-License-Identifier: Apache-2.0
"""Bags, with the loop that a hand takes: `handle`, y along it, the palm on z's side."""

from __future__ import annotations

from numpy.random import Generator

from synthesis.mesh import join
from synthesis.objects import finishes
from synthesis.objects.bars import bent, place, put, staple, tube
from synthesis.objects.shapes import box as block
from synthesis.objects.thing import Thing


def bag(rng: Generator) -> Thing:
    """A backpack, a hand bag or a shopping bag, with the loop that a hand takes."""
    kind = rng.choice(["backpack", "shopper", "handbag"], p=[0.45, 0.3, 0.25])
    if kind == "backpack":
        return _backpack(rng)
    shop = kind == "shopper"
    stuff = (
        (finishes.paper(rng) if rng.random() < 0.4 else finishes.cloth(rng))
        if shop
        else finishes.leather(rng)
    )
    x, y = rng.uniform(0.1, 0.16), rng.uniform(0.28, 0.4)
    z = rng.uniform(0.3, 0.42) if shop else rng.uniform(0.2, 0.28)
    parts = [block((x, y, z), stuff, 0.01, 0.02, taper=rng.uniform(0.85, 1.15))]
    top, loop = z + rng.uniform(0.1, 0.18), 0.25 * y
    for side in (-1, 1):
        arch = [
            [side * 0.3 * x, -loop, z - 0.03],
            [0.006 * side, -0.7 * loop, top],
            [0.006 * side, 0.7 * loop, top],
            [side * 0.3 * x, loop, z - 0.03],
        ]
        parts.append(tube(bent(arch, 0.06, 6), 0.006 if shop else 0.009, stuff))
    return Thing("bag", join(parts), {"handle": place((0, 0, top), (0, 1, 0), (0, 0, 1))})


def _backpack(rng: Generator) -> Thing:
    stuff, trim = finishes.cloth(rng), finishes.dark_plastic(rng)
    x, y, z = rng.uniform(0.13, 0.2), rng.uniform(0.27, 0.34), rng.uniform(0.4, 0.52)
    parts = [block((x, y, z), stuff, 0.06, 0.06)]
    parts.append(put(block((0.07, 0.8 * y, 0.42 * z), stuff, 0.03, 0.03), (x / 2 - 0.005, 0, 0.06)))
    parts.append(put(block((0.04, 0.6 * y, 0.2 * z), stuff, 0.018), (x / 2 - 0.005, 0, 0.62 * z)))
    for side in (-1, 1):
        strap = [
            [-0.35 * x, side * 0.18 * y, 0.93 * z],
            [-x / 2 - 0.09, side * 0.25 * y, 0.8 * z],
            [-x / 2 - 0.06, side * 0.38 * y, 0.3 * z],
            [-0.4 * x, side * 0.4 * y, 0.1 * z],
        ]
        parts.append(tube(bent(strap, 0.12, 5), 0.03, trim, 8, 0.25))
    ends = [(-0.3 * x, s * 0.05, z - 0.03) for s in (-1, 1)]
    parts.append(tube(staple(ends[0], ends[1], (0, 0, 0.075), 0.03), 0.008, trim))
    return Thing(
        "bag", join(parts), {"handle": place((-0.3 * x, 0, z + 0.045), (0, 1, 0), (0, 0, 1))}
    )

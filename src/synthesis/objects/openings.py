# SPDX-License-Identifier: Apache-2.0
"""What closes an opening in a wall: doors and curtains."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import join
from synthesis.objects import finishes
from synthesis.objects.bars import bent, put, sheet, tube
from synthesis.objects.shapes import box
from synthesis.objects.thing import Thing


def door(rng: Generator) -> Thing:
    """A door in its frame, shut or ajar; it opens forward."""
    wide, high = rng.uniform(0.76, 0.95), rng.uniform(1.98, 2.1)
    frame = finishes.paint(rng) if rng.random() < 0.6 else finishes.wood(rng)
    leaf = frame if rng.random() < 0.6 else finishes.board(rng)
    jamb, deep = rng.uniform(0.05, 0.09), 0.04
    parts = [
        put(box((deep, jamb, high + jamb), frame, 0.003), (0, s * (wide + jamb) / 2, 0))
        for s in (-1, 1)
    ]
    parts.append(put(box((deep, wide + 2 * jamb, jamb), frame, 0.003), (0, 0, high)))
    hung = [put(box((0.04, wide - 0.006, high - 0.01), leaf, 0.002), (0, wide / 2, 0.008))]
    for low, up in ((0.08, 0.45), (0.52, 0.93)) if rng.random() < 0.5 else ():
        for s in (-1, 1):
            panel = box((0.012, 0.72 * wide, (up - low) * high), leaf, 0.005)
            hung.append(put(panel, (s * 0.018, wide / 2, low * high)))
    steel = finishes.metal(rng)
    for s in (-1, 1):
        lever = [
            [s * 0.015, wide - 0.06, 1.03],
            [s * 0.06, wide - 0.06, 1.03],
            [s * 0.06, wide - 0.18, 1.03],
        ]
        hung.append(tube(bent(lever, 0.015), 0.009, steel))
    open_ = rng.uniform(0.2, 1.4) if rng.random() < 0.35 else 0.0
    parts.append(put(join(hung), (0, -wide / 2, 0), -open_))
    return Thing("door", join(parts))


def curtain(rng: Generator) -> Thing:
    """A hanging curtain in folds, with its rod."""
    wide, high = rng.uniform(0.4, 1.4), rng.uniform(1.9, 2.4)
    s, z = np.linspace(0, 1, 60), np.linspace(0.01, high, 6)
    folds, phase = rng.uniform(5, 9) * wide, rng.uniform(0, 6)
    amplitude = rng.uniform(0.025, 0.045)
    rows = []
    for level in z:
        wave = np.sin(2 * np.pi * folds * s + phase + 0.5 * np.sin(7 * s))
        spread = 1 + 0.06 * (1 - level / high) * np.sin(3 * s)
        x = amplitude * (1 - 0.35 * level / high) * wave
        rows.append(np.column_stack([x, wide * (0.5 - s) * spread, np.full(60, level)]))
    stuff = finishes.cloth(rng)
    rod = tube(
        [[0, -wide / 2 - 0.1, high], [0, wide / 2 + 0.1, high]], 0.011, finishes.metal(rng), 10
    )
    return Thing("curtain", join([sheet(np.array(rows)[:, ::-1], 0.002, stuff), rod]))

# SPDX-License-Identifier: Apache-2.0
"""Padded seats: the desk chair and the sofa."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Material, join
from synthesis.objects import finishes
from synthesis.objects.bars import bent, pose, put, sheet, tube
from synthesis.objects.shapes import box, cylinder
from synthesis.objects.thing import Thing
from synthesis.objects.turned import cushion


def desk_chair(rng: Generator) -> Thing:
    """Five castors, a gas column, a padded seat, a curved back, at times arms and a headrest."""
    dark = finishes.dark_plastic(rng)
    base = finishes.metal(rng) if rng.random() < 0.5 else dark
    cover = finishes.upholstery(rng)
    width, depth = rng.uniform(0.46, 0.53), rng.uniform(0.44, 0.5)
    seat, pad = rng.uniform(0.45, 0.52), rng.uniform(0.05, 0.09)
    reach, parts = rng.uniform(0.27, 0.33), []
    for turn in np.arange(5) * 2 * np.pi / 5 + rng.uniform(0, 1.2):
        way = np.array([np.cos(turn), np.sin(turn), 0.0])
        spoke = [[0, 0, 0.115], 0.5 * reach * way + [0, 0, 0.1], reach * way + [0, 0, 0.075]]
        parts.append(tube(np.array(spoke), [0.028, 0.022, 0.015], base, 6))
        castor = put(cylinder(0.027, 0.04, dark, 0.006, 14), (0, 0, -0.02))
        parts.append(
            put(castor, reach * way + [0, 0, 0.027], turn + rng.uniform(0, 3), 0, np.pi / 2)
        )
    parts.append(put(cylinder(0.03, 0.14, dark, 0.004), (0, 0, 0.08)))
    parts.append(put(cylinder(0.016, seat - pad - 0.2, base), (0, 0, 0.2)))
    parts.append(put(box((0.25, 0.2, 0.035), dark, 0.01), (-0.02, 0, seat - pad - 0.03)))
    parts.append(put(cushion((depth, width, pad), cover, 0.3), (0, 0, seat - pad)))
    high, low = rng.uniform(0.45, 0.68), rng.uniform(0.06, 0.14)
    bulge, lean = rng.uniform(0.03, 0.07), rng.uniform(0.08, 0.16)
    x, rows = -depth / 2 + 0.01, []
    for t in np.linspace(0, 1, 10):
        half = 0.5 * width * (0.78 + 0.2 * np.sin(np.pi * t**0.7)) * min(1, 0.75 + 2.5 * (1 - t))
        s = np.linspace(-1, 1, 9)
        curve = x + bulge * s**2 - lean * t**1.5 + 0.03 * np.sin(np.pi * t)
        rows.append(np.column_stack([curve, half * s, np.full(9, seat + low + high * t)]))
    parts.append(sheet(np.array(rows), rng.uniform(0.015, 0.06), cover))
    spine = [[-0.05, 0, seat - pad - 0.02], [x - 0.05, 0, seat - pad - 0.02],
             [x - 0.05 - 0.3 * lean, 0, seat + low + 0.5 * high]]  # fmt: skip
    parts.append(tube(bent(spine, 0.1), 0.025, dark, 8, 0.5))
    if rng.random() < 0.25:
        rest = cushion((0.07, 0.27, 0.14), cover, 0.5)
        parts.append(put(rest, (x - lean - 0.01, 0, seat + low + high + 0.02)))
        neck = [[x - lean, 0, seat + low + high - 0.1], [x - lean, 0, seat + low + high + 0.1]]
        parts.append(tube(neck, 0.012, dark))
    if rng.random() < 0.75:
        arm, y = seat + rng.uniform(0.17, 0.24), width / 2 + 0.03
        for side in (-y, y):
            post = [[-0.02, 0.6 * side, seat - pad - 0.01], [-0.02, side, seat - pad - 0.01],
                    [-0.02, side, arm]]  # fmt: skip
            parts.append(tube(bent(post, 0.06), 0.018, dark))
            parts.append(put(box((0.25, 0.08, 0.03), dark, 0.012, 0.03), (0.0, side, arm - 0.01)))
    return Thing("desk_chair", join(parts), {"seat": pose((0, 0, seat - 0.005))})


def sofa(rng: Generator, cover: Material | None = None) -> Thing:
    """An armchair or a sofa of up to three seats, with loose cushions; of drawn stuff if None."""
    cover = finishes.upholstery(rng) if cover is None else cover
    seats = int(rng.choice([1, 2, 3], p=[0.25, 0.4, 0.35]))
    arm, arm_height = rng.uniform(0.1, 0.24), rng.uniform(0.52, 0.66)
    each, depth = rng.uniform(0.55, 0.68), rng.uniform(0.8, 0.98)
    seat, back = rng.uniform(0.4, 0.46), rng.uniform(0.72, 0.95)
    leg, thick = rng.uniform(0.03, 0.14), rng.uniform(0.14, 0.2)
    deep, width = rng.uniform(0.16, 0.24), seats * each
    soft, rim = rng.uniform(0.2, 0.4), rng.uniform(0.03, 0.09)
    base = seat - thick
    parts = [put(box((depth - 0.04, width + arm, base - leg), cover, 0.02), (0, 0, leg))]
    parts.append(
        put(
            box((deep, width + 2 * arm - 0.01, back - leg), cover, rim),
            (-depth / 2 + deep / 2, 0, leg),
        )
    )
    for side in (-1, 1):
        block = box((depth, arm, arm_height - leg), cover, min(rim, 0.45 * arm))
        parts.append(put(block, (0, side * (width + arm) / 2, leg)))
    puff = rng.uniform(0.12, 0.18)
    for y in (np.arange(seats) - (seats - 1) / 2) * each:
        pad = cushion((depth - deep + 0.02, each - 0.004, thick + 0.03), cover, soft)
        parts.append(put(pad, (deep / 2, y, base - 0.015)))
        pillow = cushion((puff, each - 0.01, back - seat + 0.04), cover, soft + 0.1)
        parts.append(put(pillow, (-depth / 2 + deep + 0.03, y, seat - 0.03), 0, -0.12))
    feet = finishes.wood(rng) if rng.random() < 0.6 else finishes.metal(rng)
    for x in (-depth / 2 + 0.08, depth / 2 - 0.08):
        for y in (-width / 2, width / 2):
            parts.append(
                put(cylinder(rng.uniform(0.018, 0.03), leg + 0.005, feet, 0, 10), (x, y, 0))
            )
    for _ in range(rng.integers(0, 3) if seats > 1 else 0):
        size = rng.uniform(0.36, 0.48)
        loose = cushion((0.13, size, size), finishes.cloth(rng), 0.7)
        y = rng.choice([-1, 1]) * (width / 2 - 0.22) + rng.normal(0, 0.03)
        parts.append(
            put(loose, (-depth / 2 + deep + puff + 0.06, y, seat), rng.normal(0, 0.2), -0.3)
        )
    middle = (deep / 2 + puff / 2, 0.0, seat + 0.01)
    return Thing("sofa", join(parts), {"seat": pose(middle)})

# SPDX-License-Identifier: Apache-2.0
"""Screens that stand on a table."""

from __future__ import annotations

from numpy.random import Generator

from synthesis.mesh import join
from synthesis.objects import finishes
from synthesis.objects.bars import put
from synthesis.objects.shapes import box
from synthesis.objects.thing import Thing


def monitor(rng: Generator) -> Thing:
    """A screen on its foot."""
    wide = rng.uniform(0.48, 0.72)
    high, plastic = wide * rng.uniform(0.55, 0.64), finishes.dark_plastic(rng)
    low = rng.uniform(0.08, 0.16)
    parts = [box((0.19, 0.25, 0.012), plastic, 0.003, 0.02)]
    parts.append(put(box((0.025, 0.05, low + 0.5 * high), plastic, 0.004), (-0.05, 0, 0.006)))
    tilt = rng.uniform(-0.02, 0.12)
    case = join(
        [put(box((0.03, wide, high), plastic, 0.004), (-0.015, 0, 0)),
         put(box((0.001, wide - 0.02, high - 0.025), finishes.glass(rng)), (0.0006, 0, 0.015))]
    )  # fmt: skip
    parts.append(put(case, (0.02, 0, low), 0, -tilt))
    return Thing("monitor", join(parts))


def laptop(rng: Generator) -> Thing:
    """An open portable computer."""
    wide = rng.uniform(0.29, 0.37)
    deep, case, dark = (
        wide * rng.uniform(0.65, 0.72),
        finishes.metal(rng),
        finishes.dark_plastic(rng),
    )
    parts = [box((deep, wide, 0.014), case, 0.003, 0.01)]
    parts.append(put(box((0.42 * deep, 0.88 * wide, 0.002), dark), (-0.12 * deep, 0, 0.0135)))
    parts.append(put(box((0.28 * deep, 0.32 * wide, 0.0006), dark), (0.29 * deep, 0, 0.014)))
    lid = join(
        [put(box((0.007, wide, deep), case, 0.002), (-0.0035, 0, 0)),
         put(box((0.0006, wide - 0.014, deep - 0.02), finishes.glass(rng)), (0.0002, 0, 0.012))]
    )  # fmt: skip
    parts.append(put(lid, (-deep / 2 + 0.005, 0, 0.012), 0, -rng.uniform(0.05, 0.5)))
    return Thing("laptop", join(parts))

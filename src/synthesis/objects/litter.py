# SPDX-License-Identifier: Apache-2.0
"""What lies flat on a floor."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Mesh
from synthesis.objects import finishes
from synthesis.objects.bars import bent, put, tube
from synthesis.objects.plan import Plan
from synthesis.objects.shapes import box, cylinder


def floor_clutter(rng: Generator, plan: Plan, clutter: float) -> list[Mesh]:
    """A rug, cables and flat odds and ends, which may lie anywhere."""
    parts = []
    size = plan.high - plan.low
    if rng.random() < 0.4:
        stuff = finishes.cloth(rng)
        if rng.random() < 0.3:
            rug = cylinder(rng.uniform(0.5, 1.0), 0.012, stuff, 0, 40)
        else:
            rug = box((rng.uniform(1.0, 1.8), rng.uniform(1.4, 2.6), 0.01), stuff)
        middle = plan.keep_clear.mean(axis=0) + rng.normal(0, 0.7, 2)
        parts.append(put(rug, (*middle, 0), rng.choice([0, np.pi / 2]) + rng.normal(0, 0.1)))
    for _ in range(rng.binomial(3, 0.6 * clutter)):
        points = plan.low + size * rng.uniform(0.05, 0.95, 2)
        steps = np.cumsum(rng.normal(0, 0.35, (6, 2)), axis=0) + points
        path = np.column_stack([np.clip(steps, plan.low, plan.high), np.full(6, 0.006)])
        parts.append(tube(bent(path, 0.2), 0.004, finishes.dark_plastic(rng), 5))
    for _ in range(rng.binomial(6, 0.5 * clutter)):
        at = rng.uniform(plan.low, plan.high)
        sheet = box((0.21, 0.3, rng.uniform(0.001, 0.02)), finishes.paper(rng))
        parts.append(put(sheet, (*at, 0), rng.uniform(-np.pi, np.pi)))
    return parts

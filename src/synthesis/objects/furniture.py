# SPDX-License-Identifier: Apache-2.0
"""Cupboards and shelves; tables come from their own file."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Mesh, join
from synthesis.objects import finishes
from synthesis.objects.bars import put, staple, tube
from synthesis.objects.shapes import box, ellipse, prism
from synthesis.objects.tables import desk, drawers, table
from synthesis.objects.thing import Thing

__all__ = ["bedside_table", "books", "cabinet", "desk", "shelf", "table"]


def bedside_table(rng: Generator) -> Thing:
    """A small chest with one to three drawers, or a drawer over an open shelf."""
    x, y, height = rng.uniform(0.33, 0.45), rng.uniform(0.36, 0.55), rng.uniform(0.45, 0.65)
    stuff, foot = finishes.board(rng), rng.uniform(0.0, 0.16)
    body = height - foot - 0.02
    parts = [put(box((x + 0.03, y + 0.03, 0.022), stuff, 0.004), (0, 0, height - 0.022))]
    if rng.random() < 0.35:
        drawer = rng.uniform(0.12, 0.18)
        parts.append(put(drawers(rng, (x, y, drawer), stuff, 1), (0, 0, height - 0.02 - drawer)))
        for s in (-1, 1):
            parts.append(put(box((x, 0.018, body), stuff), (0, s * (y / 2 - 0.009), foot)))
        parts.append(put(box((x, y - 0.03, 0.018), stuff), (0, 0, foot)))
        parts.append(put(box((0.012, y - 0.03, body), stuff), (-x / 2 + 0.006, 0, foot)))
    else:
        parts.append(put(drawers(rng, (x, y, body), stuff, int(rng.integers(1, 4))), (0, 0, foot)))
    if foot > 0.03:
        frame = finishes.metal(rng) if rng.random() < 0.3 else stuff
        for sx in (-1, 1):
            for sy in (-1, 1):
                at = np.array([sx * (x / 2 - 0.03), sy * (y / 2 - 0.03), 0.0])
                parts.append(tube([at * 1.05, at + [0, 0, foot + 0.005]], [0.011, 0.017], frame))
    elif foot > 0:
        parts.append(box((x - 0.03, y - 0.02, foot + 0.001), stuff))
    if rng.random() < 0.3:
        parts.append(
            put(
                books(rng, 0.25, lying=True),
                (0, rng.uniform(-0.2, 0.2) * y, height),
                rng.uniform(-1, 1),
            )
        )
    return Thing("bedside_table", join(parts))


def books(rng: Generator, length: float, lying: bool = False) -> Mesh:
    """Books along y from -length/2, their backs forward; or a few lying on each other."""
    parts, y = [], -length / 2
    height = rng.uniform(0.18, 0.26)
    if lying:
        z = 0.0
        for _ in range(rng.integers(1, 4)):
            thick = rng.uniform(0.015, 0.04)
            book = box(
                (rng.uniform(0.13, 0.16), rng.uniform(0.19, 0.23), thick), finishes.cover(rng)
            )
            parts.append(put(book, (0, 0, z), rng.normal(0, 0.2)))
            z += thick
        return join(parts)
    while y < length / 2 - 0.05:
        thick = rng.uniform(0.015, 0.055)
        size = (height * rng.uniform(0.6, 0.8), thick, height * rng.uniform(0.85, 1.1))
        parts.append(put(box(size, finishes.cover(rng)), (-size[0] / 2, y + thick / 2, 0)))
        y += thick + (rng.uniform(0.05, 0.2) if rng.random() < 0.08 else 0.001)
    return join(parts)


def shelf(rng: Generator) -> Thing:
    """A bookcase, filled or nearly empty."""
    x, y, z = rng.uniform(0.25, 0.36), rng.uniform(0.5, 1.1), rng.uniform(0.8, 2.1)
    stuff, side = finishes.board(rng), rng.uniform(0.016, 0.028)
    rows = max(2, round(z / rng.uniform(0.3, 0.42)))
    parts = [put(box((x, side, z), stuff, 0.001), (0, s * (y - side) / 2, 0)) for s in (-1, 1)]
    if rng.random() < 0.7:
        parts.append(put(box((0.006, y - side, z - 0.04), stuff), (-x / 2 + 0.01, 0, 0.03)))
    full, each = rng.uniform(0.2, 0.95), (z - 0.06 - side) / rows
    for k in range(rows + 1):
        level = 0.06 + k * each
        parts.append(put(box((x - 0.01, y - 2 * side, side), stuff), (0, 0, level)))
        if k < rows and rng.random() < full and each > 0.27:
            length = (y - 2 * side) * rng.uniform(0.4, 0.96)
            slack = (y - 2 * side - length) / 2
            parts.append(
                put(books(rng, length), (x / 2 - 0.03, rng.choice([-1, 1]) * slack, level + side))
            )
        elif k < rows and rng.random() < full:
            size = (x - 0.06, rng.uniform(0.15, 0.35), 0.7 * each)
            parts.append(
                put(
                    box(size, finishes.cardboard(rng), 0.003),
                    (0, rng.uniform(-0.1, 0.1), level + side),
                )
            )
    return Thing("shelf", join(parts))


def cabinet(rng: Generator) -> Thing:
    """A cupboard with doors or a chest of drawers, waist-high or up to the ceiling."""
    tall = rng.random() < 0.4
    z = rng.uniform(1.7, 2.15) if tall else rng.uniform(0.7, 1.1)
    x, y = rng.uniform(0.38, 0.6), rng.uniform(0.5, 1.4)
    stuff, plinth = finishes.board(rng), rng.uniform(0.04, 0.1)
    parts = [box((x - 0.05, y - 0.02, plinth), stuff)]
    if not tall and rng.random() < 0.45:
        parts.append(
            put(drawers(rng, (x, y, z - plinth), stuff, int(rng.integers(3, 6))), (0, 0, plinth))
        )
        return Thing("cabinet", join(parts))
    parts.append(put(box((x, y, z - plinth), stuff, 0.002), (0, 0, plinth)))
    doors, grip = max(1, round(y / 0.5)), finishes.metal(rng)
    leaf = finishes.paint(rng) if rng.random() < 0.3 else stuff
    each = y / doors
    for k in range(doors):
        middle = -y / 2 + (k + 0.5) * each
        door = box((0.02, each - 0.006, z - plinth - 0.01), leaf, 0.002)
        parts.append(put(door, (x / 2 + 0.01, middle, plinth + 0.005)))
        inner = prism(ellipse(1, sides=4) @ np.array([[0.7, 0.7], [-0.7, 0.7]]), 0.006, leaf)
        scale = np.diag([0.35 * each, 0.42 * (z - plinth), 1.0, 1.0])
        panel = put(inner.moved(scale), yaw=np.pi / 2, roll=np.pi / 2)
        parts.append(put(panel, (x / 2 + 0.019, middle, (z + plinth) / 2)))
        y_grip = middle + (each / 2 - 0.04) * (1 if k % 2 == 0 else -1)
        z_grip = 1.0 if tall else 0.72 * z
        ends = [(x / 2 + 0.015, y_grip, z_grip + s) for s in (-0.07, 0.07)]
        parts.append(tube(staple(ends[0], ends[1], (0.03, 0, 0), 0.01), 0.005, grip, 6))
    return Thing("cabinet", join(parts))

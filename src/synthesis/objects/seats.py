# SPDX-License-Identifier: Apache-2.0
"""Things to sit on. Each has a `seat`: middle of the upper surface, x forward, z up."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Material, Mesh, join
from synthesis.objects import finishes
from synthesis.objects.bars import bent, pose, put, sheet, tube
from synthesis.objects.padded import desk_chair, sofa
from synthesis.objects.shapes import box, cylinder
from synthesis.objects.thing import Thing
from synthesis.objects.turned import cushion

__all__ = ["bench", "chair", "desk_chair", "sofa", "stool"]


def stool(rng: Generator) -> Thing:
    """Three or four splayed legs, a round or square top, perhaps padded."""
    height, radius = rng.uniform(0.42, 0.52), rng.uniform(0.15, 0.2)
    frame = finishes.metal(rng) if rng.random() < 0.35 else finishes.board(rng)
    top = finishes.upholstery(rng) if rng.random() < 0.4 else finishes.board(rng)
    thick = rng.uniform(0.022, 0.04)
    round_ = rng.random() < 0.6
    splay, legs = rng.uniform(1.0, 1.3), 4 if not round_ else int(rng.integers(3, 5))
    bar = rng.uniform(0.011, 0.02)
    corner = radius * (0.8 if round_ else 1.1)
    turns = np.arange(legs) * 2 * np.pi / legs + np.pi / 4
    feet = np.column_stack([np.cos(turns), np.sin(turns)]) * corner
    parts = [
        tube([[*(splay * f), 0.0], [*f, height - thick]], [bar * 0.8, bar], frame) for f in feet
    ]
    if rng.random() < 0.7:
        level = rng.uniform(0.25, 0.5)
        ring = feet * (splay + (1 - splay) * level)
        for k in range(legs):
            ends = [[*ring[k], level * height], [*ring[(k + 1) % legs], level * height]]
            parts.append(tube(ends, bar * 0.7, frame, sides=6))
    if round_:
        parts.append(put(cylinder(radius, thick, top, 0.3 * thick, 28), (0, 0, height - thick)))
    else:
        size = (1.9 * radius, 1.9 * radius * rng.uniform(1.0, 1.3), thick)
        parts.append(put(box(size, top, 0.3 * thick, 0.02), (0, 0, height - thick)))
    if rng.random() < 0.25:
        pad = (1.8 * radius, 1.8 * radius, rng.uniform(0.03, 0.06))
        parts.append(put(cushion(pad, finishes.cloth(rng), 0.4), (0, 0, height - 0.004)))
        height += pad[2] - 0.004
    return Thing("stool", join(parts), {"seat": pose((0, 0, height))})


def chair(rng: Generator) -> Thing:
    """A dining or visitor's chair: four legs, a back of slats or one plate, at times arms."""
    width, depth = rng.uniform(0.39, 0.47), rng.uniform(0.39, 0.46)
    seat, back = rng.uniform(0.43, 0.475), rng.uniform(0.8, 1.0)
    metal = rng.random() < 0.35
    frame = finishes.metal(rng) if metal else finishes.board(rng)
    cover = finishes.upholstery(rng) if rng.random() < 0.45 else finishes.board(rng)
    bar = rng.uniform(0.01, 0.013) if metal else rng.uniform(0.015, 0.022)
    x, y, lean = depth / 2 - bar, width / 2 - bar, rng.uniform(0.04, 0.11)
    thick = rng.uniform(0.02, 0.05)
    parts = [put(box((depth, width, thick), cover, 0.4 * thick, 0.03), (0, 0, seat - thick))]
    for side in (-y, y):
        post = [[-x - 0.03, side, 0], [-x, side, seat * 0.9], [-x - lean, side, back]]
        parts.append(tube(bent(post, 0.15), bar, frame))
        parts.append(tube([[x, side, 0], [x, side, seat - thick]], [0.8 * bar, bar], frame))
        parts.append(tube([[-x, side, seat - 0.05], [x, side, seat - 0.05]], 0.8 * bar, frame, 6))
    if rng.random() < 0.5:
        for end in (-x - 0.015, x):
            rung = [[end, -y, 0.45 * seat], [end, y, 0.45 * seat]]
            parts.append(tube(rung, 0.6 * bar, frame, 6))
    parts += _back(rng, cover, frame, (x, y, lean, seat, back))
    if rng.random() < 0.25:
        arm = seat + rng.uniform(0.19, 0.25)
        for side in (-y, y):
            rail = [[-x - 0.4 * lean, side, arm], [x, side, arm], [x, side, seat - 0.05]]
            parts.append(tube(bent(rail, 0.06), bar, frame))
    return Thing("chair", join(parts), {"seat": pose((0, 0, seat))})


def _back(rng: Generator, cover: Material, frame: Material, sizes: tuple[float, ...]) -> list[Mesh]:
    x, y, lean, seat, back = sizes

    def across(z: float, bulge: float) -> list[list[float]]:
        reach = -x - lean * (z - seat) / (back - seat)
        return [[reach - bulge * (1 - s * s), s * y, z] for s in np.linspace(-1, 1, 7)]

    bulge = rng.uniform(0.0, 0.05)
    kind = rng.choice(["plate", "ladder", "slats"], p=[0.5, 0.25, 0.25])
    if kind == "plate":
        low = seat + rng.uniform(0.08, 0.22)
        rows = np.array([across(z, bulge) for z in np.linspace(low, back, 6)])
        return [sheet(rows, rng.uniform(0.01, 0.04), cover)]
    if kind == "ladder":
        levels = seat + (back - seat - 0.05) * np.linspace(0.35, 1.0, int(rng.integers(2, 5)))
        return [
            sheet(np.array([across(z, bulge), across(z + 0.05, bulge)]), 0.014, frame)
            for z in levels
        ]
    top, foot = np.array(across(back, bulge)), np.array(across(seat + 0.02, 0.0))
    rail = sheet(np.array([across(back - 0.06, bulge), top]), 0.018, frame)
    return [rail, *(tube([foot[k], top[k] - [0, 0, 0.03]], 0.008, frame, 6) for k in range(1, 6))]


def bench(rng: Generator) -> Thing:
    """A bench of slats or one board, padded at times, with or without a back."""
    length, depth, seat = rng.uniform(0.9, 1.7), rng.uniform(0.3, 0.45), rng.uniform(0.42, 0.48)
    top = finishes.wood(rng) if rng.random() < 0.7 else finishes.paint(rng)
    frame = finishes.metal(rng) if rng.random() < 0.4 else top
    slats, thick = int(rng.choice([1, 3, 4, 5])), rng.uniform(0.022, 0.05)
    gap = 0.012 if slats > 1 else 0.0
    board = (depth + gap) / slats - gap
    parts = []
    for k in range(slats):
        x = -depth / 2 + board / 2 + k * (board + gap)
        parts.append(put(box((board, length, thick), top, 0.004), (x, 0, seat - thick)))
    bar, inset = rng.uniform(0.035, 0.06), rng.uniform(0.05, 0.2)
    for y in (-length / 2 + inset, length / 2 - inset):
        for x in (-depth / 2 + bar / 2, depth / 2 - bar / 2):
            parts.append(put(box((bar, bar, seat - thick), frame, 0.003), (x, y, 0)))
        parts.append(put(box((depth - bar, 0.7 * bar, bar), frame), (0, y, seat - thick - bar)))
    if rng.random() < 0.4:
        high, lean = rng.uniform(0.33, 0.45), 0.2
        for y in (-length / 2 + inset, length / 2 - inset):
            post = box((bar * 0.8, bar, high), frame, 0.003)
            parts.append(put(post, (-depth / 2 + 0.02, y, seat - thick), 0, -lean))
        for z in (0.45 * high, 0.8 * high):
            plank = box((0.02, length, rng.uniform(0.07, 0.1)), top, 0.004)
            parts.append(put(plank, (-depth / 2 + 0.03 - lean * z, 0, seat - thick + z), 0, -lean))
    elif rng.random() < 0.35:
        pad = rng.uniform(0.04, 0.07)
        cover = cushion((depth, length - 0.02, pad), finishes.upholstery(rng), 0.25)
        parts.append(put(cover, (0, 0, seat - 0.005)))
        seat += pad - 0.005
    return Thing("bench", join(parts), {"seat": pose((0, 0, seat))})

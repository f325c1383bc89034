# SPDX-License-Identifier: Apache-2.0
"""Lamps, plants, screens and what else stands about."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from synthesis.mesh import join
from synthesis.objects import finishes
from synthesis.objects.bars import bent, place, put, sheet, tube
from synthesis.objects.shapes import box, cylinder
from synthesis.objects.thing import Thing
from synthesis.objects.turned import cushion as stuffed
from synthesis.objects.turned import lathe, sphere


def lamp(rng: Generator) -> Thing:
    """A floor lamp: a plate or three legs, a pole straight or arched, a shade."""
    height, pole = rng.uniform(1.35, 1.8), rng.uniform(0.009, 0.016)
    frame = finishes.metal(rng) if rng.random() < 0.7 else finishes.wood(rng)
    shade = finishes.cloth(rng) if rng.random() < 0.7 else finishes.paper(rng)
    r, tall = rng.uniform(0.13, 0.25), rng.uniform(0.18, 0.36)
    top = r * rng.uniform(0.5, 1.0)
    if rng.random() < 0.3:
        knee = height - 0.5 * tall
        feet = [[0.3 * np.cos(a), 0.3 * np.sin(a), 0] for a in np.arange(3) * 2 * np.pi / 3 + 0.5]
        parts = [tube([foot, [0, 0, 0.8 * knee]], [0.011, 0.014], frame) for foot in feet]
        parts.append(tube([[0, 0, 0.78 * knee], [0, 0, knee]], pole, frame))
        reach = 0.0
    else:
        reach = rng.uniform(0.15, 0.35) if rng.random() < 0.3 else 0.0
        parts = [cylinder(rng.uniform(0.12, 0.17), rng.uniform(0.015, 0.035), frame, 0.006, 32)]
        path = [
            [0, 0, 0.01],
            [0, 0, height - 0.1],
            [reach, 0, height - 0.1],
            [reach, 0, height - 0.4 * tall],
        ]
        parts.append(tube(bent(path, 0.25, 8) if reach else path[:2], pole, frame, 10))
    low, wall = height - tall, 0.002
    profile = [(r, low), (top, height), (top - wall, height), (r - wall, low), (r, low)]
    ring = np.array(profile)
    open_shade = _hoop(ring, shade)
    parts.append(put(open_shade, (reach, 0, 0)))
    for turn in (0.0, np.pi / 2):
        spoke = tube([[-top, 0, height - 0.03], [top, 0, height - 0.03]], 0.002, frame, 4)
        parts.append(put(spoke, (reach, 0, 0), turn))
    bulb = finishes.paper(rng)
    parts.append(
        put(stuffed((0.06, 0.06, 0.09), bulb, 1.0, 12, 7), (reach, 0, height - 0.55 * tall))
    )
    parts.append(
        tube([[reach, 0, height - 0.6 * tall], [reach, 0, height - 0.02]], 0.006, frame, 6)
    )
    return Thing("lamp", join(parts))


def _hoop(profile: np.ndarray, stuff, sides: int = 32):
    """A closed profile turned about z: a ring without ends."""
    t = np.linspace(0, 2 * np.pi, sides + 1)
    turn = np.stack([np.cos(t), np.sin(t)], 1)
    loops = np.stack([np.column_stack([r * turn, np.full(sides + 1, z)]) for r, z in profile])
    return sheet(loops, 1e-5, stuff)


def plant(rng: Generator) -> Thing:
    """A pot with broad, bending leaves or a stem with a crown of them."""
    r, high = rng.uniform(0.1, 0.2), rng.uniform(0.16, 0.36)
    pot, earth, leaf = finishes.ceramic(rng), finishes.wood(rng), finishes.leaves(rng)
    profile = [
        (0, 0),
        (0.7 * r, 0),
        (r, high),
        (r - 0.012, high),
        (r - 0.02, high - 0.03),
        (0, high - 0.03),
    ]
    parts = [lathe(profile, pot)]
    parts.append(put(cylinder(r - 0.018, 0.01, earth, 0, 16), (0, 0, high - 0.035)))
    stem = rng.uniform(0.3, 0.9) if rng.random() < 0.5 else 0.0
    if stem:
        path = [
            [0, 0, high - 0.05],
            [rng.normal(0, 0.04), rng.normal(0, 0.04), high + 0.5 * stem],
            [0, 0, high + stem],
        ]
        parts.append(tube(bent(path, 0.3), 0.012, earth, 6))
    for _ in range(rng.integers(14, 34)):
        long, wide = rng.uniform(0.2, 0.55) * (0.7 if stem else 1), rng.uniform(0.03, 0.08)
        base = high - 0.04 + stem * rng.uniform(0.5, 1.0)
        parts.append(put(_leaf(rng, long, wide, leaf), (0, 0, base), rng.uniform(0, 2 * np.pi)))
    return Thing("plant", join(parts))


def _leaf(rng: Generator, long: float, wide: float, stuff):
    s = np.linspace(0, 1, 7)
    rise, droop = rng.uniform(0.5, 1.4), rng.uniform(0.3, 1.8)
    angle = rise - droop * s
    x = np.concatenate([[0], np.cumsum(np.cos(angle[1:]) * long / 6)])
    z = np.concatenate([[0], np.cumsum(np.sin(angle[1:]) * long / 6)])
    half = wide * np.sin(np.pi * np.clip(s, 0.04, 0.985)) ** 0.7
    rows = [np.column_stack([x, w * half, z + 0.3 * abs(w) * half]) for w in (-1, 0, 1)]
    return sheet(np.stack(rows), 0.0012, stuff)


def bin(rng: Generator) -> Thing:  # noqa: A001
    """A waste-paper bin or one with a lid."""
    r, high = rng.uniform(0.11, 0.19), rng.uniform(0.26, 0.62)
    stuff = finishes.plastic(rng) if rng.random() < 0.6 else finishes.metal(rng)
    foot = r * rng.uniform(0.75, 1.0)
    if rng.random() < 0.4:
        lid = [(0, 0), (r + 0.004, 0), (r + 0.004, 0.02), (0.7 * r, 0.05), (0, 0.06)]
        body = [(0, 0), (foot, 0), (r, high), (0, high)]
        return Thing(
            "bin", join([lathe(body, stuff), put(lathe(lid, finishes.plastic(rng)), (0, 0, high))])
        )
    inner, lip = foot - 0.004, high - 0.02
    profile = [(0, 0), (foot, 0), (r, lip), (r + 0.006, lip), (r + 0.006, high), (r - 0.003, high),
               (inner, 0.006), (0, 0.006)]  # fmt: skip
    return Thing("bin", lathe(profile, stuff))


def ball(rng: Generator) -> Thing:
    """A ball to play with or a big one to sit on, with stripes at times."""
    r = rng.uniform(0.09, 0.13) if rng.random() < 0.7 else rng.uniform(0.25, 0.33)
    one, other = finishes.plastic(rng), finishes.plastic(rng)
    if rng.random() < 0.6:
        return Thing("ball", sphere(r, one))
    mesh = sphere(r, one)
    turn = np.arctan2(*mesh.vertices[mesh.faces].mean(axis=1)[:, 1::-1].T)
    stripe = (np.floor(turn / (np.pi / 4)) % 2).astype(np.int64)
    return Thing("ball", replace(mesh, materials=(one, other), face_material=stripe))


def broom(rng: Generator) -> Thing:
    """A broom on its bristles."""
    stick, head = (
        finishes.wood(rng) if rng.random() < 0.5 else finishes.metal(rng),
        finishes.plastic(rng),
    )
    wide, low = rng.uniform(0.26, 0.42), rng.uniform(0.06, 0.09)
    parts = [box((0.055, wide, low), finishes.plastic(rng), 0.0, 0.01, taper=1.15)]
    parts.append(put(box((0.05, wide, 0.03), head, 0.01), (0, 0, low)))
    parts.append(tube([[0, 0, low + 0.02], [0, 0, rng.uniform(1.2, 1.5)]], 0.012, stick))
    return Thing("broom", join(parts))


def pole(rng: Generator) -> Thing:
    """A stick as long as a person, upright."""
    long = rng.uniform(1.2, 2.0)
    stuff = finishes.wood(rng) if rng.random() < 0.6 else finishes.metal(rng)
    stick = cylinder(rng.uniform(0.011, 0.02), long, stuff, 0.003, 12)
    return Thing("pole", stick, {"handle": place((0, 0, 0.5 * long), (0, 0, 1), (-1, 0, 0))})


def cushion(rng: Generator) -> Thing:
    """A loose cushion, upright."""
    size = rng.uniform(0.35, 0.55)
    return Thing("cushion", stuffed((rng.uniform(0.1, 0.17), size, size), finishes.cloth(rng), 0.7))

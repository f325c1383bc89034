# SPDX-License-Identifier: Apache-2.0
"""The guitar, acoustic or electric."""

from __future__ import annotations

import numpy as np
from numpy import ndarray
from numpy.random import Generator
from scipy.interpolate import CubicSpline

from synthesis.mesh import join
from synthesis.objects import finishes
from synthesis.objects.bars import pose, put, tube
from synthesis.objects.shapes import box, cylinder, prism
from synthesis.objects.thing import Thing


def guitar(rng: Generator) -> Thing:
    """A guitar upright on its body, strings forward.

    `neck`: below the fretting hand, two thirds up the neck; `strings`: below the plucking hand;
    both with x out of the face, y left and z towards the head. The body is 0.41-0.51 m long, the
    strings 0.63-0.66 m, as on common instruments.
    """
    electric = rng.random() < 0.3
    wood = finishes.paint(rng) if electric or rng.random() < 0.1 else finishes.wood(rng)
    side = finishes.wood(rng) if rng.random() < 0.5 else wood
    dark, steel = finishes.dark_plastic(rng), finishes.metal(rng)
    body = rng.uniform(0.41, 0.45) if electric else rng.uniform(0.47, 0.51)
    deep = rng.uniform(0.042, 0.05) if electric else rng.uniform(0.085, 0.115)
    lower, waist, upper = rng.uniform(0.175, 0.2), rng.uniform(0.11, 0.13), rng.uniform(0.13, 0.15)
    outline = _outline(body, lower, waist, upper)
    hull = prism(outline, deep, side, 0.012 if electric else 0.003)
    face = prism(outline * 0.995, 0.003, wood)
    upright = pose((0, 0, 0), yaw=np.pi / 2, roll=np.pi / 2)  # outline's x left, y up; height to x
    parts = [hull.moved(upright), put(face.moved(upright), (deep - 0.001, 0, 0))]
    front = deep + 0.002
    strings, bridge = rng.uniform(0.63, 0.66), 0.28 * body
    nut, hole = bridge + strings, 0.64 * body
    if electric:
        for z in (bridge + 0.04, bridge + 0.11, bridge + 0.18):
            parts.append(put(box((0.008, 0.085, 0.03), dark, 0.002), (front, 0, z)))
        plate = prism(_outline(0.3, 0.09, 0.06, 0.05), 0.003, finishes.plastic(rng))
        parts.append(put(plate.moved(upright), (deep, -0.045, bridge - 0.03)))
    else:
        ring = put(
            cylinder(0.058, 0.0012, finishes.wood(rng), 0, 32), (front, 0, hole), pitch=np.pi / 2
        )
        dot = put(cylinder(0.049, 0.0018, dark, 0, 32), (front, 0, hole), pitch=np.pi / 2)
        parts += [ring, dot]
    parts.append(
        put(
            box((0.012, 0.17 if not electric else 0.08, 0.03), side, 0.004),
            (front + 0.005, 0, bridge - 0.015),
        )
    )
    joint = 0.78 * body if not electric else 0.86 * body
    neck = put(box((0.022, 0.05, nut - joint), side, 0.0, 0.009), (front - 0.004, 0, joint))
    board = put(box((0.007, 0.054, nut - joint + 0.0), dark), (front + 0.01, 0, joint))
    parts += [neck, board]
    head = rng.uniform(0.16, 0.19)
    tilt = rng.uniform(0.1, 0.25)
    parts.append(put(box((0.016, 0.072, head), side, 0.002, 0.004), (front, 0, nut), 0, -tilt))
    for k in range(3):
        for y in (-0.042, 0.042):
            z = head * (0.25 + 0.25 * k)
            at = (front - z * np.sin(tilt), y, nut + z * np.cos(tilt))
            parts.append(put(cylinder(0.009, 0.014, steel, 0, 8), at))
    for y in np.linspace(-0.02, 0.02, 6):
        ends = [[front + 0.018, 1.2 * y, bridge], [front + 0.018, y, nut]]
        parts.append(tube(ends, 0.0007, steel, 3))
    mesh = put(join(parts), (-deep / 2, 0, 0))
    hand = nut - 0.3 * (nut - joint)
    return Thing(
        "guitar",
        mesh,
        {
            "neck": pose((front + 0.018 - deep / 2, 0, hand)),
            "strings": pose((front + 0.018 - deep / 2, 0, 0.5 * (bridge + hole))),
        },
    )


def _outline(length: float, lower: float, waist: float, upper: float) -> ndarray:
    """Both bouts and the waist between them; x right, y up from 0, counter-clockwise."""
    heights = np.array([0.0, 0.03, 0.12, 0.27, 0.45, 0.6, 0.78, 0.93, 0.985, 1.0]) * length
    half = [0.0, 0.5 * lower, 0.88 * lower, lower, 0.87 * lower, waist, upper, 0.74 * upper,
            0.42 * upper, 0.0]  # fmt: skip
    t = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(heights), np.diff(half)))])
    s = np.linspace(0, t[-1], 26)
    y, x = CubicSpline(t, heights)(s), np.maximum(CubicSpline(t, half)(s), 0.0)
    right, left = np.column_stack([x, y])[:-1], np.column_stack([-x, y])[:0:-1]
    return np.clip(np.concatenate([right, left]), [-1, 0], [1, length])

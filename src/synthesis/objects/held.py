# SPDX-License-Identifier: Apache-2.0
"""Small things that one hand holds; `handle`: y along the grip, the palm on z's side."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import join
from synthesis.objects import finishes
from synthesis.objects.bars import place, put, staple, tube
from synthesis.objects.shapes import box as block
from synthesis.objects.shapes import cylinder
from synthesis.objects.thing import Thing
from synthesis.objects.turned import lathe


def cup(rng: Generator) -> Thing:
    """A mug; its handle looks backward, so that what is printed on it looks forward."""
    r, h, wall = rng.uniform(0.036, 0.046), rng.uniform(0.08, 0.105), 0.004
    stuff, foot = finishes.ceramic(rng), rng.uniform(0.75, 1.0)
    profile = [
        (0, 0),
        (foot * r, 0),
        (r, 0.3 * h),
        (r, h),
        (r - wall, h),
        (r - wall, 0.3 * h),
        (0.7 * r, wall),
        (0, wall),
    ]
    reach = r + rng.uniform(0.026, 0.034)
    ends = (-r + 0.003, 0, 0.85 * h), (-r + 0.003, 0, 0.22 * h)
    loop = staple(ends[0], ends[1], (r - reach, 0, 0), 0.03, 5)
    parts = [lathe(profile, stuff, 28), tube(loop, 0.005, stuff)]
    return Thing(
        "cup", join(parts), {"handle": place((-reach, 0, 0.52 * h), (0, 0, 1), (-1, 0, 0))}
    )


def phone(rng: Generator) -> Thing:
    """A telephone upright on its edge, the screen forward."""
    wide, high, thick = (
        rng.uniform(0.066, 0.078),
        rng.uniform(0.138, 0.168),
        rng.uniform(0.007, 0.011),
    )
    case = finishes.plastic(rng)
    body = put(
        block((high, wide, thick), case, 0.002, 0.009), (-thick / 2, 0, high / 2), pitch=np.pi / 2
    )
    screen = put(
        block((high - 0.008, wide - 0.006, 0.0006), finishes.glass(rng), 0, 0.007),
        (thick / 2, 0, high / 2),
        pitch=np.pi / 2,
    )
    camera = put(
        block((0.03, 0.03, 0.002), finishes.glass(rng), 0, 0.006),
        (-thick / 2 - 0.002, 0.25 * wide, high - 0.025),
        pitch=np.pi / 2,
    )
    return Thing(
        "phone",
        join([body, screen, camera]),
        {"handle": place((0, 0, 0.45 * high), (0, 0, 1), (-1, 0, 0))},
    )


def bottle(rng: Generator) -> Thing:
    """A drinking bottle with a label."""
    r, h = rng.uniform(0.031, 0.042), rng.uniform(0.2, 0.3)
    stuff = finishes.glass(rng) if rng.random() < 0.35 else finishes.plastic(rng)
    neck = rng.uniform(0.011, 0.02)
    profile = [
        (0, 0),
        (0.9 * r, 0),
        (r, 0.02 * h),
        (r, 0.6 * h),
        (0.92 * r, 0.68 * h),
        (neck, 0.84 * h),
        (neck, 0.93 * h),
        (0, 0.93 * h),
    ]
    cap = put(cylinder(neck + 0.003, 0.08 * h, finishes.plastic(rng), 0.002, 16), (0, 0, 0.92 * h))
    label = put(
        lathe([(0, 0), (r + 0.0008, 0), (r + 0.0008, 0.3 * h), (0, 0.3 * h)], finishes.cover(rng)),
        (0, 0, 0.2 * h),
    )
    return Thing(
        "bottle",
        join([lathe(profile, stuff), label, cap]),
        {"handle": place((0, 0, 0.45 * h), (0, 0, 1), (-1, 0, 0))},
    )

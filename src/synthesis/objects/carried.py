# SPDX-License-Identifier: Apache-2.0
"""Things that people carry or hold, with the places where a hand takes them.

`handle`: y along the bar or the grip, the palm on z's side. `left`, `right` (box): middle of the
sides that face y and -y, x forward, z away from the box.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from synthesis.mesh import Material, Mesh, join
from synthesis.objects import finishes
from synthesis.objects.bags import bag
from synthesis.objects.bars import place, pose, put, staple, tube
from synthesis.objects.guitar import guitar
from synthesis.objects.held import bottle, cup, phone
from synthesis.objects.shapes import box as block
from synthesis.objects.shapes import cylinder
from synthesis.objects.thing import Thing

__all__ = ["bag", "bottle", "box", "cup", "guitar", "phone", "suitcase", "trolley"]


def suitcase(rng: Generator) -> Thing:
    """A case low enough to be carried by the handle on its top; wide along y."""
    height = rng.uniform(0.36, 0.56)
    width, depth = height * rng.uniform(0.68, 1.25), rng.uniform(0.16, 0.25)
    return _case(rng, (depth, min(width, 0.65), height), pulled=False)


def trolley(rng: Generator) -> Thing:
    """A wheeled case with its bar drawn out."""
    height = rng.uniform(0.48, 0.7)
    return _case(rng, (rng.uniform(0.2, 0.3), height * rng.uniform(0.62, 0.75), height), True)


def _case(rng: Generator, size: tuple[float, float, float], pulled: bool) -> Thing:
    depth, width, height = size
    name = "trolley" if pulled else "suitcase"
    shell = finishes.plastic(rng) if rng.random() < 0.5 else finishes.upholstery(rng)
    dark = finishes.dark_plastic(rng)
    wheel = 0.025 if pulled or rng.random() < 0.5 else 0.004
    parts = [
        put(block(size, shell, rng.uniform(0.02, 0.05), rng.uniform(0.03, 0.07)), (0, 0, 2 * wheel))
    ]
    for x in (-depth / 2 + 0.04, depth / 2 - 0.04):
        for y in (-width / 2 + 0.06, width / 2 - 0.06):
            parts.append(
                put(cylinder(wheel, 0.03, dark, 0, 12), (x, y + 0.015, wheel), roll=np.pi / 2)
            )
            parts.append(put(block((0.03, 0.05, 0.03), dark), (x, y, 2 * wheel - 0.01)))
    if rng.random() < 0.6:
        for y in np.linspace(-0.36, 0.36, int(rng.integers(3, 7))) * width:
            rib = block((depth + 0.012, 0.3 * width / 6, 0.88 * height), shell, 0.004, 0.05)
            parts.append(put(rib, (0, y, 2 * wheel + 0.06 * height)))
    else:
        for x in (-1, 1) if rng.random() < 0.5 else (1,):
            pocket = block((0.04, 0.8 * width, 0.5 * height), shell, 0.012, 0.015)
            parts.append(put(pocket, (x * depth / 2, 0, 2 * wheel + 0.1 * height)))
    parts.append(
        put(block((0.012, width + 0.006, height + 0.004), dark, 0.0, 0.0), (0, 0, 2 * wheel))
    )
    top = 2 * wheel + height
    grip = staple((0, -0.072, top - 0.01), (0, 0.072, top - 0.01), (0, 0, 0.045), 0.02)
    parts.append(tube(grip, 0.011, dark))
    bar = top + 0.035
    if pulled:
        bar, x = rng.uniform(0.95, 1.06), -depth / 2 + 0.03
        rod = finishes.metal(rng)
        for y in (-0.09, 0.09):
            parts.append(tube([[x, y, top - 0.02], [x, y, bar]], 0.008, rod))
        parts.append(tube([[x, -0.1, bar], [x, 0.1, bar]], 0.014, dark))
        return Thing(name, join(parts), {"handle": place((x, 0, bar), (0, 1, 0), (0, 0, 1))})
    return Thing(name, join(parts), {"handle": place((0, 0, bar), (0, 1, 0), (0, 0, 1))})


def box(rng: Generator) -> Thing:
    """A packing box, taped, open or a crate, that two hands can hold."""
    size = (rng.uniform(0.2, 0.45), rng.uniform(0.25, 0.5), rng.uniform(0.15, 0.42))
    x, y, z = size
    kind = rng.choice(["taped", "open", "crate"], p=[0.55, 0.25, 0.2])
    if kind == "taped":
        stuff, tape = finishes.cardboard(rng), finishes.plastic(rng)
        parts = [block(size, stuff, 0.002)]
        parts.append(put(block((0.05, y + 0.002, 0.08), tape), (0, 0, z - 0.079)))
        parts.append(put(block((0.05, y + 0.002, 0.08), tape), (0, 0, -0.0)))
        if rng.random() < 0.6:
            label = block((0.002, 0.1, 0.07), finishes.paper(rng))
            parts.append(put(label, (x / 2, rng.uniform(-0.25, 0.25) * y, 0.5 * z)))
        return Thing("box", join(parts), _sides(size))
    crate = kind == "crate"
    stuff = finishes.plastic(rng) if crate else finishes.cardboard(rng)
    wall = 0.012 if crate else 0.006
    parts = [block((x, y, wall), stuff), *_walls(x, y, z, wall, stuff)]
    if crate:
        for h in (0.2 * z, 0.55 * z, z - 0.02):
            parts += [put(rim, (0, 0, h)) for rim in _walls(x + 0.02, y + 0.02, 0.02, wall, stuff)]
        return Thing("box", join(parts), _sides(size))
    for quarter, (reach, length) in enumerate(((x, y), (y, x), (x, y), (y, x))):
        flap = put(block((0.5 * reach, length, 0.004), stuff), (0.25 * reach, 0, 0))
        hinge = pose((0, 0, 0), quarter * np.pi / 2) @ pose((reach / 2, 0, z - 0.004))
        parts.append(flap.moved(hinge @ pose((0, 0, 0), pitch=rng.uniform(0.2, 1.2))))
    filling = block((x - 0.02, y - 0.02, rng.uniform(0.4, 0.8) * z), finishes.paper(rng), 0.02)
    return Thing("box", join([*parts, filling]), _sides(size))


def _walls(x: float, y: float, z: float, wall: float, stuff: Material) -> list[Mesh]:
    """Four walls, (x, y) outside and z high."""
    parts = []
    for side in (-1, 1):
        parts.append(put(block((wall, y, z), stuff), (side * (x - wall) / 2, 0, 0)))
        parts.append(put(block((x, wall, z), stuff), (0, side * (y - wall) / 2, 0)))
    return parts


def _sides(size: tuple[float, float, float]) -> dict[str, np.ndarray]:
    _, y, z = size
    return {
        "left": place((0, y / 2, z / 2), (0, 0, -1), (0, 1, 0)),
        "right": place((0, -y / 2, z / 2), (0, 0, 1), (0, -1, 0)),
    }

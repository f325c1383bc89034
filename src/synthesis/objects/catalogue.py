# SPDX-License-Identifier: Apache-2.0
"""Every kind of thing by name, and which kinds are kept for tests."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from numpy.random import Generator

from synthesis.objects import carried, furniture, household, openings, screens, seats
from synthesis.objects.thing import Thing

THINGS: Mapping[str, Callable[[Generator], Thing]] = {
    "sofa": seats.sofa,
    "lamp": household.lamp,
    "bedside_table": furniture.bedside_table,
    "bench": seats.bench,
    "suitcase": carried.suitcase,
    "desk_chair": seats.desk_chair,
    "guitar": carried.guitar,
    "box": carried.box,
    "stool": seats.stool,
    "chair": seats.chair,
    "table": furniture.table,
    "desk": furniture.desk,
    "shelf": furniture.shelf,
    "cabinet": furniture.cabinet,
    "plant": household.plant,
    "bag": carried.bag,
    "trolley": carried.trolley,
    "cup": carried.cup,
    "phone": carried.phone,
    "bottle": carried.bottle,
    "monitor": screens.monitor,
    "laptop": screens.laptop,
    "door": openings.door,
    "curtain": openings.curtain,
    "bin": household.bin,
    "ball": household.ball,
    "broom": household.broom,
    "pole": household.pole,
    "cushion": household.cushion,
}
"""A function of a random generator for each kind."""

OCCLUDERS = (
    "sofa", "lamp", "bedside_table", "bench", "suitcase", "desk_chair", "guitar", "box", "stool",
)  # fmt: skip
"""The kinds that are put in front of people (METHOD 7)."""

HELD_OUT = ("desk_chair", "lamp")
"""Kinds that no training set contains: the "2 unseen objects" of the test sequences."""


def training_things() -> Mapping[str, Callable[[Generator], Thing]]:
    """The kinds that training sets may contain."""
    return {name: make for name, make in THINGS.items() if name not in HELD_OUT}


def held_out_things() -> Mapping[str, Callable[[Generator], Thing]]:
    """The kinds that only test sets contain."""
    return {name: THINGS[name] for name in HELD_OUT}

# SPDX-License-Identifier: Apache-2.0
"""Authored actions by name; every draw is somebody else in another mood.

act(name, person, rng, duration_s) -> Performance
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from kintrack.errors import SceneError
from synthesis.motions.actions.carrying import carrying_box, walking_with_suitcase
from synthesis.motions.actions.exercise import exercising, squatting
from synthesis.motions.actions.gesturing import pointing, waving
from synthesis.motions.actions.handing import handing_over
from synthesis.motions.actions.idling import arms_swinging, crossing_arms, standing
from synthesis.motions.actions.lifting import bending_and_lifting
from synthesis.motions.actions.music import guitar
from synthesis.motions.actions.reaches import reaching
from synthesis.motions.actions.sitting import sitting_and_gesturing, sitting_down_and_rising
from synthesis.motions.actions.small_things import drinking, phone
from synthesis.motions.actions.turning import turning_away
from synthesis.motions.actions.walks import walking
from synthesis.motions.performance import Performance
from synthesis.motions.placing import floor_pose, moved
from synthesis.objects.thing import Thing
from synthesis.people.person import Person

Things = Mapping[str, Callable[[np.random.Generator], Thing]]
"""Draws a thing of a kind: `suitcase`, `trolley`, `box`, `guitar`, `cup`, `bottle`, `phone`,
`stool`, `chair`, `sofa`. `trolley` and `bottle` may be missing, and all seats but one."""


class Action(Protocol):
    """Something that a person can do for a while."""

    def __call__(
        self, person: Person, rng: np.random.Generator, duration_s: float, things: Things
    ) -> Performance:
        """The performance, drawn."""
        ...


ACTIONS: dict[str, Action] = {
    "standing": standing,
    "arms_swinging": arms_swinging,
    "waving": waving,
    "pointing": pointing,
    "crossing_arms": crossing_arms,
    "phone": phone,
    "walking": walking,
    "walking_with_suitcase": walking_with_suitcase,
    "carrying_box": carrying_box,
    "sitting_down_and_rising": sitting_down_and_rising,
    "sitting_and_gesturing": sitting_and_gesturing,
    "guitar": guitar,
    "reaching": reaching,
    "bending_and_lifting": bending_and_lifting,
    "handing_over": handing_over,
    "turning_away": turning_away,
    "squatting": squatting,
    "exercising": exercising,
    "drinking": drinking,
}
"""Every action by name."""

HELD_OUT_ACTIONS = ("guitar", "handing_over", "drinking")
"""Actions that nothing is ever trained on."""

GRIPPING_ACTIONS = ("walking_with_suitcase", "drinking")
"""Actions whose hands should be drawn closed; `relaxed` hands suit the others."""

HOLDING_ACTIONS = (
    "phone",
    "walking_with_suitcase",
    "carrying_box",
    "guitar",
    "bending_and_lifting",
    "handing_over",
    "drinking",
)
"""Actions with something in the hands."""

SITTING_ACTIONS = ("sitting_down_and_rising", "sitting_and_gesturing")
"""Actions on a seat, which hold nothing."""

WALKING_ACTIONS = ("walking", "walking_with_suitcase", "carrying_box", "phone")
"""Actions that choose their own way over the floor, about the origin."""

BLACK = 0.5
"""Share of sofas of black leather that people sit on."""

SHORTEST_S = 3.0
"""Shortest performance [s]: less than that is no whole movement."""

FACING_DEG = 28.0
"""Standard deviation of the direction in which those who stay in place look, about x [deg]."""


def training_actions() -> tuple[str, ...]:
    """Names of the actions that may be trained on."""
    return tuple(name for name in ACTIONS if name not in HELD_OUT_ACTIONS)


def default_things(on_sofa: bool = False) -> Things:
    """The things of `synthesis.objects` that people carry and sit on.

    Args:
        on_sofa: Whether the only seats are sofas and armchairs; stools and chairs if not.
    """
    from synthesis.objects import carried, seats

    names = ("suitcase", "trolley", "box", "guitar", "cup", "bottle", "phone")
    kinds = {name: getattr(carried, name) for name in names if hasattr(carried, name)}
    if on_sofa:
        return {**kinds, "sofa": _sofa}
    return {**kinds, "stool": seats.stool, "chair": seats.chair}


def _sofa(rng: np.random.Generator) -> Thing:
    """Of black leather every second time, whose depth most sensors lose."""
    from synthesis.objects import finishes, seats

    return seats.sofa(rng, finishes.black_leather(rng) if rng.random() < BLACK else None)


def act(
    name: str,
    person: Person,
    rng: np.random.Generator,
    duration_s: float,
    things: Things | None = None,
) -> Performance:
    """Let a person do something; another draw does it otherwise.

    Args:
        name: One of `ACTIONS`.
        person: Who.
        rng: Draws all that varies: sides, sizes, speeds, posture, glances, things.
        duration_s: How long [s], at least `SHORTEST_S`.
        things: Draws things by kind; those of `synthesis.objects` if None.

    Returns:
        The performance at 30 Hz, about the origin of a floor at z = 0, looking more or less along
        x where the action does not turn or walk. Within about 2.5 m of the origin.

    Raises:
        SceneError: if there is no such action, the time is too short, or a thing is missing.
    """
    if name not in ACTIONS:
        raise SceneError(f"no action {name!r}; there are {', '.join(ACTIONS)}")
    if not duration_s >= SHORTEST_S:
        raise SceneError(f"duration_s = {duration_s!r}: at least {SHORTEST_S} s are needed")
    performance = ACTIONS[name](
        person, rng, duration_s, default_things() if things is None else things
    )
    if name in WALKING_ACTIONS:
        return performance
    facing = np.radians(FACING_DEG * rng.normal())
    return moved(performance, floor_pose(0.0, 0.0, float(facing)))


__all__ = [
    "ACTIONS",
    "GRIPPING_ACTIONS",
    "HELD_OUT_ACTIONS",
    "HOLDING_ACTIONS",
    "SITTING_ACTIONS",
    "Action",
    "Things",
    "act",
    "default_things",
    "training_actions",
]

# SPDX-License-Identifier: Apache-2.0
"""Steps of somebody who walks along a path or turns on the spot."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.footwork import AT_EASE, Stance, Step
from synthesis.motions.legs import yaw_matrix
from synthesis.people.person import Person

SWING = 0.82
"""Share of a step's time during which its foot is in the air; the rest is double support."""
SAME_PLACE_M = 1e-9
"""Points of a path nearer than this are one [m]."""


def steps_along(
    person: Person,
    path_m: Float[ndarray, "m 2"],
    start_s: float,
    step_length_m: float,
    step_s: float,
    stance: Stance = AT_EASE,
    first: str = "r",
    from_deg: float = 0.0,
) -> tuple[Step, ...]:
    """Walk along a path: the feet follow its direction and end side by side.

    Args:
        person: Who walks.
        path_m: Points, the first where the person stands, the path leaving it in the direction
            the person looks [m], shape (M, 2). The origin and x to begin with.
        start_s: When the first foot leaves the floor [s].
        step_length_m: Longest step [m]; all are equally long but the first and the last.
        step_s: Time from one step to the next [s].
        stance: How the feet stand at first.
        first: Side that steps first, `l` or `r`.
        from_deg: Heading at the start [deg]; tells whole turns apart.

    Returns:
        Steps in time order; none for a path without length.
    """
    ways = np.diff(path_m, axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    kept = lengths > SAME_PLACE_M
    ways, lengths = ways[kept], lengths[kept]
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    if len(lengths) == 0:
        return ()
    x, y = np.cumsum(np.vstack([path_m[0], ways]), axis=0).T
    yaw = np.unwrap(np.arctan2(ways[:, 1], ways[:, 0]))
    yaw += 2.0 * np.pi * np.round((np.radians(from_deg) - yaw[0]) / (2.0 * np.pi))
    middles = 0.5 * (s[:-1] + s[1:])
    count = max(1, int(np.ceil(s[-1] / step_length_m)))
    places = np.append(np.linspace(0.0, s[-1], count + 1)[1:], s[-1])
    out, side = [], first
    for k, at in enumerate(places):
        heading = float(np.interp(at, middles, yaw))
        goal = np.array([np.interp(at, s, x), np.interp(at, s, y)])
        begins = start_s + step_s * k
        out.append(
            Step(
                side,
                begins,
                begins + SWING * step_s,
                *_carried(person, stance, side, goal, heading),
                float(np.degrees(heading)),
            )
        )
        side = "l" if side == "r" else "r"
    return tuple(out)


def steps_turning(
    person: Person,
    from_deg: float,
    to_deg: float,
    start_s: float,
    step_s: float,
    largest_deg: float = 45.0,
    stance: Stance = AT_EASE,
    place_m: tuple[float, float] = (0.0, 0.0),
) -> tuple[Step, ...]:
    """Turn on the spot: the foot on the inner side goes first, the other joins it.

    Args:
        person: Who turns.
        from_deg: Heading at the start [deg].
        to_deg: Heading at the end; above `from_deg` to the left [deg].
        start_s: When the first foot leaves the floor [s].
        step_s: Time from one step to the next [s].
        largest_deg: Largest turn of a pair of steps [deg].
        stance: How the feet stand at first.
        place_m: Where the person stands [m].

    Returns:
        Steps in time order; none if there is nothing to turn.
    """
    count = int(np.ceil(abs(to_deg - from_deg) / largest_deg - 1e-9))
    sides = ("l", "r") if to_deg > from_deg else ("r", "l")
    out = []
    for k in range(count):
        heading_deg = from_deg + (to_deg - from_deg) * (k + 1) / count
        for n, side in enumerate(sides):
            begins = start_s + step_s * (2 * k + n)
            way = _carried(person, stance, side, np.array(place_m), np.radians(heading_deg))
            out.append(Step(side, begins, begins + SWING * step_s, *way, heading_deg))
    return tuple(out)


def steps_aside(
    person: Person,
    way_m: tuple[float, float],
    heading_deg: float,
    start_s: float,
    step_s: float,
    stance: Stance = AT_EASE,
    first: str = "r",
) -> tuple[Step, ...]:
    """One step of each foot to another place, looking where the person looked before.

    Args:
        person: Who steps.
        way_m: Forward and to the left, from the origin, as the person looks [m].
        heading_deg: Where the person looks [deg].
        start_s: When the first foot leaves the floor [s].
        step_s: Time from one step to the next [s].
        stance: How the feet stand at first.
        first: Side that steps first, `l` or `r`.

    Returns:
        Two steps in time order.
    """
    heading = np.radians(heading_deg)
    place = yaw_matrix(heading)[:2, :2] @ np.array(way_m)
    out = []
    for k, side in enumerate((first, "l" if first == "r" else "r")):
        begins = start_s + k * step_s
        way = _carried(person, stance, side, place, heading)
        out.append(Step(side, begins, begins + SWING * step_s, *way, heading_deg))
    return tuple(out)


def _carried(
    person: Person,
    stance: Stance,
    side: str,
    place_m: Float[ndarray, " 2"],
    heading_rad: float,
) -> tuple[float, float]:
    """Displacement of a foot that keeps its stance relative to a moved and turned person [m]."""
    foot = stance.foothold(person, side)[:2]
    axis = np.array([stance.foothold(person, "l")[0] + stance.foothold(person, "r")[0], 0.0]) / 2.0
    there = place_m + axis + yaw_matrix(heading_rad)[:2, :2] @ (foot - axis)
    forward, left = there - foot
    return float(forward), float(left)

# SPDX-License-Identifier: Apache-2.0
"""Who is who from frame to frame: the person who is followed, and everybody else.

While the person is tracked, everybody else in view is remembered with place and speed. Once he is
lost, people in view are first matched to those others who were seen for some frames, not to a piece
of himself that looked like one for a moment; who is left, and near enough to where he was lost, is
taken to be him. After a while of waiting anybody is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.labelled_config import WhereaboutsConfig
from kintrack.people import Somebody, choose


@dataclass(frozen=True)
class Known:
    """A person seen before."""

    place_world: Float[ndarray, " 3"]
    """Where [m]."""
    velocity: Float[ndarray, " 3"]
    """How fast [m/s]."""
    seen_s: float
    """When [s]."""
    frames: int = 1
    """In how many frames."""

    def expected(self, timestamp_s: float, carry_s: float) -> Float[ndarray, " 3"]:
        """Where he is expected by now [m]."""
        dt = min(max(timestamp_s - self.seen_s, 0.0), carry_s)
        return self.place_world + dt * self.velocity

    def moved(self, place_world: Float[ndarray, " 3"], timestamp_s: float) -> Known:
        """The same person seen again; the speed is smoothed over a quarter of a second."""
        dt = max(timestamp_s - self.seen_s, 1e-3)
        share = min(dt / 0.25, 1.0)
        speed = (place_world - self.place_world) / max(dt, 0.02)
        velocity = (1 - share) * self.velocity + share * speed
        return Known(place_world, velocity, timestamp_s, self.frames + 1)


@dataclass(frozen=True)
class Whereabouts:
    """Everybody of whom something is known."""

    own: Known | None = None
    """The person who is, or was, followed."""
    others: tuple[Known, ...] = ()
    """Everybody else."""


def met(where: Whereabouts, place_world: Float[ndarray, " 3"], timestamp_s: float) -> Whereabouts:
    """What is known once somebody begins to be followed at a place [m]."""
    return replace(where, own=Known(place_world, np.zeros(3), timestamp_s))


def follow(
    where: Whereabouts,
    own: Somebody | None,
    people: tuple[Somebody, ...],
    timestamp_s: float,
    config: WhereaboutsConfig,
) -> Whereabouts:
    """What is known after a frame in which the person was tracked.

    Args:
        where: What was known before.
        own: The person, one of `people`; None if he was not told apart in this frame.
        people: Everybody in view.
        timestamp_s: When [s].
        config: How far people get.
    """
    known = where.own
    if own is not None:
        place = own.place_world
        at_rest = Known(place, np.zeros(3), timestamp_s)
        known = at_rest if known is None else known.moved(place, timestamp_s)
    rest = [body for body in people if body is not own]
    return Whereabouts(known, _others(where, rest, timestamp_s, config))


def seek(
    where: Whereabouts,
    people: tuple[Somebody, ...],
    timestamp_s: float,
    config: WhereaboutsConfig,
) -> tuple[Whereabouts, Somebody | None]:
    """Who of the people in view is the lost person.

    Args:
        where: What was known before.
        people: Everybody in view.
        timestamp_s: When [s].
        config: How far people get.

    Returns:
        What is known now, and the person to start on: anybody if nobody was followed before or
        the wait is over, else whoever is near enough and not known to be somebody else; None if
        there is nobody like that.
    """
    own = where.own
    if own is None or timestamp_s - own.seen_s > config.hold_s:
        found = choose(people) if own is None else choose(_large(people), own.place_world)
        rest = [body for body in people if body is not found]
        return replace(where, others=_others(where, rest, timestamp_s, config)), found
    found = None
    gone_s = max(timestamp_s - own.seen_s, 0.0)
    pairs = _pairs(_known(where, config), people, timestamp_s, config)
    reach = config.reach_m + config.walk_m_s * gone_s
    for n, body in enumerate(people):
        away = float(np.linalg.norm(body.place_world - own.expected(timestamp_s, config.carry_s)))
        if away <= reach:
            pairs.append((away / reach, -1, n))
    matched: dict[int, int] = {}
    for _, who, n in sorted(pairs):
        if who not in matched and n not in matched.values():
            matched[who] = n
    if -1 in matched:
        found = people[matched[-1]]
    rest = [body for body in people if body is not found]
    return replace(where, others=_others(where, rest, timestamp_s, config)), found


def mine(
    where: Whereabouts, people: tuple[Somebody, ...], timestamp_s: float, config: WhereaboutsConfig
) -> Somebody | None:
    """Who of the people in view is the person who was tracked until the last frame."""
    own = where.own
    if own is None:
        return None
    pairs = _pairs((own, *_known(where, config)), people, timestamp_s, config)
    matched: dict[int, int] = {}
    for _, who, n in sorted(pairs):
        if who not in matched and n not in matched.values():
            matched[who] = n
    return people[matched[0]] if 0 in matched else None


def _known(where: Whereabouts, config: WhereaboutsConfig) -> tuple[Known, ...]:
    """The others who were seen often enough to be somebody."""
    return tuple(other for other in where.others if other.frames >= config.known_frames)


def _large(people: tuple[Somebody, ...]) -> tuple[Somebody, ...]:
    """Those who show at least half as much as the one who shows most."""
    most = max((body.area_m2 for body in people), default=0.0)
    return tuple(body for body in people if body.area_m2 >= 0.5 * most)


def _pairs(
    known: tuple[Known, ...],
    people: tuple[Somebody, ...],
    timestamp_s: float,
    config: WhereaboutsConfig,
) -> list[tuple[float, int, int]]:
    """Distance over reach, index of the known person, index of the person in view."""
    pairs = []
    for who, other in enumerate(known):
        reach = config.reach_m + config.other_m_s * max(timestamp_s - other.seen_s, 0.0)
        place = other.expected(timestamp_s, config.carry_s)
        for n, body in enumerate(people):
            away = float(np.linalg.norm(body.place_world - place))
            if away <= reach:
                pairs.append((away / reach, who, n))
    return pairs


def _others(
    where: Whereabouts, rest: list[Somebody], timestamp_s: float, config: WhereaboutsConfig
) -> tuple[Known, ...]:
    """The others after a frame that shows `rest` of them."""
    others = tuple(o for o in where.others if timestamp_s - o.seen_s <= config.forget_s)
    matched: dict[int, int] = {}
    for _, who, n in sorted(_pairs(others, tuple(rest), timestamp_s, config)):
        if who not in matched and n not in matched.values():
            matched[who] = n
    known = [
        other.moved(rest[matched[who]].place_world, timestamp_s) if who in matched else other
        for who, other in enumerate(others)
    ]
    new = [body for n, body in enumerate(rest) if n not in matched.values()]
    return (*known, *(Known(body.place_world, np.zeros(3), timestamp_s) for body in new))

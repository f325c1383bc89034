# SPDX-License-Identifier: Apache-2.0
"""Handing a thing over: held close, stretched out to somebody, taken back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from synthesis.motions.actions.carrying import before_belly, carrying_height, hold_box
from synthesis.motions.actions.frames import (
    draw_thing,
    mix,
    place_of,
    pose,
    upright_chest,
)
from synthesis.motions.actions.idling import shifting
from synthesis.motions.actions.mood import draw_mood, envelope, pick, spans, toss
from synthesis.motions.actions.small_things import phone_in_palm, upright_in_fist
from synthesis.motions.footwork import Step
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import HandPath, in_hand, palm_path, reach
from synthesis.motions.measures import measure
from synthesis.motions.motion import perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.placing import floor_pose
from synthesis.motions.poses import CARRYING, FORWARD, sided
from synthesis.people.person import SIDES, Person

RECEIVER_M = 1.3
"""How far before the giver the eyes of the other are [m]."""


def handing_over(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Offer a box with both hands, or a small thing with one, and take it back."""
    m, mood = measure(person), draw_mood(rng, duration_s, glances=0.5)
    kinds = [kind for kind in ("box", "box", "cup", "phone", "bottle") if kind in things]
    kind = pick(rng, *kinds)
    thing = draw_thing(things, kind, rng)
    sides = SIDES if kind == "box" else (pick(rng, *SIDES),)
    offers = spans(rng, duration_s, (2.0, 4.5), (0.4, 2.0))
    share = envelope(mood.times_s, offers, rng.uniform(0.8, 1.1) / mood.tempo)
    yaw = float(rng.uniform(-35.0, 35.0))
    lean = float(rng.uniform(0.3, 1.0))
    steps = _step_up(rng, offers) if toss(rng, 0.5) else ()
    curves = {
        "pelvis_pitch": 10.0 * lean * share,
        "spine_flexion": 8.0 * lean * share,
        "pelvis_forward": 0.04 * lean * share,
        "chest_rotation": 0.45 * yaw * share,
        "spine_rotation": 0.20 * yaw * share,
    }
    near = {name: value for side in sides for name, value in sided(side, CARRYING).items()}
    far = {name: value for side in sides for name, value in sided(side, FORWARD).items()}
    instead = {name: near[name] + share * (far.get(name, 0.0) - near[name]) for name in near}
    timed = [] if steps else shifting(rng, duration_s)
    script = mood.script(*timed, steps=steps, curves=curves, instead=instead)
    motion = perform(person, script)
    chest = upright_chest(person, motion)
    count = np.ones(len(share))
    aim = floor_pose(0.0, 0.0, np.radians(0.35 * yaw))
    if kind == "box":
        held = before_belly(m, thing, carrying_height(m, thing, rng))
        given = held.copy()
        given[2, 3] += rng.uniform(-0.02, 0.12)
        grip = 0.5 * (place_of(thing, "left") + place_of(thing, "right"))[:3, 3] + given[:3, 3]
        half = abs(place_of(thing, "left")[1, 3] - m.shoulder[1])
        drop = m.shoulder[2] - grip[2]
        most = np.sqrt(max((0.94 * (m.arm_m + 0.05)) ** 2 - drop**2 - half**2, 0.0))
        stretch = m.shoulder[0] + rng.uniform(0.85, 1.0) * most - grip[0]
        given[0, 3] += max(0.0, stretch)
        Ts = mix(chest @ held, chest @ aim @ given, share)
        motion = hold_box(person, motion, Ts, thing, count)
    else:
        side = sides[0]
        outward = 1.0 if side == "l" else -1.0
        high = rng.uniform(-0.12, 0.03)
        at = (m.front(high) + rng.uniform(0.08, 0.16), outward * rng.uniform(0.02, 0.15), high)
        way = np.array([1.0, -0.15 * outward, rng.uniform(-0.35, 0.1)])
        end = m.shoulder * [1.0, outward, 1.0]
        end = end + rng.uniform(0.85, 0.97) * (m.arm_m + 0.05) * way / np.linalg.norm(way)
        flat = kind == "phone" and toss(rng, 0.7)
        facing = (-0.1, -0.3 * outward, 1.0) if flat else (0.15, -outward, 0.15)
        close = pose(facing, (-0.95, 0.2 * outward, -0.15), at)
        offered = pose(facing, (-1.0, 0.05 * outward, 0.1), end)
        goal = mix(chest @ close, chest @ aim @ offered, share)
        motion = reach(person, motion, [HandPath(side, goal, count, (0.7, 0.6, 0.7))])
        held_by = (
            phone_in_palm(thing)
            if kind == "phone"
            else (upright_in_fist(side), place_of(thing, "handle"))
        )
        Ts = in_hand(person, motion, side, *held_by)
    eyes = chest[:, :3, 3] + RECEIVER_M * (chest @ aim)[:, :3, 0] + [0.0, 0.0, m.eyes[2]]
    given_at = 0.5 * sum(palm_path(person, motion, s)[:, :3, 3] for s in SIDES) if kind == "box" \
        else Ts[:, :3, 3]  # fmt: skip
    watch = envelope(mood.times_s, [(a - 0.2, a + 0.4 * (b - a)) for a, b in offers], 0.4)[:, None]
    motion = look_at(person, motion, watch * given_at + (1.0 - watch) * eyes, 0.65 * share)
    return Performance("handing_over", motion, (Prop(thing, Ts, held=True),))


def _step_up(rng: np.random.Generator, offers: list[tuple[float, float]]) -> tuple[Step, ...]:
    """A step of one foot towards the other person in every offer, and back."""
    steps: list[Step] = []
    side, far = pick(rng, *SIDES), float(rng.uniform(0.15, 0.35))
    for start, end in offers:
        takes = min(0.55, 0.3 * (end - start))
        steps.append(Step(side, start, start + takes, far, 0.0, 0.0))
        steps.append(Step(side, end - 1.2 * takes, end - 0.2 * takes, 0.0, 0.0, 0.0))
    return tuple(steps)

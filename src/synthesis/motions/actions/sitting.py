# SPDX-License-Identifier: Apache-2.0
"""Sitting down on stools and chairs, rising again, and talking while seated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from synthesis.motions.actions.idling import folded
from synthesis.motions.actions.mood import draw_mood, envelope, pick, spans, toss
from synthesis.motions.actions.seat import (
    draw_seated,
    gesturing_hands,
    hands_on_lap,
    seat_in_world,
)
from synthesis.motions.footwork import Gait, Step
from synthesis.motions.measures import measure
from synthesis.motions.motion import perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.placing import floor_pose
from synthesis.motions.poses import LEANING, ON_THIGH, RISE, Pose, both
from synthesis.motions.stepping import steps_aside, steps_turning
from synthesis.people.person import SIDES, Person

SHORTEST_SEATED_S = 0.8
"""How long somebody stays at least [s]."""


def sitting_down_and_rising(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Come to a seat by a turn or a step back, sit down, stay, rise."""
    mood = draw_mood(rng, duration_s, glances=0.7, slouch=0.6)
    seated = draw_seated(person, rng, mood, things)
    mood = replace(mood, stance=seated.stance)
    t = float(rng.uniform(0.1, 0.5))
    steps: tuple[Step, ...] = ()
    T = np.eye(4)
    yaw, far, aside = 0.0, 0.0, 0.0
    how = pick(rng, "turn", "back", "there") if duration_s > 6.5 else "there"
    if how == "turn":
        yaw = float(rng.uniform(35.0, 120.0)) * (1.0 if toss(rng) else -1.0)
        pace = rng.uniform(0.42, 0.55) / mood.tempo
        steps = steps_turning(person, 0.0, yaw, t, pace, 70.0, mood.stance)
        t = steps[-1].end_s + rng.uniform(0.05, 0.2)
    if how != "there":
        far, aside = -rng.uniform(0.14, 0.32), float(rng.normal(0.0, 0.04))
        pace = rng.uniform(0.5, 0.65) / mood.tempo
        steps += steps_aside(person, (far, aside), yaw, t, pace, mood.stance, pick(rng, *SIDES))
        t = steps[-1].end_s + rng.uniform(-0.1, 0.3)
    heading = np.radians(yaw)
    T = floor_pose(0.0, 0.0, heading) @ floor_pose(far, aside, 0.0)
    down_s, up_s = rng.uniform(1.3, 1.9) / mood.tempo, rng.uniform(1.2, 1.7) / mood.tempo
    left_s = duration_s - t - 0.2
    shrink = min(1.0, (left_s - SHORTEST_SEATED_S) / (down_s + up_s))
    down_s, up_s = shrink * down_s, shrink * up_s
    stays_s = left_s - down_s - up_s
    timed: list[tuple[float, Pose]] = []
    sat: list[tuple[float, float]] = []
    bout_s = max(3.0, 0.55 * stays_s)
    again = stays_s > 2.0 * bout_s
    while True:
        sits = stays_s if not again else rng.uniform(1.5, bout_s)
        timed += _down_and_up(rng, seated.pose, seated.upright(), t, down_s, sits, up_s)
        sat.append((t + down_s, t + down_s + sits))
        t += down_s + sits + up_s + rng.uniform(0.2, 1.0)
        stays_s = duration_s - t - 0.2 - down_s - up_s
        if stays_s < SHORTEST_SEATED_S:
            break
        again = stays_s > 2.0 * bout_s
    resting = both(ON_THIGH)
    for start, end in sat:
        hanging = {name: mood.hang[name] for name in resting}
        timed += [(start - 0.9 * down_s, hanging), (start - 0.45 * down_s, both(LEANING))]
        timed += [(start, resting), (end, resting)]
        timed += [(end + 0.4 * up_s, both(LEANING)), (end + up_s, hanging)]
    timed.sort(key=lambda pair: pair[0])
    motion = perform(person, mood.script(*timed, steps=steps, gait=Gait(weight_shift=0.3)))
    hands = pick(rng, "lap", "lap", "crossed", "loose", "talk")
    if hands == "lap":
        ends = [(start - 0.35 * down_s, end + 0.35 * up_s) for start, end in sat]
        share = envelope(mood.times_s, ends, 0.6)
        along = {side: float(rng.uniform(0.5, 0.88)) for side in SIDES}
        motion = hands_on_lap(person, motion, share, along)
    elif hands == "crossed":
        share = envelope(mood.times_s, sat, 0.8)
        motion = folded(person, motion, measure(person), share, pick(rng, *SIDES))
    elif hands == "talk":
        share = envelope(mood.times_s, sat, 0.8)
        motion = gesturing_hands(person, motion, rng, share)
    Ts = seat_in_world(seated, T, len(motion.q))
    prop = Prop(seated.seat, Ts, held=False)
    return Performance("sitting_down_and_rising", motion, (prop,))


def _down_and_up(
    rng: np.random.Generator,
    seated: Pose,
    upright: Pose,
    start_s: float,
    down_s: float,
    sits_s: float,
    up_s: float,
) -> list[tuple[float, Pose]]:
    """Keys of pelvis and trunk: bend and sink, sit, bend and rise."""
    bend = float(rng.uniform(0.5, 0.9))
    over = {name: bend * RISE[name] for name in ("pelvis_pitch", "spine_flexion", "chest_flexion")}
    over |= {
        "neck_flexion": RISE["neck_flexion"],
        "pelvis_drop": 0.62 * seated["pelvis_drop"],
        "pelvis_forward": 0.80 * seated["pelvis_forward"],
    }
    sits = start_s + down_s
    rises = sits + sits_s
    return [
        (start_s, upright),
        (start_s + 0.55 * down_s, over),
        (sits, seated),
        (rises, seated),
        (rises + 0.45 * up_s, over),
        (rises + up_s, upright),
    ]


def sitting_and_gesturing(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Seated throughout: hands talk, rest on the thighs, or the trunk leans about."""
    mood = draw_mood(rng, duration_s)
    seated = draw_seated(person, rng, mood, things)
    mood = replace(mood, stance=seated.stance)
    timed: list[tuple[float, Pose]] = []
    for start, end in spans(rng, duration_s, (1.5, 4.0), (0.2, 2.0)):
        lean = {
            "spine_flexion": seated.pose["spine_flexion"] + rng.uniform(-6.0, 16.0),
            "chest_rotation": rng.uniform(-14.0, 14.0),
            "spine_lateral": rng.uniform(-7.0, 7.0),
        }
        back = {name: seated.pose.get(name, 0.0) for name in lean}
        ease = min(1.0, 0.45 * (end - start))
        timed += [(start, back), (start + ease, lean), (end - ease, lean), (end, back)]
    motion = perform(person, mood.script(*timed, start=seated.pose | both(ON_THIGH)))
    along = {side: float(rng.uniform(0.45, 0.88)) for side in SIDES}
    motion = hands_on_lap(person, motion, np.ones(len(motion.q)), along)
    sides = SIDES if toss(rng, 0.7) else (pick(rng, *SIDES),)
    share = envelope(mood.times_s, spans(rng, duration_s, (2.0, 6.0), (0.1, 2.0)), 0.7)
    motion = gesturing_hands(person, motion, rng, share, sides)
    Ts = seat_in_world(seated, np.eye(4), len(motion.q))
    prop = Prop(seated.seat, Ts, held=False)
    return Performance("sitting_and_gesturing", motion, (prop,))

# SPDX-License-Identifier: Apache-2.0
"""Squats, lunges, side bends and arm circles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from synthesis.motions.actions.mood import Mood, draw_mood, envelope, pick, spans, toss
from synthesis.motions.arms import arm
from synthesis.motions.footwork import Gait, Step
from synthesis.motions.motion import Script, perform
from synthesis.motions.performance import Performance
from synthesis.motions.poses import (
    BALANCE,
    ON_HIP,
    SQUAT,
    TOGETHER,
    Pose,
    both,
    scaled,
    sided,
    still,
)
from synthesis.people.person import SIDES, Person


def squatting(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Squat a few times, more or less deep, arms forward, on the hips, together or hanging."""
    mood = draw_mood(rng, duration_s, glances=0.4)
    mood = mood.standing(
        narrower_m=float(rng.uniform(-0.14, -0.01)),
        toe_out_deg=(float(rng.uniform(10, 28)), float(rng.uniform(10, 28))),
        left_ahead_m=float(rng.normal(0.0, 0.02)),
    )
    arms = {"forward": both(BALANCE), "hips": both(ON_HIP), "together": both(TOGETHER), "hang": {}}[
        pick(rng, "forward", "hips", "together", "hang")
    ]
    hanging = {name: mood.hang[name] for name in arms}
    depth = rng.uniform(0.55, 1.15)
    timed: list[tuple[float, Pose]] = []
    for start, end in spans(rng, duration_s, (2.0, 4.2), (0.0, 0.8)):
        down = scaled(SQUAT, depth * rng.uniform(0.9, 1.1))
        down["pelvis_forward"] = -0.20 * min(1.0, depth)
        down["pelvis_pitch"] += rng.uniform(-6.0, 8.0)
        way = min(1.1 / mood.tempo, 0.45 * (end - start))
        timed += [(start, still(SQUAT) | hanging), (start + way, down | arms)]
        timed += [(end - way, down | arms), (end, still(SQUAT) | hanging)]
    return Performance("squatting", perform(person, mood.script(*timed)))


def exercising(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Lunges, side bends or arm circles."""
    mood = draw_mood(rng, duration_s, glances=0.3)
    how = pick(rng, "lunges", "bends", "circles")
    draws = {"lunges": _lunges, "bends": _bends, "circles": _circles}
    return Performance("exercising", perform(person, draws[how](rng, mood)))


def _lunges(rng: np.random.Generator, mood: Mood) -> Script:
    """Step far forward, sink, push back; left and right in turn."""
    mood = mood.standing(
        left_ahead_m=0.0,
        narrower_m=float(rng.uniform(-0.02, 0.02)),
        toe_out_deg=(float(rng.uniform(0.0, 8.0)), float(rng.uniform(0.0, 8.0))),
    )
    arms = both(ON_HIP) if toss(rng) else {}
    hanging = {name: mood.hang[name] for name in arms}
    far = rng.uniform(0.50, 0.72)
    low = {
        "pelvis_drop": rng.uniform(0.24, 0.42),
        "pelvis_pitch": rng.uniform(0.0, 8.0),
        "spine_flexion": rng.uniform(0.0, 8.0),
        "pelvis_forward": rng.uniform(-0.02, 0.06),
    }
    timed: list[tuple[float, Pose]] = []
    steps: list[Step] = []
    t, side = float(rng.uniform(0.1, 0.5)), pick(rng, *SIDES)
    out_s, hold_s = 0.75 / mood.tempo, rng.uniform(0.3, 0.9)
    while not steps or t + 2.0 * out_s + hold_s + 1.0 < mood.duration_s:
        lands, leaves = t + out_s, t + out_s + 0.5 + hold_s
        steps += [Step(side, t, lands, far, 0.0, 0.0)]
        steps += [Step(side, leaves, leaves + out_s, 0.0, 0.0, 0.0)]
        other = "l" if side == "r" else "r"
        low[f"{other}_heel"], low[f"{side}_heel"] = float(rng.uniform(48.0, 62.0)), 0.0
        timed += [(t, still(low) | hanging), (lands + 0.25, low | arms)]
        timed += [(leaves - 0.12, dict(low) | arms), (leaves + out_s, still(low) | hanging)]
        t = leaves + out_s + rng.uniform(0.2, 0.6)
        side = other
    gait = Gait(heel_off_deg=12.0, heel_strike_deg=8.0, follow_s=0.16, weight_shift=0.15, glide=0.4)
    return mood.script(*timed, steps=tuple(steps), gait=gait)


def _bends(rng: np.random.Generator, mood: Mood) -> Script:
    """Bend to the left and right, an arm overhead."""
    mood = mood.standing(narrower_m=float(rng.uniform(-0.14, -0.03)))
    timed: list[tuple[float, Pose]] = []
    side = pick(rng, *SIDES)
    over = arm((0.05, 0.35, 1.0), (0.1, -0.45, 1.0), clavicle_deg=22.0)
    for start, end in spans(rng, mood.duration_s, (2.2, 3.6), (0.0, 0.5)):
        outward = 1.0 if side == "l" else -1.0
        size = outward * rng.uniform(0.6, 1.0)
        bend = {
            "spine_lateral": 20.0 * size,
            "chest_lateral": 16.0 * size,
            "pelvis_left": 0.05 * size,
            "head_lateral": 8.0 * size,
        }
        other = "r" if side == "l" else "l"
        arms = sided(side, over) | (sided(other, ON_HIP) if toss(rng, 0.6) else {})
        hanging = {name: mood.hang[name] for name in arms}
        way = 0.42 * (end - start)
        timed += [(start, still(bend) | hanging), (start + way, bend | arms)]
        timed += [(end - way, bend | arms), (end, still(bend) | hanging)]
        side = other
    return mood.script(*timed)


def _circles(rng: np.random.Generator, mood: Mood) -> Script:
    """Straight arms go round, small and sideways or through the vertical."""
    times_s = mood.times_s
    period = rng.uniform(0.9, 1.6) / mood.tempo
    share = envelope(times_s, spans(rng, mood.duration_s, (3.0, 8.0), (0.0, 1.0)), 0.9)
    big = rng.uniform(8.0, 24.0)
    phase = 2.0 * np.pi * times_s / period
    flip = -1.0 if toss(rng) else 1.0
    instead = {}
    high = rng.uniform(-0.25, 0.25)
    for side in SIDES:
        way = sided(side, arm((0.1, 1.0, high), (0.12, 1.0, high + 0.03), clavicle_deg=9.0))
        for name, value in way.items():
            rest = mood.hang[name]
            instead[name] = rest + share * (value - rest)
        instead[f"{side}_shoulder_elevation"] += share * big * np.sin(phase)
        instead[f"{side}_shoulder_plane"] += share * flip * big * np.cos(phase)
    return mood.script(instead=instead)

# SPDX-License-Identifier: Apache-2.0
"""Standing about: weight from leg to leg, hands anywhere, arms swinging, arms crossed."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.actions.frames import pose, upright_chest
from synthesis.motions.actions.mood import Mood, between, draw_mood, envelope, pick, spans, toss
from synthesis.motions.arms import arm
from synthesis.motions.holding import HandPath, reach
from synthesis.motions.measures import Measures, measure
from synthesis.motions.motion import Motion, perform
from synthesis.motions.performance import Performance
from synthesis.motions.poses import LEANING, ON_HIP, Pose, both, scaled, sided
from synthesis.people.person import SIDES, Person


def shifting(rng: np.random.Generator, duration_s: float) -> list[tuple[float, Pose]]:
    """The pelvis goes over one leg, then over the other, and drops on the free side."""
    timed: list[tuple[float, Pose]] = []
    side = 1.0 if toss(rng) else -1.0
    for start, end in spans(rng, duration_s, (2.0, 5.0), (0.0, 2.0)):
        aside, drop = side * rng.uniform(0.03, 0.075), side * rng.uniform(1.5, 5.0)
        over = {
            "pelvis_left": aside,
            "pelvis_roll": drop,
            "spine_lateral": -0.8 * drop,
            "pelvis_yaw": side * rng.uniform(-4.0, 2.0),
        }
        ease = min(rng.uniform(0.7, 1.2), 0.45 * (end - start))
        timed += [(start, scaled(over, 0.0)), (start + ease, over)]
        timed += [(end - ease, over), (end, scaled(over, 0.0))]
        side = -side if toss(rng, 0.7) else side
    return timed


def folded(
    person: Person, motion: Motion, m: Measures, share: Float[ndarray, " n"], first: str
) -> Motion:
    """Arms folded before the chest, the palm of each side on the other arm."""
    chest = upright_chest(person, motion, 0.05)
    paths = []
    for side in SIDES:
        outward = 1.0 if side == "l" else -1.0
        over = side == first
        high = 0.045 if over else 0.0
        ahead = m.front(high) + (0.07 if over else 0.025)
        at = (ahead, -outward * 0.75 * m.half_width_m, high)
        T = pose((-0.85, -0.35 * outward, 0.1), (0.35, outward, -0.25), at)
        paths.append(HandPath(side, chest @ T, share, (0.6, 0.6, 0.6)))
    return reach(person, motion, paths)


def clasped(
    person: Person,
    motion: Motion,
    m: Measures,
    share: Float[ndarray, " n"],
    behind: bool,
    height_m: float,
) -> Motion:
    """Hands laid together before the belly or behind the back."""
    chest = upright_chest(person, motion, 0.05)
    paths = []
    for side in SIDES:
        outward = 1.0 if side == "l" else -1.0
        high = height_m + (0.02 if side == "l" else -0.02)
        if behind:
            x = m.middle_x_m - m.half_depth_m - (0.05 if side == "l" else 0.085)
            at, facing, wrist = (x, 0.03 * outward, high), (-1.0, 0.0, 0.2), (0.0, outward, 0.5)
        else:
            x = m.front(height_m) + (0.05 if side == "l" else 0.085)
            at, facing, wrist = (x, 0.03 * outward, high), (-1.0, 0.0, 0.0), (0.0, outward, 0.6)
        paths.append(HandPath(side, chest @ pose(facing, wrist, at), share, (0.7, 0.5, 0.7)))
    return reach(person, motion, paths)


def standing(person: Person, rng: np.random.Generator, duration_s: float, things: Mapping):
    """Idle: shifting weight, looking about, hands hanging, on the hips or together."""
    mood = draw_mood(rng, duration_s)
    timed = shifting(rng, duration_s)
    how = pick(rng, "hang", "hang", "hips", "hip", "front", "behind")
    stretches = spans(rng, duration_s, (2.5, 7.0), (0.3, 1.5))
    if how in ("hips", "hip"):
        up: dict[str, float] = {}
        for side in SIDES if how == "hips" else (pick(rng, *SIDES),):
            up |= sided(side, ON_HIP)
        timed = sorted(timed + rests(mood, stretches, up), key=lambda pair: pair[0])
    motion = perform(person, mood.script(*timed))
    if how in ("front", "behind"):
        m = measure(person)
        share = envelope(mood.times_s, stretches, 0.9 / mood.tempo)
        high = m.front_heights_m[0] + rng.uniform(0.0, 0.10)
        motion = clasped(person, motion, m, share, how == "behind", high)
    return Performance("standing", motion)


def rests(
    mood: Mood, stretches: list[tuple[float, float]], up: Pose, ease_s: float = 0.8
) -> list[tuple[float, Pose]]:
    """Keys that go to a pose in each stretch and back to how the arms hang."""
    down = {name: mood.hang.get(name, 0.0) for name in up}
    timed: list[tuple[float, Pose]] = []
    for start, end in stretches:
        ease = min(ease_s / mood.tempo, 0.45 * (end - start))
        timed += [(start, down), (start + ease, up), (end - ease, up), (end, down)]
    return timed


def arms_swinging(person: Person, rng: np.random.Generator, duration_s: float, things: Mapping):
    """Standing, the arms swing: alternately, together, or round the body with the trunk."""
    mood = draw_mood(rng, duration_s)
    t = mood.times_s
    how = pick(rng, "alternating", "together", "round")
    period = rng.uniform(0.95, 1.7) / mood.tempo
    big = envelope(t, spans(rng, duration_s, (3.0, 8.0), (0.1, 1.2)), 1.2)
    big = big * (1.0 + 0.15 * np.sin(2.0 * np.pi * t / rng.uniform(3.0, 6.0)))
    phase = 2.0 * np.pi * t / period + rng.uniform(0.0, 2.0 * np.pi)
    wave = np.sin(phase)
    instead: dict[str, Float[ndarray, " n"]] = {}
    trunk: dict[str, Float[ndarray, " n"]] = {}
    ahead, bend = rng.uniform(0.35, 0.85), rng.uniform(0.1, 0.45)
    for side in SIDES:
        sign = -1.0 if side == "r" and how != "together" else 1.0
        swing = 0.5 + 0.5 * big * sign * wave
        out = rng.uniform(0.16, 0.24)
        if how == "round":
            front = arm((0.45, 0.10, -1.0), (0.8, -0.5, -0.9), pronation_deg=15.0)
            back = arm((-0.35, 0.40, -1.0), (-0.3, 0.4, -1.0))
        else:
            front = arm((ahead, out - 0.02, -1.0), (ahead + bend, 0.03, -1.0))
            back = arm((-0.6 * ahead, out, -1.0), (-0.45 * ahead, out, -1.0))
        instead |= between(sided(side, back), sided(side, front), swing)
    turn = -1.0 if how == "round" else -0.25
    if how != "together":
        trunk["chest_rotation"] = turn * rng.uniform(8.0, 16.0) * big * wave
        trunk["spine_rotation"] = turn * rng.uniform(3.0, 7.0) * big * wave
        trunk["pelvis_yaw"] = turn * rng.uniform(2.0, 7.0) * big * wave
        trunk["head_rotation"] = -0.5 * trunk["chest_rotation"]
    else:
        trunk["pelvis_drop"] = 0.5 * rng.uniform(0.0, 0.05) * big * (1.0 - np.cos(2.0 * phase))
        trunk["spine_flexion"] = rng.uniform(0.0, 4.0) * big * wave
    return Performance("arms_swinging", perform(person, mood.script(curves=trunk, instead=instead)))


def crossing_arms(person: Person, rng: np.random.Generator, duration_s: float, things: Mapping):
    """Fold the arms, stand so for a while, let them go."""
    mood = draw_mood(rng, duration_s)
    stretches = spans(rng, duration_s, (3.5, 9.0), (0.2, 1.5))
    timed = shifting(rng, duration_s) + rests(mood, stretches, both(LEANING), 0.9)
    motion = perform(person, mood.script(*sorted(timed, key=lambda pair: pair[0])))
    share = envelope(mood.times_s, stretches, 1.1 / mood.tempo)
    motion = folded(person, motion, measure(person), share, pick(rng, *SIDES))
    return Performance("crossing_arms", motion)

# SPDX-License-Identifier: Apache-2.0
"""Gestures of somebody who stands: waving and pointing."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy import ndarray

from synthesis.motions.actions.frames import pose, through, upright_chest
from synthesis.motions.actions.idling import rests, shifting
from synthesis.motions.actions.mood import draw_mood, envelope, pick, spans, toss
from synthesis.motions.arms import arm
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import HandPath, palm_path, reach
from synthesis.motions.measures import measure
from synthesis.motions.motion import perform
from synthesis.motions.performance import Performance
from synthesis.motions.poses import FORWARD, Pose, sided
from synthesis.people.person import SIDES, Person


def waving(person: Person, rng: np.random.Generator, duration_s: float, things: Mapping):
    """Wave with one hand or both, small at the shoulder or wide overhead."""
    mood = draw_mood(rng, duration_s, glances=0.5)
    stretches = spans(rng, duration_s, (1.8, 4.0), (0.3, 2.0))
    ease = 0.6 / mood.tempo
    timed, curves = shifting(rng, duration_s), {}
    shake = envelope(mood.times_s, [(a + 0.6 * ease, b - 0.6 * ease) for a, b in stretches], 0.4)
    period = rng.uniform(0.42, 0.85) / mood.tempo
    wave = shake * np.sin(2.0 * np.pi * mood.times_s / period)
    for side in SIDES if toss(rng, 0.2) else (pick(rng, *SIDES),):
        high = rng.uniform(-0.6, 0.9)
        up = arm(
            upper=(rng.uniform(0.15, 0.6), rng.uniform(0.5, 0.9), high),
            forearm=(rng.uniform(0.15, 0.45), rng.uniform(0.0, 0.25), 1.0),
            clavicle_deg=8.0 + 8.0 * max(high, 0.0),
            pronation_deg=rng.uniform(-50.0, 10.0),
        )
        timed += rests(mood, stretches, sided(side, up), 0.75)
        curves[f"{side}_shoulder_rotation"] = rng.uniform(4.0, 18.0) * wave
        curves[f"{side}_wrist_deviation"] = rng.uniform(0.0, 14.0) * wave
        curves[f"{side}_elbow_flexion"] = rng.uniform(-8.0, 8.0) * wave
    timed.sort(key=lambda pair: pair[0])
    return Performance("waving", perform(person, mood.script(*timed, curves=curves)))


def pointing(person: Person, rng: np.random.Generator, duration_s: float, things: Mapping):
    """Point at places all round with a straight arm, the eyes there too."""
    m, mood = measure(person), draw_mood(rng, duration_s, glances=0.6)
    side = pick(rng, *SIDES)
    outward = 1.0 if side == "l" else -1.0
    stretches = spans(rng, duration_s, (1.6, 3.5), (0.3, 1.5))
    timed = shifting(rng, duration_s)
    timed += rests(mood, stretches, sided(side, FORWARD), 0.6)
    knots: list[tuple[float, ndarray]] = []
    leans: list[tuple[float, Pose]] = []
    for start, end in stretches:
        for time_s in (start, end) if toss(rng) else (start + 0.2,):
            yaw, pitch = np.radians([rng.uniform(-25.0, 105.0), rng.uniform(-35.0, 45.0)])
            way = np.array(
                [np.cos(yaw) * np.cos(pitch), outward * np.sin(yaw) * np.cos(pitch), np.sin(pitch)]
            )
            far = rng.uniform(0.85, 0.97) * (m.arm_m + 0.07)
            at = m.shoulder * [1.0, outward, 1.0] + far * way
            facing = (-0.2, -outward, -0.6) if toss(rng) else (0.0, -0.4 * outward, -1.0)
            knots.append((time_s, pose(np.cross(way, np.cross(facing, way)), -way, at)))
            leans.append((time_s, {"chest_rotation": outward * np.degrees(yaw) * 0.12}))
    timed = sorted(timed + leans, key=lambda pair: pair[0])
    motion = perform(person, mood.script(*timed))
    share = envelope(mood.times_s, stretches, 0.75 / mood.tempo)
    goal = upright_chest(person, motion) @ through(knots, mood.times_s)
    motion = reach(person, motion, [HandPath(side, goal, share, (0.5, 0.7, 0.7))])
    beyond = palm_path(person, motion, side)[:, :3, 3]
    away = 3.0 * (beyond - upright_chest(person, motion)[:, :3, 3]) + beyond
    return Performance("pointing", look_at(person, motion, away, 0.85 * share))

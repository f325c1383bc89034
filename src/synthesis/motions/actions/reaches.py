# SPDX-License-Identifier: Apache-2.0
"""Reaching to high, low and far places with one hand or both."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy import ndarray

from synthesis.motions.actions.frames import (
    pose,
    through,
)
from synthesis.motions.actions.lifting import down
from synthesis.motions.actions.mood import draw_mood, envelope, pick, spans, toss
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import HandPath, reach
from synthesis.motions.measures import measure
from synthesis.motions.motion import perform
from synthesis.motions.performance import Performance
from synthesis.motions.poses import FORWARD, Pose, sided, still
from synthesis.people.person import SIDES, Person


def reaching(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Reach up, down, ahead and aside with one hand or both; knees, trunk and eyes go along."""
    m, mood = measure(person), draw_mood(rng, duration_s, glances=0.5)
    stretches = spans(rng, duration_s, (1.9, 3.4), (0.2, 1.2))
    sides_of = [SIDES if toss(rng, 0.35) else (pick(rng, *SIDES),) for _ in stretches]
    poses: dict[str, list[tuple[float, ndarray]]] = {side: [] for side in SIDES}
    arms: list[tuple[float, Pose]] = []
    trunk: list[tuple[float, Pose]] = []
    active: dict[str, list[tuple[float, float]]] = {side: [] for side in SIDES}
    standing = np.array([0.0, 0.0, m.leg_m + 0.08]) + m.pelvis_chest
    for (start, end), sides in zip(stretches, sides_of, strict=True):
        where = pick(rng, "high", "high", "ahead", "aside", "low")
        one = 1.0 if sides[0] == "l" else -1.0
        yaw = one * np.radians(rng.uniform(-30.0, 100.0 if where == "aside" else 50.0))
        if len(sides) == 2:
            yaw *= 0.4
        pitch = {"high": (30.0, 75.0), "ahead": (-15.0, 20.0), "aside": (-20.0, 40.0),
                 "low": (-75.0, -45.0)}[where]  # fmt: skip
        up = np.radians(rng.uniform(*pitch))
        far = rng.uniform(0.85, 1.25) if where != "low" else rng.uniform(1.3, 1.75)
        way = np.array([np.cos(yaw) * np.cos(up), np.sin(yaw) * np.cos(up), np.sin(up)])
        lean = _lean(rng, where, float(np.degrees(yaw)), far)
        middle = standing + [0.0, 0.0, m.shoulder[2]] + far * (m.arm_m + 0.07) * way
        middle[2] = max(middle[2], 0.25)
        ease = min(0.9 / mood.tempo, 0.42 * (end - start))
        trunk += [(start, still(lean)), (start + ease, lean)]
        trunk += [(end - ease, lean), (end, still(lean))]
        for side in sides:
            outward = 1.0 if side == "l" else -1.0
            aside = m.shoulder[1] * outward if len(sides) == 2 else 0.5 * m.shoulder[1] * outward
            across = np.array([-np.sin(yaw), np.cos(yaw), 0.0])
            facing = -outward * across + np.array([0.0, 0.0, rng.uniform(-1.2, 0.4)])
            T = pose(facing - (facing @ way) * way, -way, middle + aside * across)
            poses[side].append((0.5 * (start + end), T))
            active[side].append((start, end))
            hanging = {f"{side}_{name}": mood.hang[f"{side}_{name}"] for name in FORWARD}
            arms += [(start, hanging), (start + ease, sided(side, FORWARD))]
            arms += [(end - ease, sided(side, FORWARD)), (end, hanging)]
    timed = sorted(trunk + arms, key=lambda pair: pair[0])
    motion = perform(person, mood.script(*timed))
    paths, look = [], np.zeros(len(mood.times_s))
    place = np.zeros((len(mood.times_s), 3))
    for side in SIDES:
        if not poses[side]:
            continue
        goal = through(poses[side], mood.times_s)
        share = envelope(mood.times_s, active[side], 0.95 / mood.tempo)
        paths.append(HandPath(side, goal, share, (0.4, 0.4, 0.4)))
        place += share[:, None] * goal[:, :3, 3]
        look += share
    motion = reach(person, motion, paths)
    place = place / np.maximum(look, 1e-3)[:, None] + (look < 1e-3)[:, None] * [2.0, 0.0, 1.5]
    return Performance("reaching", look_at(person, motion, place, 0.8 * np.minimum(look, 1.0)))


def _lean(rng: np.random.Generator, where: str, yaw_deg: float, far: float) -> dict[str, float]:
    """Trunk and knees that go along with a reach."""
    over = np.clip(far - 0.8, 0.0, 1.0)
    out = {
        "chest_rotation": float(np.clip(0.28 * yaw_deg, -25.0, 25.0)),
        "spine_rotation": float(np.clip(0.14 * yaw_deg, -12.0, 12.0)),
        "pelvis_yaw": float(np.clip(0.15 * yaw_deg, -12.0, 12.0)),
        "pelvis_drop": 0.0,
        "pelvis_forward": 0.04 * over,
        "pelvis_pitch": 12.0 * over,
        "spine_flexion": 12.0 * over,
        "chest_flexion": 5.0 * over,
    }
    if where == "high":
        out |= {"pelvis_pitch": 0.0, "spine_flexion": -4.0, "chest_flexion": -8.0}
        tiptoe = rng.uniform(8.0, 24.0) if toss(rng, 0.4) else 0.0
        out |= {"l_heel": tiptoe, "r_heel": tiptoe, "pelvis_drop": -0.0025 * tiptoe}
        out["pelvis_forward"] = 0.02 + 0.003 * tiptoe
    if where == "low":
        out |= down(rng.uniform(0.45, 0.85), rng.uniform(0.0, 1.0))
    return out

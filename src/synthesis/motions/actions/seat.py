# SPDX-License-Identifier: Apache-2.0
"""Where somebody sits: how far the pelvis sinks, and where the seat stands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import leg_length, run_kinematics
from kintrack.geometry import invert_rigid
from kintrack.skin import skinned_vertices
from synthesis.motions.actions.frames import draw_thing, place_of, pose, through, upright_chest
from synthesis.motions.actions.mood import Mood, pick, toss
from synthesis.motions.footwork import Stance, neutral_position
from synthesis.motions.holding import HandPath, frame_path, reach
from synthesis.motions.measures import measure
from synthesis.motions.motion import RATE_HZ, Motion, Script, perform
from synthesis.motions.poses import still
from synthesis.objects.thing import Thing
from synthesis.people.person import SIDES, Person

SEATS = ("stool", "chair", "sofa")
"""What people sit down on."""
PRESSED_M = 0.010
"""How deep flesh and cushion give way [m]."""
ROUNDS = 6
"""Corrections of the pelvis' height."""
EXACT_M = 0.002
"""How exactly the pelvis' height is found; whose legs are too short sits further forward [m]."""
MOST_BEHIND_M = -0.10
"""Furthest that the middle of a seat lies behind the pelvis [m]."""
TOP_M = 0.02
"""Depth of a seat's upper surface [m]."""


@dataclass(frozen=True)
class Seated:
    """Somebody's way to sit on a seat."""

    seat: Thing
    """What they sit on."""
    pose: dict[str, float]
    """Pelvis and trunk while seated."""
    stance: Stance
    """Where the feet stand."""
    T_start_seat: Float[ndarray, "4 4"]
    """Pose of the seat for somebody who stands at the origin and sits down behind it."""

    def upright(self) -> dict[str, float]:
        """The same channels when standing."""
        return still(self.pose)


def draw_seated(person: Person, rng: np.random.Generator, mood: Mood, things: Mapping) -> Seated:
    """Draw a seat and a way to sit on it.

    Args:
        person: Who sits.
        rng: Draws.
        mood: Their posture, which moves the skin a little.
        things: Kinds of things; one of those of `SEATS` is drawn.

    Returns:
        The way; the lowest skin above the seat is `PRESSED_M` below its surface.
    """
    seat = draw_thing(things, pick(rng, *(name for name in SEATS if name in things)), rng)
    height = float(place_of(seat, "seat")[2, 3])
    leg_m = leg_length(person.body)
    hip, knee = (neutral_position(person, f"l_{name}") for name in ("thigh", "shank"))
    thigh_m = float(np.linalg.norm(knee - hip))
    ahead = -(thigh_m * rng.uniform(0.86, 1.04)) / leg_m
    slump = rng.uniform(-4.0, 14.0)
    seated = {
        "pelvis_forward": ahead,
        "pelvis_pitch": float(rng.uniform(-12.0, 4.0)),
        "spine_flexion": slump,
        "chest_flexion": 0.5 * slump + rng.uniform(-2.0, 4.0),
        "neck_flexion": -0.4 * slump,
        "head_flexion": 0.0,
    }
    stance = Stance(
        narrower_m=float(rng.uniform(-0.10, 0.0)),
        toe_out_deg=(float(rng.uniform(0.0, 20.0)), float(rng.uniform(0.0, 20.0))),
        left_ahead_m=float(rng.normal(0.0, 0.05)),
    )
    rear, front = _top(seat)
    ahead_m = float(rng.uniform(0.03, 0.10))
    aside_m = float(rng.normal(0.0, 0.015))
    while True:
        drop = 0.4
        for _ in range(ROUNDS):
            channels = {**seated, "pelvis_drop": drop}
            script = Script(
                1.0 / RATE_HZ, {k: ((0.0, v),) for k, v in channels.items()}, (), stance
            )
            q = perform(person, script).q[0]
            bounds = (ahead_m + rear, ahead_m + front)
            error = buttocks(person, q, q[:2], 0.0, bounds) - height + PRESSED_M
            drop += error / leg_m
        if abs(error) < EXACT_M or ahead_m < MOST_BEHIND_M:
            break
        ahead_m -= 0.03
    T = np.eye(4)
    T[:2, 3] = float(q[0]) + ahead_m, aside_m
    return Seated(seat, channels, stance, T)


def _top(seat: Thing) -> tuple[float, float]:
    """Where the upper surface ends behind and before the place `seat` [m]."""
    place = place_of(seat, "seat")[:3, 3]
    v = seat.mesh.vertices
    top = v[np.abs(v[:, 2] - place[2]) < TOP_M, 0] - place[0]
    return float(top.min()), float(top.max())


def buttocks(
    person: Person,
    q: Float[ndarray, " nq"],
    place_m: Float[ndarray, " 2"],
    yaw_rad: float,
    bounds_m: tuple[float, float],
) -> float:
    """Height of the lowest skin of pelvis and thighs above a seat [m].

    Args:
        person: Who.
        q: Configuration, shape (nq,).
        place_m: Where the pelvis is on the floor, shape (2,).
        yaw_rad: Where the person looks.
        bounds_m: Part of the seat, behind and before the pelvis [m].
    """
    skin = person.skin
    links = [skin.link_names.index(name) for name in ("pelvis", "l_thigh", "r_thigh")]
    of = (skin.weights * np.isin(skin.links, links)).sum(axis=1) > 0.6
    vertices = skinned_vertices(run_kinematics(person.body, q), skin)[of]
    ahead = (vertices[:, :2] - place_m) @ [np.cos(yaw_rad), np.sin(yaw_rad)]
    above = (ahead > bounds_m[0]) & (ahead < bounds_m[1])
    return float(vertices[above, 2].min())


def hands_on_lap(
    person: Person,
    motion: Motion,
    share: Float[ndarray, " n"],
    along: Mapping[str, float],
) -> Motion:
    """Palms on the thighs.

    Args:
        person: Who sits.
        motion: Their motion.
        share: 0 = arms as scripted, 1 = palms on the thighs, shape (N,).
        along: By side, where on the thigh: 0 = hip, 1 = knee.
    """
    neutral = run_kinematics(person.body, person.body.neutral())
    names = person.skin.link_names
    vertices = skinned_vertices(neutral, person.skin)
    paths = []
    for side, at in along.items():
        outward = 1.0 if side == "l" else -1.0
        hip = neutral.Ts_world_link[names.index(f"{side}_thigh")][:3, 3]
        knee = neutral.Ts_world_link[names.index(f"{side}_shank")][:3, 3]
        place = hip + at * (knee - hip)
        of = (person.skin.weights * (person.skin.links == names.index(f"{side}_thigh"))).sum(
            1
        ) > 0.5
        ring = vertices[of & (np.abs(vertices[:, 2] - place[2]) < 0.04)] - hip
        top = float(ring[:, 0].max(initial=0.06)) + 0.012
        T = pose(
            (-1.0, 0.0, 0.0), (0.0, 0.35 * outward, 1.0), (top, 0.015 * outward, (place - hip)[2])
        )
        thigh = frame_path(person, motion, f"{side}_thigh")
        paths.append(HandPath(side, thigh @ T, share, (0.3, 0.8, 0.8)))
    return reach(person, motion, paths)


def gesturing_hands(
    person: Person,
    motion: Motion,
    rng: np.random.Generator,
    share: Float[ndarray, " n"],
    sides: tuple[str, ...] = SIDES,
) -> Motion:
    """Hands that talk: from place to place before the chest, with short rests."""
    m, chest, paths = measure(person), upright_chest(person, motion), []
    for side in sides:
        outward = 1.0 if side == "l" else -1.0
        t, knots = float(rng.uniform(0.0, 0.4)), []
        while t < motion.times_s[-1] + 1.0:
            high = rng.uniform(-0.14, 0.12)
            at = (
                m.front(high) + rng.uniform(0.10, 0.24),
                outward * rng.uniform(0.02, 0.26),
                high,
            )
            facing = (rng.uniform(-0.5, 0.4), -outward, rng.uniform(-0.3, 1.0))
            wrist = (-0.8, outward * rng.uniform(0.0, 0.5), rng.uniform(-0.7, 0.0))
            T = pose(facing, wrist, at)
            knots.append((t, T))
            if toss(rng, 0.4):
                t += rng.uniform(0.2, 0.8)
                knots.append((t, T))
            t += rng.uniform(0.35, 0.8)
        goal = chest @ through(knots, motion.times_s)
        paths.append(HandPath(side, goal, share, (0.4, 0.4, 0.4)))
    return reach(person, motion, paths)


def seat_in_world(
    seated: Seated, T_world_start: Float[ndarray, "4 4"], count: int
) -> Float[ndarray, "n 4 4"]:
    """The standing seat's pose in every frame, its `seat` place over `T_start_seat`."""
    T_seat = place_of(seated.seat, "seat").copy()
    T_seat[2, 3] = 0.0
    return np.tile(T_world_start @ seated.T_start_seat @ invert_rigid(T_seat), (count, 1, 1))

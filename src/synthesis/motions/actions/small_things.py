# SPDX-License-Identifier: Apache-2.0
"""Things in one hand: a phone at the ear or before the eyes, a cup at the lips."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.actions.frames import (
    draw_thing,
    middle,
    mix,
    place_of,
    pose,
    upright_chest,
)
from synthesis.motions.actions.idling import shifting
from synthesis.motions.actions.mood import Mood, draw_mood, envelope, pick, spans, toss, wander
from synthesis.motions.actions.walks import draw_walk
from synthesis.motions.curves import minimum_jerk
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import HandPath, frame_path, in_hand, palm_path, reach
from synthesis.motions.measures import Measures, measure
from synthesis.motions.motion import Motion, perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.placing import moved
from synthesis.motions.poses import CARRYING, TO_FACE, sided
from synthesis.objects.thing import Thing
from synthesis.people.person import SIDES, Person

EAR = np.array([0.0, 0.085, -0.015])
"""The left ear from the middle of the head, forward, left, up [m]."""
LIPS = np.array([0.115, 0.0, -0.055])
"""The lips from the middle of the head [m]."""
OBLIQUE_RAD = np.radians(28.0)
"""How far a handle in the fist leans from square to the forearm, the thumb's end away [rad]."""
PHONE_OFF_PALM_M = 0.012
"""How far before the palm the middle of a phone lies [m]."""


def upright_in_fist(side: str) -> Float[ndarray, "4 4"]:
    """T_palm_place of a handle whose y is up when the thumb is, the palm on its z side."""
    thumb = 1.0 if side == "l" else -1.0
    T = np.eye(4)
    y = np.array([0.0, thumb * np.cos(OBLIQUE_RAD), -np.sin(OBLIQUE_RAD)])
    z = np.array([-1.0, 0.0, 0.0])
    T[:3, :3] = np.stack([np.cross(y, z), y, z], axis=1)
    return T


def phone_in_palm(thing: Thing) -> tuple[Float[ndarray, "4 4"], Float[ndarray, "4 4"]]:
    """T_palm_place and T_thing_place of a phone along the fingers, its screen outwards."""
    T_palm = np.diag([1.0, -1.0, -1.0, 1.0])
    T_palm[0, 3] = PHONE_OFF_PALM_M
    T_thing = np.eye(4)
    T_thing[:3, 3] = middle(thing)
    return T_palm, T_thing


def phone(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Call with the phone at the ear, or look down at it; standing or walking slowly."""
    m, side = measure(person), pick(rng, *SIDES)
    outward = 1.0 if side == "l" else -1.0
    thing = draw_thing(things, "phone", rng)
    calls = toss(rng)
    T_world_start = np.eye(4)
    if toss(rng, 0.3) and duration_s > 4.0:
        walk = draw_walk(person, rng, duration_s, (0.6, 0.85), glances=0.3)
        mood, T_world_start = walk.mood, walk.T_world_start
        other = "r" if side == "l" else "l"
        motion = walk.performed(person, (other,), 2.0, hold={side: TO_FACE if calls else CARRYING})
        share = np.ones(len(mood.times_s))
    else:
        mood = draw_mood(rng, duration_s, glances=0.8 if calls else 0.3)
        busy = [(-1.5, duration_s + 1.5)]
        if toss(rng, 0.6) and duration_s > 3.5:
            busy = spans(rng, duration_s, (2.2, 8.0), (0.2, 1.5))
        share = envelope(mood.times_s, busy, 1.0 / mood.tempo)
        up = sided(side, TO_FACE if calls else CARRYING)
        instead = {
            name: mood.hang[name] + share * (value - mood.hang[name]) for name, value in up.items()
        }
        motion = perform(person, mood.script(*shifting(rng, duration_s), instead=instead))
    if calls:
        head = frame_path(person, motion, "head")
        centre = frame_path(person, motion, "head_center")[:, :3, 3]
        head[:, :3, 3] = centre
        ear = EAR * [1.0, outward, 1.0] + [0.015, outward * 0.012, -0.02]
        T = pose((0.1, -outward, 0.1), (0.35, 0.45 * outward, -0.9), ear)
        motion = reach(person, motion, [HandPath(side, head @ T, share, (0.3, 0.8, 0.8))])
    else:
        motion = _reading(person, motion, m, mood, rng, side, share)
    Ts = in_hand(person, motion, side, *phone_in_palm(thing))
    performance = Performance("phone", motion, (Prop(thing, Ts, held=True),))
    return moved(performance, T_world_start)


def _reading(
    person: Person,
    motion: Motion,
    m: Measures,
    mood: Mood,
    rng: np.random.Generator,
    side: str,
    share: Float[ndarray, " n"],
) -> Motion:
    """The phone before the chest, the eyes on it; at times the other hand types."""
    outward = 1.0 if side == "l" else -1.0
    chest = upright_chest(person, motion)
    high = rng.uniform(-0.02, 0.14)
    typing = toss(rng, 0.4)
    out = (0.05 if typing else rng.uniform(0.03, 0.12)) * outward
    at = np.array([m.front(high) + rng.uniform(0.14, 0.22), out, high])
    T = pose((-0.75, -0.25 * outward, 0.65), (-0.55, 0.35 * outward, -0.75), at)
    shaky = chest @ T
    shaky[:, :3, 3] += 0.006 * np.stack([wander(mood.times_s, rng, 2.0) for _ in range(3)], axis=1)
    paths = [HandPath(side, shaky, share, (0.5, 0.6, 0.6))]
    if typing:
        other = "r" if side == "l" else "l"
        tap = chest @ pose(
            (0.3, 0.6 * outward, -0.6),
            (-0.5, -0.8 * outward, -0.35),
            at + [-0.01, -outward * 0.10, -0.01],
        )
        tap[:, 2, 3] += 0.006 * wander(mood.times_s, rng, 0.5)
        paths.append(HandPath(other, tap, share, (0.5, 0.5, 0.5)))
    motion = reach(person, motion, paths)
    place = palm_path(person, motion, side)[:, :3, 3]
    looks = share * (0.9 - 0.5 * envelope(mood.times_s, spans(rng, mood.duration_s, (0.8, 1.6),
                                                              (2.0, 5.0)), 0.3))  # fmt: skip
    return look_at(person, motion, place, looks)


def drinking(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Hold a cup or a bottle, lift it to the lips, tip it and the head, lower it."""
    m, side = measure(person), pick(rng, *SIDES)
    outward = 1.0 if side == "l" else -1.0
    kind = "bottle" if "bottle" in things and toss(rng, 0.4) else "cup"
    thing, mood = draw_thing(things, kind, rng), draw_mood(rng, duration_s, glances=0.7)
    sips = spans(rng, duration_s, (2.9, 4.8), (0.4, 2.5))
    ease = 1.15 / mood.tempo
    up = envelope(mood.times_s, sips, ease)
    tip = envelope(mood.times_s, [(a + 0.75 * ease, b - 0.75 * ease) for a, b in sips], 0.5)
    waist, face = sided(side, CARRYING), sided(side, TO_FACE)
    instead = {name: waist[name] + up * (face[name] - waist[name]) for name in waist}
    back = rng.uniform(5.0, 16.0) * tip
    curves = {"head_flexion": -0.6 * back, "neck_flexion": -0.4 * back}
    script = mood.script(*shifting(rng, duration_s), curves=curves, instead=instead)
    motion = perform(person, script)
    chest = upright_chest(person, motion)
    high = rng.uniform(-0.14, 0.02)
    at = (m.front(high) + rng.uniform(0.08, 0.18), outward * rng.uniform(0.04, 0.16), high)
    rest = chest @ pose((0.15, -outward, 0.0), (-0.95, 0.2 * outward, -0.15), at)
    head = frame_path(person, motion, "head")
    head[:, :3, 3] = frame_path(person, motion, "head_center")[:, :3, 3]
    T_palm_place, T_thing_place = upright_in_fist(side), place_of(thing, "handle")
    lips = head @ _at_lips(thing, T_palm_place, T_thing_place, outward)
    angle = np.radians(rng.uniform(30.0, 55.0) if kind == "cup" else rng.uniform(55.0, 80.0)) * tip
    lips = _tipped(lips, head, angle)
    goal = mix(rest, lips, minimum_jerk(up))
    motion = reach(person, motion, [HandPath(side, goal, np.ones(len(up)), (0.5, 0.4, 0.5))])
    Ts = in_hand(person, motion, side, T_palm_place, T_thing_place)
    return Performance("drinking", motion, (Prop(thing, Ts, held=True),))


def _at_lips(
    thing: Thing,
    T_palm_place: Float[ndarray, "4 4"],
    T_thing_place: Float[ndarray, "4 4"],
    outward: float,
) -> Float[ndarray, "4 4"]:
    """T_head_palm when the near edge of the upright thing's rim touches the lips."""
    top = thing.mesh.vertices[:, 2].max()
    rim = thing.mesh.vertices[thing.mesh.vertices[:, 2] > top - 0.01]
    away = T_thing_place[:3, 2]
    T = np.eye(4)
    to_hand = np.array([0.9, 0.5 * outward, 0.0])
    turn = np.arctan2(to_hand[1], to_hand[0]) - np.arctan2(away[1], away[0])
    c, s = np.cos(turn), np.sin(turn)
    T[:3, :3] = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    near = rim @ T[:3, :3].T
    T[:3, 3] = LIPS - [near[:, 0].min(), 0.5 * (near[:, 1].min() + near[:, 1].max()), top]
    T_palm_thing = T_palm_place @ np.linalg.inv(T_thing_place)
    return T @ np.linalg.inv(T_palm_thing)


def _tipped(
    palms: Float[ndarray, "n 4 4"], head: Float[ndarray, "n 4 4"], angle_rad: Float[ndarray, " n"]
) -> Float[ndarray, "n 4 4"]:
    """Palms turned about the lips, the far side up."""
    out = palms.copy()
    for T, T_head, angle in zip(out, head, angle_rad, strict=True):
        c, s = np.cos(angle), np.sin(angle)
        about = T_head[:3, :3] @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ T_head[:3, :3].T
        lips = T_head[:3, :3] @ LIPS + T_head[:3, 3]
        T[:3, :3] = about @ T[:3, :3]
        T[:3, 3] = lips + about @ (T[:3, 3] - lips)
    return out

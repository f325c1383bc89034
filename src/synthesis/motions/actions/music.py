# SPDX-License-Identifier: Apache-2.0
"""Playing a guitar, standing or seated: one hand moves along the neck, the other strums."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.actions.frames import draw_thing, place_of, pose, through, upright_chest
from synthesis.motions.actions.idling import shifting
from synthesis.motions.actions.mood import draw_mood, envelope, spans, toss, wander
from synthesis.motions.actions.seat import draw_seated, seat_in_world
from synthesis.motions.arms import arm
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import HandPath, reach
from synthesis.motions.measures import Measures, measure
from synthesis.motions.motion import perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.poses import sided
from synthesis.objects.thing import Thing
from synthesis.people.person import Person

BELOW_NECK_M = 0.008
"""How far the fretting palm lies below the middle of the neck [m]."""
BEFORE_STRINGS_M = 0.015
"""How far the plucking palm lies before them [m]."""


def guitar(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Play; most fret with the left hand, some with the right."""
    m, mood = measure(person), draw_mood(rng, duration_s, glances=0.5)
    thing = draw_thing(things, "guitar", rng)
    fret, pluck = ("l", "r") if toss(rng, 0.9) else ("r", "l")
    o = 1.0 if fret == "l" else -1.0
    sits = toss(rng, 0.5)
    t = mood.times_s
    beat_hz = rng.uniform(1.1, 2.3) * mood.tempo
    playing = envelope(t, spans(rng, duration_s, (3.0, 9.0), (0.0, 1.2)), 0.5)
    arms = sided(fret, arm((0.25, 0.45, -1.0), (0.55, 0.25, 0.75), pronation_deg=-65.0)) | sided(
        pluck, arm((0.10, 0.55, -0.9), (0.85, -0.55, -0.1))
    )
    rock = np.sin(2.0 * np.pi * 0.5 * beat_hz * t) * playing
    curves = {
        "spine_lateral": rng.uniform(0.0, 2.0) * rock,
        "chest_flexion": rng.uniform(-1.5, 1.5) * np.roll(rock, 3),
        "head_flexion": rng.uniform(0.0, 3.5) * np.sin(2.0 * np.pi * beat_hz * t) * playing,
        "spine_flexion": np.full(len(t), rng.uniform(0.0, 8.0)),
    }
    props = []
    if sits:
        seated = draw_seated(person, rng, mood, things)
        mood = replace(mood, stance=seated.stance)
        motion = perform(person, mood.script(start=seated.pose | arms, curves=curves))
        Ts_seat = seat_in_world(seated, np.eye(4), len(t))
        props.append(Prop(seated.seat, Ts_seat, held=False))
    else:
        script = mood.script(*shifting(rng, duration_s), start=arms, curves=curves)
        motion = perform(person, script)
    chest = upright_chest(person, motion, 0.08)
    T_chest_guitar = _slung(m, thing, rng, o, sits)
    Ts = chest @ T_chest_guitar
    fretting, plucking = _hands(thing, rng, mood.times_s, o, playing, beat_hz)
    share = np.ones(len(t))
    paths = [
        HandPath(fret, Ts @ fretting, share, (0.3, 0.4, 0.3)),
        HandPath(pluck, Ts @ plucking, share, (0.4, 0.6, 0.6)),
    ]
    motion = reach(person, motion, paths)
    look = envelope(t, spans(rng, duration_s, (1.0, 4.0), (0.5, 3.0)), 0.5)
    motion = look_at(person, motion, (Ts @ place_of(thing, "neck"))[:, :3, 3], 0.75 * look)
    return Performance("guitar", motion, (Prop(thing, Ts, held=True), *props))


def _slung(
    m: Measures, thing: Thing, rng: np.random.Generator, o: float, sits: bool
) -> Float[ndarray, "4 4"]:
    """T_chest_guitar: its back against the belly, the neck up and to the fretting side `o`."""
    strings, neck = place_of(thing, "strings"), place_of(thing, "neck")
    face = np.array([1.0, o * rng.uniform(0.0, 0.15), rng.uniform(0.05, 0.3)])
    along = np.array([rng.uniform(0.05, 0.3), o, rng.uniform(0.25, 0.6)])
    R = pose(face, along, np.zeros(3))[:3, :3]
    own = neck[:3, 3] - strings[:3, 3]
    own_R = pose(strings[:3, 0], own, np.zeros(3))[:3, :3]
    turn = R @ own_R.T
    high = rng.uniform(0.03, 0.08) if sits else rng.uniform(-0.10, 0.03)
    depth = strings[0, 3] - thing.mesh.vertices[:, 0].min()
    near = max(m.front(high + dz) for dz in (-0.15, -0.08, 0.0, 0.08))
    at = np.array([near + depth - 0.02, -o * rng.uniform(0.05, 0.11), high])
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turn, at - turn @ strings[:3, 3]
    return T


def _hands(
    thing: Thing,
    rng: np.random.Generator,
    times_s: Float[ndarray, " n"],
    o: float,
    playing: Float[ndarray, " n"],
    beat_hz: float,
) -> tuple[Float[ndarray, "n 4 4"], Float[ndarray, "n 4 4"]]:
    """T_guitar_palm of the fretting and of the plucking hand, each shape (N, 4, 4)."""
    strings, neck = place_of(thing, "strings"), place_of(thing, "neck")
    out = strings[:3, 0]
    along = neck[:3, 3] - strings[:3, 3]
    length = float(np.linalg.norm(along))
    along /= length
    over = o * np.cross(out, along)
    knots, t = [], 0.0
    while t < times_s[-1] + 2.0:
        slid = along * rng.uniform(-0.28, 0.12) * length
        at = neck[:3, 3] + slid - BELOW_NECK_M * over
        facing = 0.5 * over - 0.7 * out
        T = pose(facing, 0.15 * out - 0.9 * over + rng.uniform(-0.2, 0.3) * along, at)
        knots += [(t, T), (t + rng.uniform(0.3, 1.6), T)]
        t = knots[-1][0] + rng.uniform(0.25, 0.5)
    fretting = through(knots, times_s)
    stroke = rng.uniform(0.018, 0.045) * playing
    stroke = stroke * (1.0 + 0.2 * wander(times_s, rng, 2.0))
    across = stroke * np.sin(2.0 * np.pi * beat_hz * times_s)
    drift = 0.012 * wander(times_s, rng, 5.0)
    base = pose(-out, 0.15 * out - 0.75 * along - 0.55 * over, strings[:3, 3])
    plucking = np.tile(base, (len(times_s), 1, 1))
    plucking[:, :3, 3] += BEFORE_STRINGS_M * out + across[:, None] * over + drift[:, None] * along
    return fretting, plucking

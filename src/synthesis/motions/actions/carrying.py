# SPDX-License-Identifier: Apache-2.0
"""Walking with a case at the side or pulled behind, and carrying a box before the belly."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from synthesis.motions.actions.frames import (
    along_z,
    draw_thing,
    extent,
    place_of,
    pose,
    upright_chest,
)
from synthesis.motions.actions.idling import shifting
from synthesis.motions.actions.mood import draw_mood, pick, toss, wander
from synthesis.motions.actions.walks import draw_walk
from synthesis.motions.arms import arm
from synthesis.motions.curves import smooth
from synthesis.motions.holding import HandPath, palm_path, reach
from synthesis.motions.measures import Measures, measure
from synthesis.motions.motion import RATE_HZ, Motion, perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.placing import moved
from synthesis.motions.poses import CARRYING, Pose, both
from synthesis.objects.thing import Thing
from synthesis.people.person import SIDES, Person

BAR_IN_FIST_M = 0.012
"""How far below the palm's middle, towards the fingers, a bar lies in the fist [m]."""
STEEPEST_RAD, FLATTEST_RAD = np.radians(8.0), np.radians(65.0)
"""How far a pulled case leans."""
TILTS = 24
"""Halvings of the search for the lean at which a pulled case touches the floor."""


def walking_with_suitcase(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Walk with a case in one hand; a trolley is pulled if there is one, at times."""
    pulled = "trolley" in things and toss(rng)
    thing = draw_thing(things, "trolley" if pulled else "suitcase", rng)
    side = pick(rng, *SIDES)
    outward = 1.0 if side == "l" else -1.0
    m = measure(person)
    walk = draw_walk(person, rng, duration_s, (0.7, 1.0))
    T_handle = place_of(thing, "handle")
    free = tuple(s for s in SIDES if s != side)
    lean = float(rng.uniform(1.0, 5.0))
    if pulled:
        rest = arm((-0.45, 0.22, -1.0), (-0.35, 0.15, -1.0), pronation_deg=50.0)
        motion = walk.performed(person, free, lean, hold={side: rest})
        chest = upright_chest(person, motion, 0.12)
        down = -(m.pelvis_chest[2] + rng.uniform(-0.02, 0.06))
        at = (-rng.uniform(0.22, 0.32), outward * (m.half_width_m + rng.uniform(0.05, 0.12)), down)
        goal = chest @ pose((-0.8, -0.5 * outward, -0.2), (0.45, 0.05 * outward, 1.0), at)
        share = np.full(len(motion.q), 1.0)
        motion = reach(person, motion, [HandPath(side, goal, share, (0.5, 0.5, 0.5))])
        Ts = _pulled(person, motion, side, thing, T_handle)
    else:
        rest = arm((0.0, 0.24, -1.0), (0.08, 0.13, -1.0), pronation_deg=10.0)
        motion = walk.performed(person, free, lean, hold={side: rest})
        motion = _beside(person, motion, m, side, extent(thing)[0])
        Ts = _hanging(person, motion, side, T_handle)
    prop = Prop(thing, Ts, held=True)
    return moved(Performance("walking_with_suitcase", motion, (prop,)), walk.T_world_start)


def _beside(person: Person, motion: Motion, m: Measures, side: str, thick_m: float) -> Motion:
    """The arm hangs nearly straight, so far out that a case of a thickness misses the thigh."""
    outward = 1.0 if side == "l" else -1.0
    chest = upright_chest(person, motion, 0.08)
    down = m.shoulder[2] - 0.99 * (m.arm_m + 0.06)
    out = max(m.shoulder[1] + 0.06, m.half_width_m + 0.02 + 0.5 * thick_m)
    goal = chest @ pose((0.0, -outward, 0.0), (0.0, 0.0, 1.0), (0.02, outward * out, down))
    share = np.full(len(motion.q), 1.0)
    return reach(person, motion, [HandPath(side, goal, share, (0.3, 0.3, 1.0))])


def _hanging(
    person: Person, motion: Motion, side: str, T_thing_handle: Float[ndarray, "4 4"]
) -> Float[ndarray, "n 4 4"]:
    """A case that hangs from a hand: upright, its bar along the way the person looks.

    It swings a little with the hand's acceleration, as a pendulum that follows at once.
    """
    palm = palm_path(person, motion, side)
    grip = palm[:, :3, 3] - BAR_IN_FIST_M * palm[:, :3, 2]
    heading = upright_chest(person, motion, 0.3)
    yaw = np.unwrap(np.arctan2(heading[:, 1, 0], heading[:, 0, 0]))
    bar = T_thing_handle[:3, 1]
    own = np.arctan2(bar[1], bar[0])
    upright = along_z(grip, yaw - own)
    speed = np.gradient(smooth(grip, RATE_HZ, 0.1), 1.0 / RATE_HZ, axis=0)
    pull = smooth(np.gradient(speed, 1.0 / RATE_HZ, axis=0), RATE_HZ, 0.15) / 9.81
    swing = np.clip(np.column_stack([pull[:, 1], -pull[:, 0], 0.0 * pull[:, 0]]), -0.2, 0.2)
    turned = upright.copy()
    turned[:, :3, :3] = Rotation.from_rotvec(0.5 * swing).as_matrix() @ upright[:, :3, :3]
    to_handle = np.eye(4)
    to_handle[:3, 3] = -T_thing_handle[:3, 3]
    return turned @ to_handle


def _pulled(
    person: Person, motion: Motion, side: str, thing: Thing, T_handle: Float[ndarray, "4 4"]
) -> Float[ndarray, "n 4 4"]:
    """A trolley behind the hand, leaning towards it, its wheels on the floor.

    Its back, where the bar is, looks the way the person walks. The heading trails the hand as a
    cart's does.
    """
    palm = palm_path(person, motion, side)
    grip = palm[:, :3, 3] - BAR_IN_FIST_M * palm[:, :3, 2]
    heading = upright_chest(person, motion, 0.25)
    yaw = np.unwrap(np.arctan2(heading[:, 1, 0], heading[:, 0, 0])) + np.pi
    v = thing.mesh.vertices - T_handle[:3, 3]
    low = v[v[:, 2] < v[:, 2].min() + 0.1]
    out = along_z(grip, yaw)
    for T in out:
        upper, lower = FLATTEST_RAD, STEEPEST_RAD
        for _ in range(TILTS):
            lean = 0.5 * (upper + lower)
            height = (low @ _leaning(lean)[2]).min() + T[2, 3]
            upper, lower = (lean, lower) if height > 0.0 else (upper, lean)
        T[:3, :3] = T[:3, :3] @ _leaning(upper)
    to_handle = np.eye(4)
    to_handle[:3, 3] = -T_handle[:3, 3]
    return out @ to_handle


def _leaning(angle_rad: float) -> Float[ndarray, "3 3"]:
    """Rotation that tips a thing over backwards, its top towards -x."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def on_sides(
    Ts_world_box: Float[ndarray, "n 4 4"], thing: Thing
) -> dict[str, Float[ndarray, "n 4 4"]]:
    """Palms on the sides of a box, fingers forward and down, by side."""
    out = {}
    for side, name in (("l", "left"), ("r", "right")):
        T = place_of(thing, name)
        facing = -T[:3, 2]
        out[side] = Ts_world_box @ pose(facing, np.array([-0.75, 0.0, 0.65]), T[:3, 3])
    return out


def hold_box(
    person: Person,
    motion: Motion,
    Ts_world_box: Float[ndarray, "n 4 4"],
    thing: Thing,
    share: Float[ndarray, " n"],
) -> Motion:
    """Both palms on the sides of a box wherever it is."""
    palms = on_sides(Ts_world_box, thing)
    paths = [HandPath(side, palms[side], share, (0.15, 0.8, 0.8)) for side in SIDES]
    return reach(person, motion, paths)


def before_belly(
    m: Measures, thing: Thing, height_m: float, away_m: float = 0.015
) -> Float[ndarray, "4 4"]:
    """T_chest_box of a box carried before the trunk.

    Args:
        m: The person's measures.
        thing: The box.
        height_m: Height of the middle of its sides above the chest's origin [m].
        away_m: Gap to the trunk [m].
    """
    grip = 0.5 * (place_of(thing, "left") + place_of(thing, "right"))[:3, 3]
    T = np.eye(4)
    low, high = height_m - grip[2], height_m - grip[2] + extent(thing)[2]
    front = max(m.front(z) for z in np.linspace(low, high, 6))
    T[:3, 3] = [front + away_m - thing.mesh.vertices[:, 0].min(), -grip[1], low]
    return T


def carrying_height(m: Measures, thing: Thing, rng: np.random.Generator) -> float:
    """Height of the hands above the chest's origin at which a box is comfortable [m]."""
    return float(min(rng.uniform(-0.14, 0.0), m.shoulder[2] - 0.30 * extent(thing)[2] - 0.12))


def carrying_box(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Carry a box before the belly, standing or walking."""
    thing, m = draw_thing(things, "box", rng), measure(person)
    hold: dict[str, Pose] = {side: CARRYING for side in SIDES}
    T_world_start = np.eye(4)
    if toss(rng, 0.65):
        walk = draw_walk(person, rng, duration_s, (0.7, 1.0), glances=0.4)
        motion = walk.performed(person, (), -float(rng.uniform(0.0, 4.0)), hold=hold)
        T_world_start = walk.T_world_start
    else:
        mood = draw_mood(rng, duration_s, glances=0.7)
        script = mood.script(*shifting(rng, duration_s), start=both(CARRYING))
        motion = perform(person, script)
    chest = upright_chest(person, motion, 0.1)
    Ts = chest @ before_belly(m, thing, carrying_height(m, thing, rng))
    Ts[:, 2, 3] += 0.012 * wander(motion.times_s, rng)
    motion = hold_box(person, motion, Ts, thing, np.ones(len(motion.q)))
    performance = Performance("carrying_box", motion, (Prop(thing, Ts, held=True),))
    return moved(performance, T_world_start)

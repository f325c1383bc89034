# SPDX-License-Identifier: Apache-2.0
"""Bending down, with the knees or with the back, and lifting a box from the floor."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import maximum_filter1d

from synthesis.motions.actions.carrying import (
    before_belly,
    carrying_height,
    hold_box,
    on_sides,
)
from synthesis.motions.actions.frames import (
    draw_thing,
    mix,
    upright_chest,
)
from synthesis.motions.actions.mood import Mood, draw_mood, envelope
from synthesis.motions.arms import arm
from synthesis.motions.curves import minimum_jerk, smooth
from synthesis.motions.gaze import look_at
from synthesis.motions.holding import frame_path
from synthesis.motions.legs import LEG_HINGES
from synthesis.motions.measures import Measures, measure
from synthesis.motions.motion import RATE_HZ, Motion, Script, perform
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.placing import floor_pose
from synthesis.motions.poses import CARRYING, Pose, both, still
from synthesis.objects.thing import Thing
from synthesis.people.person import SIDES, Person

STOOP = {
    "pelvis_drop": 0.20,
    "pelvis_forward": -0.20,
    "pelvis_pitch": 52.0,
    "spine_flexion": 30.0,
    "chest_flexion": 18.0,
    "neck_flexion": -8.0,
}
"""Down with the back, per unit of depth."""
CROUCH = {
    "pelvis_drop": 0.50,
    "pelvis_forward": -0.22,
    "pelvis_pitch": 28.0,
    "spine_flexion": 26.0,
    "chest_flexion": 16.0,
    "neck_flexion": -12.0,
}
"""Down with the knees, per unit of depth."""
DEPTHS = np.linspace(0.35, 1.15, 9)
"""Depths that are tried until the hands reach low enough."""
KNEES = (1.0, 0.6, 0.3, 0.0)
"""Shares of the preferred bend of the knees that are tried in turn."""
SPARE_RAD = 0.03
"""How far inside their limits the legs' hinges stay in a bend [rad]."""
BOXES = 8
"""How many boxes are drawn until one can be reached where it stands."""
FOOT_M = 0.03
"""Lowest part of a box, by which it stands before the toes [m]."""
COMFORT = 0.91
"""Share of the straight arm with which somebody lifts from the floor."""


def down(depth: float, knees: float) -> dict[str, float]:
    """Bend down by a depth, with the knees (1), with the back (0), or between."""
    return {name: depth * (knees * CROUCH[name] + (1.0 - knees) * STOOP[name]) for name in CROUCH}


def deep_enough(
    person: Person, mood: Mood, m: Measures, knees: float, palms: Mapping[str, ndarray]
) -> tuple[dict[str, float], bool]:
    """The shallowest bend from which both arms reach the palms' places and both feet the floor.

    Args:
        person: Who.
        mood: Their posture.
        m: Their measures.
        knees: Preferred way of bending, see `down`; less with the knees if it must be.
        palms: T_world_palm by side.

    Returns:
        Pelvis and trunk of the bend, and whether the arms reach.
    """
    nearest, best = np.inf, down(float(DEPTHS[0]), knees)
    for share in KNEES:
        for depth in DEPTHS:
            bend = down(float(depth), share * knees)
            channels = {**mood.script(start=bend).keys}
            for name, values in mood.curves.items():
                channels[name] = ((0.0, channels.get(name, ((0.0, 0.0),))[0][1] + values[0]),)
            motion = perform(person, Script(1.0 / RATE_HZ, channels, (), mood.stance))
            if not stands(person, motion):
                break
            far = max(
                float(np.linalg.norm(T[:3, 3] - _shoulder(person, motion, side)))
                for side, T in palms.items()
            )
            if far < nearest:
                nearest, best = far, bend
            if far < COMFORT * (m.arm_m + 0.05):
                return bend, True
    return best, False


def stands(person: Person, motion: Motion) -> bool:
    """Whether both feet stand flat in the first frame, with some room in every hinge."""
    legs = [person.body.dof(f"{s}_{hinge}") for s in SIDES for hinge in LEG_HINGES]
    angles, lower, upper = motion.q[0, np.array(legs) + 1], person.body.lower, person.body.upper
    if min((angles - lower[legs]).min(), (upper[legs] - angles).min()) < SPARE_RAD:
        return False
    flat = [frame_path(person, motion, f"{side}_foot")[0, 2, :3] for side in SIDES]
    return bool(max(np.abs(row - [0.0, 0.0, 1.0]).max() for row in flat) < 1e-3)


def _shoulder(person: Person, motion: Motion, side: str) -> Float[ndarray, " 3"]:
    """Shoulder's centre in the first frame [m]."""
    return frame_path(person, motion, f"{side}_upper_arm")[0, :3, 3]


def bending_and_lifting(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Pick a box up from the floor, hold it, and put it down again."""
    m, mood = measure(person), draw_mood(rng, duration_s, glances=0.3, slouch=0.6)
    mood = mood.standing(narrower_m=float(rng.uniform(-0.12, -0.02)))
    tempo = mood.tempo * max(1.0, 4.0 / duration_s)
    t = float(rng.uniform(0.1, 0.5))
    for _ in range(BOXES):
        thing = draw_thing(things, "box", rng)
        foot = thing.mesh.vertices[thing.mesh.vertices[:, 2] < FOOT_M, 0]
        ahead = rng.uniform(0.20, 0.26) - float(foot.min())
        aside, turned = float(rng.normal(0.0, 0.03)), float(rng.normal(0.0, 0.08))
        T_floor = floor_pose(ahead, aside, turned)
        palms = {side: T[0] for side, T in on_sides(T_floor[None], thing).items()}
        bend, reached = deep_enough(person, mood, m, float(rng.uniform(0.2, 1.0)), palms)
        if reached:
            break
    down_s, up_s = rng.uniform(1.1, 1.5) / tempo, rng.uniform(1.2, 1.7) / tempo
    grab_s, put_s = 0.25 / tempo, 0.25 / tempo
    timed: list[tuple[float, Pose]] = []
    lifts: list[tuple[float, float]] = []
    hands: list[tuple[float, float]] = []
    reaching_down = both(_dangling(bend))
    hanging = {name: mood.hang[name] for name in reaching_down}
    while True:
        takes = t + down_s
        up = takes + grab_s + up_s
        back = up + rng.uniform(0.4, 2.0)
        sets = back + up_s
        rises = sets + put_s + down_s
        keeps = rises > duration_s
        timed += [(t, still(bend) | hanging), (takes, bend | reaching_down)]
        timed += [(takes + grab_s, bend | reaching_down), (up, still(bend) | both(CARRYING))]
        lifts.append((takes + 0.7 * grab_s, duration_s + 1.0 if keeps else sets + 0.3 * put_s))
        hands.append((t + 0.2 * down_s, duration_s + down_s if keeps else rises - 0.2 * down_s))
        if keeps:
            break
        timed += [(back, still(bend) | both(CARRYING)), (sets, bend | reaching_down)]
        timed += [(sets + put_s, bend | reaching_down)]
        timed += [(rises, still(bend) | hanging)]
        t = rises + rng.uniform(0.2, 0.9)
        if t + down_s + grab_s + up_s + 0.3 > duration_s:
            break
    motion = perform(person, mood.script(*timed))
    times_s = motion.times_s
    chest = upright_chest(person, motion, 0.1)
    held = before_belly(m, thing, carrying_height(m, thing, rng))
    Ts, off_floor = _lifted(chest, T_floor, held, lifts, times_s)
    Ts[:, :3, 3] += off_floor[:, None] * _into_reach(person, motion, m, Ts, thing)
    Ts[:, 2, 3] = np.maximum(Ts[:, 2, 3], 0.0)
    share = envelope(times_s, hands, 0.75 * down_s)
    motion = hold_box(person, motion, Ts, thing, share)
    looks = envelope(times_s, hands, 0.5)
    motion = look_at(person, motion, Ts[:, :3, 3] + [0.0, 0.0, 0.2], 0.5 * looks)
    return Performance("bending_and_lifting", motion, (Prop(thing, Ts, held=True),))


def _dangling(bend: Pose) -> Pose:
    """An arm that points down and a little forward from a trunk that is bent."""
    lean = np.radians(bend["pelvis_pitch"] + bend["spine_flexion"] + bend["chest_flexion"])
    c, s = np.cos(lean), np.sin(lean)
    upper, lower = (0.15, -1.0), (0.45, -1.0)
    return arm(
        upper=(c * upper[0] - s * upper[1], 0.22, s * upper[0] + c * upper[1]),
        forearm=(c * lower[0] - s * lower[1], 0.05, s * lower[0] + c * lower[1]),
    )


def _lifted(
    chest: Float[ndarray, "n 4 4"],
    T_floor: Float[ndarray, "4 4"],
    T_chest_held: Float[ndarray, "4 4"],
    lifts: list[tuple[float, float]],
    times_s: Float[ndarray, " n"],
) -> tuple[Float[ndarray, "n 4 4"], Float[ndarray, " n"]]:
    """A box that goes with the chest while it is held, and comes to the belly as the chest rises.

    Args:
        chest: Upright frames of the chest.
        T_floor: Where the box stands.
        T_chest_held: Where it is carried.
        lifts: From when the hands have the box until they set it down [s].
        times_s: Time of each frame [s], shape (N,).

    Returns:
        T_world_box (N, 4, 4), and 0 where the box stands to 1 where it is well off the floor (N,).
    """
    Ts, off = np.tile(T_floor, (len(times_s), 1, 1)), np.zeros(len(times_s))
    for start, end in lifts:
        inside = np.flatnonzero((times_s >= start) & (times_s <= end))
        if len(inside) < 2:
            continue
        z = chest[inside, 2, 3]
        top = inside[int(z.argmax())]
        down_again = inside[-1] < len(times_s) - 1
        for part, at in ((inside[inside <= top], inside[0]), (inside[inside > top], inside[-1])):
            if len(part) == 0:
                continue
            rise = chest[top, 2, 3] - chest[at, 2, 3]
            share = np.clip((chest[part, 2, 3] - chest[at, 2, 3]) / max(rise, 0.05), 0.0, 1.0)
            if at == inside[-1] and not down_again:
                share = np.ones(len(part))
            T_near = np.linalg.inv(chest[at]) @ T_floor
            count = (len(part), 1, 1)
            relative = mix(np.tile(T_near, count), np.tile(T_chest_held, count), share)
            Ts[part] = chest[part] @ relative
            off[part] = minimum_jerk(8.0 * share)
    return Ts, off


def _into_reach(
    person: Person,
    motion: Motion,
    m: Measures,
    Ts_world_box: Float[ndarray, "n 4 4"],
    thing: Thing,
) -> Float[ndarray, "n 3"]:
    """How far a box must come towards the shoulders so that both arms reach it [m]."""
    shift = np.zeros((len(Ts_world_box), 3))
    for side, palms in on_sides(Ts_world_box, thing).items():
        shoulder = frame_path(person, motion, f"{side}_upper_arm")[:, :3, 3]
        way = shoulder - palms[:, :3, 3]
        far = np.linalg.norm(way, axis=1)
        excess = np.maximum(far - COMFORT * (m.arm_m + 0.05), 0.0)
        wide = smooth(maximum_filter1d(excess, 5, mode="nearest"), RATE_HZ, 0.06)
        shift += 0.7 * (wide / far)[:, None] * way
    return shift

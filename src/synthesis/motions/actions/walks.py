# SPDX-License-Identifier: Apache-2.0
"""Walking towards, away, across, along curves, and back and forth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import leg_length
from synthesis.motions.actions.mood import Mood, draw_mood, pick, toss
from synthesis.motions.arms import arm
from synthesis.motions.curves import keyed
from synthesis.motions.footwork import Gait, Step
from synthesis.motions.motion import RATE_HZ, Motion, perform
from synthesis.motions.performance import Performance
from synthesis.motions.placing import floor_pose, moved
from synthesis.motions.poses import Pose, sided
from synthesis.motions.stepping import steps_along, steps_turning
from synthesis.people.person import SIDES, Person

LONGEST_M = 3.6
"""Longest stretch without turning round, so that a walk fits before a camera [m]."""
PATHS = ("toward", "away", "across", "curve", "back_and_forth")
"""Kinds of path; the camera is looked for along x."""
HEADINGS_DEG = {"toward": (0.0, 25.0), "away": (180.0, 25.0), "across": (90.0, 20.0)}
"""Mean and standard deviation of the first heading."""


@dataclass(frozen=True)
class Walk:
    """A walk before it is performed."""

    mood: Mood
    """Who walks, in what mood."""
    steps: tuple[Step, ...]
    """Steps."""
    gait: Gait
    """How they are made."""
    brisk: float
    """Speed of the walk, 1 = usual."""
    T_world_start: Float[ndarray, "4 4"]
    """Where the walk starts, so that its middle lies at the origin."""

    def performed(self, person: Person, arms: Sequence[str] = SIDES, lean_deg: float = 0.0, *,
                  hold: Mapping[str, Pose] | None = None) -> Motion:  # fmt: skip
        """The motion, from the walk's own start.

        Args:
            person: Who.
            arms: Sides that swing freely.
            lean_deg: How far the trunk leans forward.
            hold: Pose of each arm that does not swing.
        """
        times_s, duration_s = self.mood.times_s, self.mood.duration_s
        beat = stride(self.steps, duration_s, times_s)
        big = self.brisk * np.abs(beat).max(initial=0.0)
        instead: dict[str, Float[ndarray, " n"]] = {}
        for side in SIDES:
            if side in arms:
                instead |= self._swing(side, beat if side == "l" else -beat)
            else:
                instead |= {
                    name: np.full(len(times_s), value)
                    for name, value in sided(side, (hold or {})[side]).items()
                }
        free = len(arms) / 2.0
        turn = (3.0 + 3.0 * free) * big * beat
        curves = {
            "pelvis_yaw": 6.0 * big * beat,
            "chest_rotation": -0.6 * turn - 3.5 * big * beat,
            "spine_rotation": -0.4 * turn - 2.5 * big * beat,
            "neck_rotation": turn,
            "pelvis_roll": 2.0 * big * np.gradient(beat, 1.0 / RATE_HZ) / 6.0,
            "spine_lateral": -2.0 * big * np.gradient(beat, 1.0 / RATE_HZ) / 6.0,
            "pelvis_pitch": np.full(len(times_s), 2.0 + 0.3 * lean_deg),
            "spine_flexion": np.full(len(times_s), 0.7 * lean_deg),
            "neck_flexion": np.full(len(times_s), -0.5 * lean_deg),
        }
        script = self.mood.script(steps=self.steps, gait=self.gait, curves=curves, instead=instead)
        return perform(person, script)

    def _swing(self, side: str, beat: Float[ndarray, " n"]) -> dict[str, Float[ndarray, " n"]]:
        """Angles of an arm: forward at beat 1, back at -1, hanging at 0."""
        out = 0.17 + 0.06 * (self.mood.stance.narrower_m < 0.0)
        front = arm((0.38 * self.brisk, out - 0.02, -1), (0.38 * self.brisk + 0.42, 0.02, -1))
        back = arm((-0.42 * self.brisk, out + 0.02, -1), (-0.20 * self.brisk, out, -1))
        rest = {name: self.mood.hang[f"{side}_{name}"] for name in front}
        ahead, behind = np.maximum(beat, 0.0), np.maximum(-beat, 0.0)
        return {
            f"{side}_{name}": rest[name]
            + ahead * (front[name] - rest[name])
            + behind * (back[name] - rest[name])
            for name in front
        }


def stride(
    steps: tuple[Step, ...], duration_s: float, times_s: Float[ndarray, " n"]
) -> Float[ndarray, " n"]:
    """Beat of the walk: 1 when the right foot lands before the left one, -1 the other way round.

    A step swings the arms as much as its foot moves along its heading, full at 1.2 m.
    """
    curve, last = [(0.0, 0.0)], {side: np.zeros(3) for side in SIDES}
    for n, step in enumerate(steps):
        here = np.array([step.forward_m, step.left_m, np.radians(step.yaw_deg)])
        way, last[step.side] = here - last[step.side], here
        along = float(way[:2] @ [np.cos(here[2]), np.sin(here[2])])
        closing = n + 1 < len(steps) and steps[n + 1].start_s > step.end_s + 0.3
        size = 0.0 if closing or n == len(steps) - 1 else np.clip(along / 1.0, 0.0, 1.0)
        if n == 0 or step.start_s > steps[n - 1].end_s + 0.3:
            curve.append((max(step.start_s - 0.15, curve[-1][0] + 0.02), 0.0))
        curve.append((max(step.end_s, curve[-1][0] + 0.02), size * (1 if step.side == "r" else -1)))
    curve.append((max(duration_s, curve[-1][0] + 0.3), 0.0))
    return keyed(curve, times_s, RATE_HZ)


def draw_walk(
    person: Person,
    rng: np.random.Generator,
    duration_s: float,
    speed: tuple[float, float] = (0.75, 1.2),
    glances: float = 0.6,
    kind: str | None = None,
) -> Walk:
    """Draw a path and the steps along it.

    Args:
        person: Who walks.
        rng: Draws.
        duration_s: How long the performance lasts [s].
        speed: Slowest and fastest, 1 = usual.
        glances: How much the walker looks about.
        kind: One of `PATHS`; drawn if None.

    Returns:
        The walk.
    """
    mood = draw_mood(rng, duration_s, glances=glances, slouch=0.8)
    mood = mood.standing(
        narrower_m=float(rng.uniform(0.0, 0.045)),
        toe_out_deg=(float(rng.uniform(2.0, 14.0)), float(rng.uniform(2.0, 14.0))),
        left_ahead_m=0.0,
    )
    kind = pick(rng, *PATHS) if kind is None else kind
    brisk = rng.uniform(*speed)
    length = leg_length(person.body) * rng.uniform(0.68, 0.84) * brisk**0.5
    step_s = 1.0 / (rng.uniform(1.7, 1.95) * brisk**0.5)
    gait = Gait(
        follow_s=0.17,
        weight_shift=rng.uniform(0.15, 0.4),
        heel_off_deg=rng.uniform(48.0, 60.0),
        heel_strike_deg=rng.uniform(13.0, 21.0),
        lift_m=rng.uniform(0.02, 0.05),
        roll_s=0.32,
        land_s=0.11,
        settle_s=0.065,
        glide=0.8,
    )
    steps: list[Step] = []
    t, heading, place = rng.uniform(0.15, 0.6), 0.0, np.zeros(2)
    bend = 0.0
    if kind == "curve":
        bend = rng.uniform(0.35, 0.85) * (1.0 if toss(rng) else -1.0)
    while True:
        room_s = duration_s - t - 0.3
        most = LONGEST_M if bend == 0.0 else 2.0 * LONGEST_M
        count = min(int(room_s / step_s) - 1, int(most / length))
        if count < 1:
            break
        if kind == "back_and_forth":
            count = min(count, int(rng.integers(3, 7)))
        path, end = _path(place, heading, count * length, bend)
        side = pick(rng, *SIDES)
        degrees = float(np.degrees(heading))
        steps += steps_along(person, path, t, length, step_s, mood.stance, side, degrees)
        place, heading, t = path[-1], end, steps[-1].end_s + rng.uniform(0.2, 0.8)
        about = np.pi * (1.0 if toss(rng) else -1.0) + rng.normal(0.0, 0.25)
        pivot_s, parts = step_s * rng.uniform(0.75, 0.95), rng.uniform(58.0, 72.0)
        turning = steps_turning(
            person, np.degrees(heading), np.degrees(heading + about), t, pivot_s, parts,
            mood.stance, (float(place[0]), float(place[1])),
        )  # fmt: skip
        if turning[-1].end_s > duration_s - 1.2:
            break
        steps += turning
        heading, t = heading + about, turning[-1].end_s + rng.uniform(0.05, 0.5)
    spare_s = duration_s - steps[-1].end_s - 0.8 if steps else 0.0
    wait_s = float(rng.uniform(0.0, max(spare_s, 0.0)))
    steps = [replace(s, start_s=s.start_s + wait_s, end_s=s.end_s + wait_s) for s in steps]
    mean, spread = HEADINGS_DEG.get(kind, (0.0, 180.0))
    yaw = np.radians(rng.normal(mean, spread) * (1.0 if toss(rng) else -1.0))
    reached = np.array([[0.0, 0.0]] + [[s.forward_m, s.left_m] for s in steps])
    centre = 0.5 * (reached.min(axis=0) + reached.max(axis=0))
    T = floor_pose(0.0, 0.0, yaw) @ floor_pose(-centre[0], -centre[1], 0.0)
    return Walk(mood, tuple(steps), gait, brisk, T)


def _path(
    place: Float[ndarray, " 2"], heading: float, length_m: float, bend: float
) -> tuple[Float[ndarray, "m 2"], float]:
    """A straight line or an arc that bends by `bend` rad/m, and the heading at its end."""
    s = np.linspace(0.0, length_m, max(2, int(length_m / 0.05)))
    yaw = heading + bend * s
    middle = 0.5 * (yaw[:-1] + yaw[1:])
    ways = np.diff(s)[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
    return place + np.vstack([np.zeros(2), np.cumsum(ways, axis=0)]), float(yaw[-1])


def walking(person: Person, rng: np.random.Generator, duration_s: float, things: Mapping):
    """Walk, turn round where the path ends, and walk on."""
    walk = draw_walk(person, rng, duration_s)
    motion = walk.performed(person, lean_deg=float(rng.uniform(0.0, 5.0)))
    return moved(Performance("walking", motion), walk.T_world_start)

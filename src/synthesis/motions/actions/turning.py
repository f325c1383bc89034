# SPDX-License-Identifier: Apache-2.0
"""Turning away: half and full turns in small steps, with the back to the camera for a while."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from synthesis.motions.actions.mood import draw_mood, toss
from synthesis.motions.footwork import Gait, Step
from synthesis.motions.motion import perform
from synthesis.motions.performance import Performance
from synthesis.motions.poses import Pose
from synthesis.motions.stepping import steps_turning
from synthesis.people.person import Person

FULL_TURN_STEP_DEG = (42.0, 70.0)
"""Smallest and largest turn of a pair of steps [deg]."""


def turning_away(
    person: Person, rng: np.random.Generator, duration_s: float, things: Mapping
) -> Performance:
    """Turn by steps on the spot; the head goes first, arms swing a little, the back stays shown."""
    mood = draw_mood(rng, duration_s, glances=0.6)
    mood = mood.standing(
        narrower_m=float(rng.uniform(-0.04, 0.03)),
        toe_out_deg=(float(rng.uniform(0.0, 12.0)), float(rng.uniform(0.0, 12.0))),
        left_ahead_m=float(rng.normal(0.0, 0.02)),
    )
    t, yaw = float(rng.uniform(0.2, 0.8)), 0.0
    steps: tuple[Step, ...] = ()
    timed: list[tuple[float, Pose]] = []
    while True:
        side = 1.0 if toss(rng) else -1.0
        size = float(rng.choice([90.0, 180.0, 180.0, 180.0, 360.0]))
        size = min(size, 180.0) if duration_s < 6.0 else size
        goal = yaw + side * (size + rng.normal(0.0, 12.0) * (size < 360.0))
        if abs(yaw) > 120.0 and toss(rng):
            goal = float(rng.normal(0.0, 12.0)) + 360.0 * round(yaw / 360.0)
        pace = rng.uniform(0.38, 0.6) / mood.tempo
        largest = float(rng.uniform(*FULL_TURN_STEP_DEG))
        turn = steps_turning(person, yaw, goal, t, pace, largest, mood.stance)
        if not turn:
            break
        if turn[-1].end_s > duration_s - 0.4:
            if steps:
                break
            pace = (duration_s - 0.6 - t) / len(turn)
            turn = steps_turning(person, yaw, goal, t, pace, largest, mood.stance)
        way = float(np.sign(goal - yaw))
        end = turn[-1].end_s
        look = {
            "neck_rotation": way * rng.uniform(6.0, 15.0),
            "head_rotation": way * rng.uniform(10.0, 25.0),
            "chest_rotation": way * rng.uniform(3.0, 12.0),
            "spine_rotation": way * rng.uniform(2.0, 7.0),
            "l_shoulder_elevation": mood.hang["l_shoulder_elevation"] + rng.uniform(0.0, 8.0),
            "r_shoulder_elevation": mood.hang["r_shoulder_elevation"] + rng.uniform(0.0, 8.0),
        }
        level = {name: mood.hang.get(name, 0.0) for name in look}
        timed += [(t - 0.15, level), (t + 0.4 * pace, look)]
        timed += [(max(end - 0.8 * pace, t + 0.5 * pace), look), (end + 0.15, level)]
        steps, yaw = steps + turn, goal
        t = end + rng.uniform(0.6, 3.0)
        if t > duration_s - 1.5:
            break
    gait = Gait(lift_m=float(rng.uniform(0.03, 0.06)), weight_shift=float(rng.uniform(0.25, 0.5)))
    return Performance("turning_away", perform(person, mood.script(*timed, steps=steps, gait=gait)))

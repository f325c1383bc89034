# SPDX-License-Identifier: Apache-2.0
"""Short fixed motions as keys and steps; what varies is in `synthesis.motions.actions`."""

from __future__ import annotations

import numpy as np

from synthesis.motions.footwork import Step
from synthesis.motions.motion import Script
from synthesis.motions.poses import (
    BALANCE,
    FORWARD,
    HANG,
    LEANING,
    LIFTING,
    ON_HIP,
    ON_THIGH,
    OVERHEAD,
    RISE,
    SIDEWAYS,
    SQUAT,
    SWING_BACK,
    SWING_FRONT,
    TOGETHER,
    WAVE_IN,
    WAVE_OUT,
    Pose,
    both,
    keys,
    left,
    right,
    scaled,
    still,
)

SIT = {
    "pelvis_drop": 0.52,
    "pelvis_forward": -0.46,
    "pelvis_pitch": -4.0,
    "spine_flexion": 6.0,
    "chest_flexion": 4.0,
    "neck_flexion": 0.0,
    "head_flexion": 0.0,
}


def arms() -> Script:
    """Arms sideways, overhead, hands together in front, hands on hips, down."""
    poses = (SIDEWAYS, OVERHEAD, SIDEWAYS, TOGETHER, ON_HIP, HANG)
    timed = [(0.4, both(HANG))]
    for n, pose in enumerate(poses):
        timed += [(1.3 + 1.2 * n, both(pose)), (1.6 + 1.2 * n, both(pose))]
    return Script(8.0, keys(*timed))


def squat() -> Script:
    """Two squats with the arms held forward."""
    down, up = SQUAT | both(BALANCE), still(SQUAT) | both(HANG)
    timed: list[tuple[float, Pose]] = []
    for start in (0.4, 3.1):
        timed += [(start, up), (start + 0.5, both(LIFTING)), (start + 1.1, down)]
        timed += [(start + 1.4, down), (start + 2.0, both(LIFTING)), (start + 2.5, up)]
    return Script(6.0, keys(*timed))


def sit() -> Script:
    """Sit down on a seat that is not shown, hands on the thighs, and rise."""
    upright, seated = still(SIT) | both(HANG), SIT | both(ON_THIGH)
    rising = RISE | both(LEANING)
    down = ((0.3, upright), (1.1, rising), (1.9, seated))
    return Script(5.4, keys(*down, (3.2, seated), (4.0, rising), (4.9, upright)))


def walk() -> Script:
    """Four steps towards +x, then two to the left."""
    steps = (
        Step("r", 0.50, 0.95, 0.28, 0.0, 0.0),
        Step("l", 1.10, 1.60, 0.80, 0.0, 0.0),
        Step("r", 1.75, 2.25, 1.32, 0.0, 0.0),
        Step("l", 2.40, 2.85, 1.32, 0.0, 0.0),
        Step("l", 3.30, 3.75, 1.32, 0.28, 0.0),
        Step("r", 3.90, 4.35, 1.32, 0.28, 0.0),
        Step("l", 4.50, 4.95, 1.32, 0.56, 0.0),
        Step("r", 5.10, 5.55, 1.32, 0.56, 0.0),
    )
    return Script(6.0, _striding(steps[:4], keys((3.0, both(HANG)))), steps)


def turn() -> Script:
    """Turn 45 degrees to the left, back, 45 degrees to the right, back, stepping in place."""
    steps, look = [], [(0.3, {"head_rotation": 0.0, "chest_rotation": 0.0})]
    yaw = 0.0
    for n, goal in enumerate((45.0, 0.0, -45.0, 0.0)):
        start = 0.5 + 1.5 * n
        first, second = ("l", "r") if goal > yaw else ("r", "l")
        steps += [
            Step(first, start, start + 0.45, *_turned(first, goal), goal),
            Step(second, start + 0.58, start + 1.03, *_turned(second, goal), goal),
        ]
        sign = float(np.sign(goal - yaw))
        look += [
            (start + 0.2, {"head_rotation": 22.0 * sign, "chest_rotation": 8.0 * sign}),
            (start + 1.2, {"head_rotation": 0.0, "chest_rotation": 0.0}),
        ]
        yaw = goal
    return Script(6.6, keys(*look), tuple(steps))


def demo() -> Script:
    """Wave, reach, bend the knees, step forward, turn the body by 30 degrees and back."""
    bend = scaled(SQUAT, 0.5)
    level = {"pelvis_yaw": 0.0, "spine_rotation": 0.0, "chest_rotation": 0.0, "head_rotation": 0.0}
    turned = {
        "pelvis_yaw": 10.0,
        "spine_rotation": 7.0,
        "chest_rotation": 13.0,
        "head_rotation": 8.0,
    }
    lean = {"chest_rotation": -12.0, "spine_flexion": 6.0}
    timed = [
        (0.15, right(HANG)),
        (0.65, right(WAVE_OUT)),
        (0.85, right(WAVE_IN)),
        (1.05, right(WAVE_OUT)),
        (1.25, right(WAVE_IN)),
        (1.10, left(HANG) | still(lean)),
        (1.42, left(LIFTING)),
        (1.75, right(HANG) | left(FORWARD) | lean),
        (1.80, still(bend)),
        (1.90, left(FORWARD) | lean),
        (2.30, bend),
        (2.20, left(LIFTING)),
        (2.50, left(HANG) | {"chest_rotation": 0.0}),
        (2.85, still(bend)),
        (3.60, level),
        (4.10, turned),
        (4.25, turned),
        (4.80, level),
    ]
    steps = (Step("r", 2.85, 3.25, 0.30, 0.0, 0.0), Step("l", 3.35, 3.75, 0.30, 0.0, 0.0))
    return Script(5.0, keys(*sorted(timed, key=lambda pair: pair[0])), steps)


MOTIONS = {"arms": arms, "squat": squat, "walk": walk, "turn": turn, "sit": sit, "demo": demo}
"""Every script by name."""

HALF_STANCE_M = 0.085
"""Half the distance between the ankles, for feet that step round the body's axis [m]."""


def _turned(side: str, yaw_deg: float) -> tuple[float, float]:
    """Displacement of a foot that is carried round the body's axis [m]."""
    y = HALF_STANCE_M if side == "l" else -HALF_STANCE_M
    yaw = np.radians(yaw_deg)
    return float(-y * np.sin(yaw)), float(y * (np.cos(yaw) - 1.0))


def _striding(
    steps: tuple[Step, ...], ending: dict[str, tuple[tuple[float, float], ...]]
) -> dict[str, tuple[tuple[float, float], ...]]:
    """Keys of arms and trunk that swing against the steps, then `ending`."""
    start: list[tuple[float, Pose]] = [(steps[0].start_s - 0.1, both(HANG))]
    for step in steps[:-1]:
        front, back = (left, right) if step.side == "r" else (right, left)
        sign = 1.0 if step.side == "r" else -1.0
        pose = {
            **front(SWING_FRONT),
            **back(SWING_BACK),
            "pelvis_yaw": 4.0 * sign,
            "chest_rotation": -8.0 * sign,
        }
        start.append((step.end_s, pose))
    start.append((steps[-1].end_s, {"pelvis_yaw": 0.0, "chest_rotation": 0.0}))
    swing = keys(*start)
    return {name: curve + ending.get(name, ())[1:] for name, curve in swing.items()}

# SPDX-License-Identifier: Apache-2.0
"""Postures of arms and trunk, and how keys are made of them."""

from __future__ import annotations

from collections.abc import Mapping

from synthesis.motions.arms import arm

Pose = Mapping[str, float]
"""Value by channel [deg or leg lengths]."""

HANG = arm(upper=(0.02, 0.16, -1), forearm=(0.28, 0.10, -1))
SIDEWAYS = arm(upper=(0.05, 1, 0.0), forearm=(0.2, 1, 0.05), clavicle_deg=10)
OVERHEAD = arm(upper=(0.15, 0.35, 1), forearm=(0.2, -0.05, 1), clavicle_deg=25)
TOGETHER = arm(upper=(0.75, 0.12, -0.8), forearm=(1, -0.50, 0.25), pronation_deg=-10)
ON_HIP = arm(upper=(-0.45, 0.75, -0.9), forearm=(0.42, -0.72, -0.75), pronation_deg=30)
LIFTING = arm(upper=(0.6, 0.15, -0.8), forearm=(0.9, 0.0, -0.3))
BALANCE = arm(upper=(0.8, 0.1, 0.45), forearm=(0.8, 0.0, 0.6), clavicle_deg=5)
LEANING = arm(upper=(0.60, 0.25, -0.8), forearm=(1, -0.05, -0.3), pronation_deg=20)
ON_THIGH = arm(upper=(0.25, 0.28, -1), forearm=(1, -0.22, -0.22), pronation_deg=50)
FORWARD = arm(upper=(0.9, 0.05, -0.15), forearm=(1, -0.08, 0.18), clavicle_deg=8)
WAVE_OUT = arm(upper=(0.3, 0.9, -0.1), forearm=(0.25, 0.5, 1), clavicle_deg=8, pronation_deg=-30)
WAVE_IN = arm(upper=(0.3, 0.9, -0.1), forearm=(0.25, -0.3, 1), clavicle_deg=8, pronation_deg=-30)
SWING_FRONT = arm(upper=(0.36, 0.14, -1), forearm=(0.75, 0.0, -1))
SWING_BACK = arm(upper=(-0.40, 0.18, -1), forearm=(-0.05, 0.12, -1))
CARRYING = arm(upper=(0.22, 0.30, -1), forearm=(1, -0.15, -0.05))
TO_FACE = arm(upper=(0.55, 0.45, -0.75), forearm=(0.35, -0.25, 1))
SQUAT = {
    "pelvis_drop": 0.46,
    "pelvis_forward": -0.20,
    "pelvis_pitch": 26.0,
    "spine_flexion": 14.0,
    "chest_flexion": 6.0,
    "neck_flexion": -8.0,
    "head_flexion": -12.0,
}
RISE = {
    "pelvis_drop": 0.36,
    "pelvis_forward": -0.34,
    "pelvis_pitch": 34.0,
    "spine_flexion": 16.0,
    "chest_flexion": 8.0,
    "neck_flexion": -8.0,
    "head_flexion": -6.0,
}


def both(pose: Pose) -> dict[str, float]:
    """The same angles left and right."""
    return {**left(pose), **right(pose)}


def left(pose: Pose) -> dict[str, float]:
    """Angles of the left side."""
    return {f"l_{name}": angle for name, angle in pose.items()}


def right(pose: Pose) -> dict[str, float]:
    """Angles of the right side."""
    return {f"r_{name}": angle for name, angle in pose.items()}


def sided(side: str, pose: Pose) -> dict[str, float]:
    """Angles of the side `l` or `r`."""
    return left(pose) if side == "l" else right(pose)


def still(pose: Pose) -> dict[str, float]:
    """Upright in the channels of a pose."""
    return dict.fromkeys(pose, 0.0)


def scaled(pose: Pose, factor: float) -> dict[str, float]:
    """A pose taken further or less far."""
    return {name: factor * value for name, value in pose.items()}


def keys(
    *poses: tuple[float, Pose], start: Pose | None = None
) -> dict[str, tuple[tuple[float, float], ...]]:
    """Curves from poses: each pose adds a key to the channels it names.

    Args:
        poses: (time [s], value by channel), times increasing.
        start: Pose at time 0; both arms hang if None. Channels that it lacks start at 0.

    Returns:
        Keys of `Script`.
    """
    first = both(HANG) if start is None else start
    out = {name: [(0.0, value)] for name, value in first.items()}
    for time_s, pose in poses:
        for name, value in pose.items():
            curve = out.setdefault(name, [] if time_s == 0.0 else [(0.0, 0.0)])
            if curve and curve[-1][0] == time_s:
                curve.pop()
            curve.append((time_s, value))
    return {name: tuple(curve) for name, curve in out.items()}

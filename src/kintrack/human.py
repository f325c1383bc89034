# SPDX-License-Identifier: Apache-2.0
"""Body and skin together, and what is known of a pose before any frame is seen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.body import Body, load_body
from kintrack.objective_config import MotionConfig, PriorConfig
from kintrack.skin import Skin, load_skin

RESTING_DEG = {
    "shoulder_elevation": 10.0,
    "elbow_flexion": 15.0,
    "knee_flexion": 5.0,
    "hip_flexion": 3.0,
}
"""Standing at ease [deg]."""
SITTING_DEG = {
    "shoulder_elevation": 15.0,
    "shoulder_plane": 20.0,
    "elbow_flexion": 60.0,
    "hip_flexion": 85.0,
    "knee_flexion": 85.0,
}
"""Sitting on a chair [deg]."""

ARMS_OUT_DEG = {**RESTING_DEG, "shoulder_elevation": 80.0, "shoulder_plane": -25.0}
"""Arms to the sides [deg]."""
ARMS_UP_DEG = {**RESTING_DEG, "shoulder_elevation": 150.0, "clavicle_elevation": 20.0}
"""Arms overhead [deg]."""
REACHING_DEG = {**RESTING_DEG, "shoulder_elevation": 40.0, "shoulder_plane": 55.0}
"""Arms to the front [deg]."""

_TRUNK = ("spine", "chest", "neck", "head", "clavicle")
_TWIST = ("forearm", "wrist", "ankle")


@dataclass(frozen=True)
class Human:
    """A person's kinematic tree and tracking skin."""

    body: Body
    """Kinematic tree."""
    skin: Skin
    """Tracking skin."""
    shape: Float[ndarray, " k"]
    """Shape coefficients [standard deviations]; empty for the average adult."""
    folder: Path | None = None
    """Model folder; None for the one that ships."""
    clothing_m: Mapping[str, float] = field(default_factory=dict)
    """Thickness of what the skin wears per region [m], see `kintrack.clothing`; empty for none."""


def load_human(folder: Path | None = None, shape: Float[ndarray, " k"] | None = None) -> Human:
    """Body and tracking skin of a person.

    Args:
        folder: Model folder; the one that ships if None.
        shape: Shape coefficients [standard deviations]; the average adult if None.

    Returns:
        The human.

    Raises:
        ModelError: if a file is missing or broken.
    """
    body, skin = load_body(folder, shape), load_skin("tracking", folder, shape)
    return Human(body, skin, np.zeros(0) if shape is None else np.array(shape), folder)


def posed(body: Body, degrees: dict[str, float]) -> Float[ndarray, " nq"]:
    """The neutral configuration with hinges set; names without side set both sides."""
    q = body.neutral()
    for name, value in degrees.items():
        names = [name] if body.model.existJointName(name) else [f"l_{name}", f"r_{name}"]
        for full in names:
            k = body.dof(full)
            q[k + 1] = np.clip(np.radians(value), body.lower[k], body.upper[k])
    return q


def _by_hinge(body: Body, trunk: float, twist: float, limb: float) -> Float[ndarray, " nv"]:
    out = np.full(body.nv, np.inf)
    for joint in list(body.model.names)[2:]:
        stem = joint.removeprefix("l_").removeprefix("r_")
        value = trunk if stem.startswith(_TRUNK) else twist if stem.startswith(_TWIST) else limb
        out[body.dof(joint)] = value
    return out


def leg_hinges(body: Body) -> Bool[ndarray, " nv"]:
    """True for the hinges of hips, knees and ankles."""
    legs = [n[2:].startswith(("hip", "knee", "ankle")) for n in list(body.model.names)[2:]]
    return np.array([False] * 6 + legs)


def prior_sigma(body: Body, config: PriorConfig) -> Float[ndarray, " nv"]:
    """Standard deviation of every hinge about the resting pose [rad]; inf for the root."""
    return _by_hinge(body, config.trunk_rad, config.twist_rad, config.limb_rad)


def motion_sigma(body: Body, config: MotionConfig, dt_s: float) -> Float[ndarray, " nv"]:
    """Standard deviation of the unpredicted motion within `dt_s` [m, rad], shape (nv,)."""
    speed = _by_hinge(body, config.trunk_rad_s, config.limb_rad_s, config.limb_rad_s)
    speed[:3], speed[3:6] = config.root_m_s, config.root_rad_s
    return speed * dt_s

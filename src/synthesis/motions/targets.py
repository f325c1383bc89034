# SPDX-License-Identifier: Apache-2.0
"""What a clip asks of a person: where the bones point, how the trunk is turned, where the hips are.

Joint centres of a capture differ from the person's (the root lies above the hips, the hips are
narrower, the ball of the foot is lower), so only directions are taken over, each against a rest:
the frames in which the clip's person stands upright tell which direction of the capture's trunk is
the person's upright one, those in which the feet stand flat tell the same of the feet.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.joints import JOINT_NAMES
from synthesis.motions.contacts import CALM_M_S, floor_height_m, speed_m_s, standing
from synthesis.motions.mocap import Clip
from synthesis.people.person import Person
from synthesis.people.population import SIDES

BONES = tuple(
    (f"{side}_{parent}", f"{side}_{child}", sigma)
    for side in SIDES
    for parent, child, sigma in (
        ("hip", "knee", 0.03),
        ("knee", "ankle", 0.03),
        ("ankle", "foot", 0.06),
        ("shoulder", "elbow", 0.03),
        ("elbow", "wrist", 0.03),
        ("wrist", "hand", 0.15),
    )
)
"""Parent joint, child joint, standard deviation of the bone's direction [rad]."""
AXES = (
    ("pelvis", 0, 0.12),
    ("pelvis", 1, 0.12),
    ("pelvis", 2, 0.12),
    ("chest", 0, 0.08),
    ("chest", 1, 0.08),
    ("chest", 2, 0.08),
    ("head", 2, 0.10),
)
"""Link, its axis, standard deviation of where it points [rad]."""
ROOT_M = 0.02
"""A root this near the middle of the hips does not show how the pelvis is turned [m]."""
HEAD_LEAN_RAD = np.radians(-6.0)
"""Lean of the line from neck to head of somebody who looks level: the median over the upright
frames of the CMU clips [rad]."""
UPRIGHT_SHARE = 0.10
"""Share of a clip's frames, the most upright ones, that count as upright."""


@dataclass(frozen=True)
class Targets:
    """Directions and paths in the world of the clip, floor at z = 0, for one person."""

    bones: Float[ndarray, "n b 3"]
    """Unit directions of `BONES`."""
    axes: Float[ndarray, "n a 3"]
    """Unit directions of `AXES`."""
    hips: Float[ndarray, "n 3"]
    """Middle between the hips [m]."""
    Rs_world_pelvis: Float[ndarray, "n 3 3"]
    """Rotation of the pelvis."""


def targets_of(person: Person, clip: Clip) -> Targets:
    """Directions of a clip and the pelvis path in the size of a person.

    Args:
        person: Who.
        clip: What.

    Returns:
        Targets in each of the clip's N frames.
    """
    state = run_kinematics(person.body, person.body.neutral())
    rest = dict(zip(JOINT_NAMES, state.joint_positions_world, strict=True))
    floor_m = floor_height_m(clip)
    hips = 0.5 * (clip.joint("l_hip") + clip.joint("r_hip"))
    shoulders = 0.5 * (clip.joint("l_shoulder") + clip.joint("r_shoulder"))
    upright = _upright(clip, shoulders - hips)
    pelvis = _frames(clip.joint("l_hip") - clip.joint("r_hip"), _root_axis(clip, hips))
    across = clip.joint("l_shoulder") - clip.joint("r_shoulder")
    chest = _frames(across, clip.joint("chest") - clip.joint("spine"))
    line = 0.5 * (rest["l_shoulder"] + rest["r_shoulder"])
    line = line - 0.5 * (rest["l_hip"] + rest["r_hip"])
    pelvis = _calibrated(pelvis, (shoulders - hips)[upright], upright, line)
    chest = _calibrated(chest, (shoulders - hips)[upright], upright, line)
    head = np.einsum("nji,nj->ni", chest, _unit(clip.joint("head") - clip.joint("neck")))
    head = np.einsum("nij,nj->ni", chest @ _about_y(-HEAD_LEAN_RAD), head)
    axes = {"pelvis": pelvis, "chest": chest}
    return Targets(
        bones=_bones(clip, rest, floor_m),
        axes=np.stack([axes[k][:, :, a] if k in axes else head for k, a, _ in AXES], axis=1),
        hips=_hip_path(clip, rest, person, hips, floor_m),
        Rs_world_pelvis=pelvis,
    )


def _unit(v: Float[ndarray, "*n 3"]) -> Float[ndarray, "*n 3"]:
    """Unit vectors; a vector of no length stays so."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)


def _frames(left: Float[ndarray, "n 3"], up: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3 3"]:
    """Rotations whose y axis is `left` and whose z axis is as near `up` as may be."""
    y = _unit(left)
    z = _unit(up - (up * y).sum(axis=1, keepdims=True) * y)
    return np.stack([np.cross(y, z), y, z], axis=2)


def _root_axis(clip: Clip, hips: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
    """From between the hips to the root above them, or to the spine if the root is there too."""
    up = clip.joint("pelvis") - hips
    between_m = np.linalg.norm(up, axis=1).max()
    return up if between_m > ROOT_M else clip.joint("spine") - hips


def _about_y(angle_rad: float) -> Float[ndarray, "3 3"]:
    """Rotation about y, shape (3, 3); takes z towards x."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def _upright(clip: Clip, trunk: Float[ndarray, "n 3"]) -> ndarray:
    """Indices of the frames with the straightest legs and the most vertical trunk."""
    score = _unit(trunk)[:, 2].copy()
    for side in SIDES:
        for lower, upper in (("knee", "hip"), ("ankle", "knee")):
            score += _unit(clip.joint(f"{side}_{upper}") - clip.joint(f"{side}_{lower}"))[:, 2]
    return np.argsort(-score, kind="stable")[: max(1, round(UPRIGHT_SHARE * len(score)))]


def _calibrated(
    Rs: Float[ndarray, "n 3 3"],
    trunk: Float[ndarray, "u 3"],
    upright: ndarray,
    rest: Float[ndarray, " 3"],
) -> Float[ndarray, "n 3 3"]:
    """Frames turned about their y axes so that the upright trunk leans in them as at rest."""
    seen = np.einsum("nji,nj->ni", Rs[upright], _unit(trunk))
    leans = np.arctan2(seen[:, 0], seen[:, 2]) - np.arctan2(rest[0], rest[2])
    return Rs @ _about_y(float(np.median(leans)))


def _bones(clip: Clip, rest: dict[str, ndarray], floor_m: float) -> Float[ndarray, "n b 3"]:
    """Directions of `BONES`, the feet turned so that the flat foot is the person's flat foot."""
    out = np.stack([_unit(clip.joint(child) - clip.joint(parent)) for parent, child, _ in BONES], 1)
    for b, (parent, child, _) in enumerate(BONES):
        side, joint = child.split("_")
        if joint == "foot":
            turn = _elevation(rest[child] - rest[parent]) - _flat_foot(clip, side, floor_m)
            axis = _unit(np.cross(out[:, b - 1], out[:, b]))
            out[:, b] = np.cos(turn) * out[:, b] + np.sin(turn) * np.cross(axis, out[:, b])
    return out


def _elevation(v: Float[ndarray, "*n 3"]) -> Float[ndarray, "*n"]:
    """Angle above the horizon [rad]."""
    return np.arctan2(v[..., 2], np.hypot(v[..., 0], v[..., 1]))


def _flat_foot(clip: Clip, side: str, floor_m: float) -> float:
    """Angle of the flat foot's bone above the horizon [rad]: the median of calm frames."""
    ball, ankle = clip.joint(f"{side}_foot"), clip.joint(f"{side}_ankle")
    stands = standing(clip, side, floor_m)
    calm = stands & (speed_m_s(ankle, clip.rate_hz()) < CALM_M_S)
    frames = calm if calm.any() else stands
    if not frames.any():
        frames = np.ones(len(ball), dtype=bool)
    angles = np.sort(_elevation(ball - ankle)[frames])
    return float(angles[round(0.75 * (len(angles) - 1))])


def _hip_path(
    clip: Clip,
    rest: dict[str, ndarray],
    person: Person,
    hips: Float[ndarray, "n 3"],
    floor_m: float,
) -> Float[ndarray, "n 3"]:
    """Middle between the hips, scaled by leg lengths; heights are scaled above the ankles'."""
    ours = theirs = 0.0
    for upper, lower in (("l_hip", "l_knee"), ("l_knee", "l_ankle")):
        ours += float(np.linalg.norm(rest[upper] - rest[lower]))
        theirs += float(np.linalg.norm(clip.joint(upper)[0] - clip.joint(lower)[0]))
    ankles = np.minimum(clip.joint("l_ankle")[:, 2], clip.joint("r_ankle")[:, 2]) - floor_m
    low = ankles[np.abs(ankles) < 0.15]
    ankle_m = float(np.percentile(low, 10.0)) if len(low) else 0.05
    sole_m = float(np.mean([-person.foot_points[side][:, 2].min() for side in SIDES]))
    out = hips * (ours / theirs)
    out[:, 2] = (hips[:, 2] - floor_m - ankle_m) * (ours / theirs) + sole_m
    return out

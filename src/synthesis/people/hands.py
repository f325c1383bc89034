# SPDX-License-Identifier: Apache-2.0
"""Curls the fingers of the source body: hands that hang, and hands that hold a handle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray


@dataclass(frozen=True)
class HandPose:
    """Joint angles of a hand against the flat, open one, degrees."""

    fingers: Float[ndarray, "4 3"]
    """Flexion of index to little finger at knuckle, middle and end joint [deg]."""
    thumb: tuple[float, float, float]
    """Flexion of the thumb at root, middle and end joint [deg]."""
    opposition: float
    """Turn of the thumb about the hand's length, out of the plane of the palm [deg]."""
    spread: float
    """Share of the fingers' spread that is left, 0 = side by side."""


HANDS = {
    "relaxed": HandPose(
        fingers=np.array([[6, 20, 8], [11, 25, 10], [15, 28, 12], [18, 28, 12]], float),
        thumb=(14.0, 8.0, 14.0),
        opposition=-16.0,
        spread=0.4,
    ),
    "closed": HandPose(
        fingers=np.array([[52, 76, 36], [54, 78, 38], [56, 80, 40], [58, 76, 40]], float),
        thumb=(8.0, 30.0, 40.0),
        opposition=24.0,
        spread=0.0,
    ),
}
"""Hands that can be asked for besides `open`, the source's own."""
THUMB_TILT_DEG = 25.0
"""How far the thumb of an open hand bends out of the plane of the palm [deg]."""


def curled(
    vertices: Float[ndarray, "n v 3"],
    heads: Float[ndarray, "n b 3"],
    weights: Float[ndarray, "v b"],
    bones: list[str],
    side: str,
    pose: HandPose,
) -> Float[ndarray, "n v 3"]:
    """Pose the fingers of one hand by linear blend skinning with the source's finger bones.

    Args:
        vertices: Bind pose of N people, root frame [m].
        heads: Where their bones start [m].
        weights: Skinning weights of the source over its bones, rows sum to 1.
        bones: Names of the bones.
        side: `l` or `r`.
        pose: Joint angles.

    Returns:
        The vertices with that hand posed; all others stay.
    """

    def head(bone: str) -> ndarray:
        return heads[:, bones.index(f"{bone}.{side.upper()}")]

    length = _unit(head("finger3-1") - head("wrist"))
    to_thumb = _unit(_without(head("finger2-1") - head("finger5-1"), length))
    palm = np.cross(length, to_thumb) * (1.0 if side == "l" else -1.0)
    out = vertices.copy()
    for finger in range(1, 6):
        names = [f"finger{finger}-{joint}" for joint in (1, 2, 3)]
        origins = [head(name) for name in names]
        along = [origins[1] - origins[0], origins[2] - origins[1], origins[2] - origins[1]]
        R, t = np.broadcast_to(np.eye(3), (len(heads), 3, 3)), np.zeros((len(heads), 3))
        for joint in range(3):
            if finger == 1:
                turn = _thumb_turn(pose, joint, along[joint], length, to_thumb, palm)
            else:
                turn = _finger_turn(pose, finger - 2, joint, along[joint], length, to_thumb, palm)
            t = t + np.einsum("nij,nj->ni", R, origins[joint])
            R = R @ turn
            t = t - np.einsum("nij,nj->ni", R, origins[joint])
            w = weights[:, bones.index(f"{names[joint]}.{side.upper()}")]
            on = np.flatnonzero(w > 0)
            moved = np.einsum("nij,nvj->nvi", R, vertices[:, on]) + t[:, None]
            out[:, on] += w[on, None] * (moved - vertices[:, on])
    return out


def _finger_turn(pose, finger, joint, along, length, to_thumb, palm) -> Float[ndarray, "n 3 3"]:
    """Rotation of a finger's joint: flexion to the palm; the knuckle also closes the spread."""
    bend = pose.fingers[finger][joint]
    if joint:
        return _towards(along, palm, bend)
    aside = np.einsum("ni,ni->n", _unit(_without(along, palm)), to_thumb)
    gathered = _towards(length, to_thumb, -(1.0 - pose.spread) * np.degrees(np.arcsin(aside)))
    return _towards(length, palm, bend) @ gathered


def _thumb_turn(pose, joint, along, length, to_thumb, palm) -> Float[ndarray, "n 3 3"]:
    """Rotation of a thumb's joint: flexion across the palm; the root also swings before it."""
    tilt = np.radians(THUMB_TILT_DEG)
    turn = _towards(along, np.sin(tilt) * palm - np.cos(tilt) * to_thumb, pose.thumb[joint])
    if joint == 0:
        turn = _towards(to_thumb, palm, pose.opposition) @ turn
    return turn


def _towards(direction, goal, angle_deg) -> Float[ndarray, "n 3 3"]:
    """Rotations that turn a direction by an angle straight towards a goal."""
    axis = _unit(np.cross(direction, goal))
    a = np.radians(np.broadcast_to(angle_deg, len(axis)))[:, None, None]
    K = np.cross(np.eye(3)[None], axis[:, None])  # rows e_i x axis: the cross-product matrix
    return np.eye(3) + np.sin(a) * K + (1.0 - np.cos(a)) * (K @ K)


def _unit(x: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
    return x / np.linalg.norm(x, axis=1, keepdims=True)


def _without(x: Float[ndarray, "n 3"], axis: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
    """What is left of vectors across a unit axis."""
    return x - np.einsum("ni,ni->n", x, axis)[:, None] * axis

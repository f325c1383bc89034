# SPDX-License-Identifier: Apache-2.0
"""Bind orientation of every link frame, from the body's own joints."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.modelling.skeleton import links


def _frame(up: ndarray, forward: ndarray) -> Float[ndarray, "3 3"]:
    """Right-handed frame with z along `up` and x the part of `forward` across it."""
    z = up / np.linalg.norm(up)
    x = forward - (forward @ z) * z
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def bind_rotations(points: dict[str, ndarray], landmarks: dict[str, ndarray]) -> dict[str, ndarray]:
    """R_root_link in bind pose for every link, such that the zero pose is anatomical.

    Trunk frames are the root's. A limb's z runs up its bone; x is the way it bends (forearm,
    towards the toes for the leg, towards the thumb for the lower forearm and the hand).

    Args:
        points: Link origins and extra points in bind pose, root frame [m].
        landmarks: Knuckles, root frame [m].

    Returns:
        Rotation (3, 3) per link name.
    """
    rotations = {link.name: np.eye(3) for link in links()}
    for s in "lr":
        shoulder, elbow, wrist = (points[f"{s}_{n}"] for n in ("upper_arm", "forearm", "hand"))
        hip, knee, ankle = (points[f"{s}_{n}"] for n in ("thigh", "shank", "foot"))
        thumb = landmarks[f"{s}_index"] - landmarks[f"{s}_little"]
        toes = points[f"{s}_toe_base"] - ankle
        toes = toes * np.array([1.0, 1.0, 0.0])
        rotations[f"{s}_upper_arm"] = _frame(shoulder - elbow, wrist - elbow)
        hinge = rotations[f"{s}_upper_arm"][:, 1]
        rotations[f"{s}_forearm"] = _frame(elbow - wrist, np.cross(hinge, elbow - wrist))
        rotations[f"{s}_forearm_distal"] = _frame(elbow - wrist, thumb)
        rotations[f"{s}_hand"] = _frame(wrist - landmarks[f"{s}_middle"], thumb)
        rotations[f"{s}_thigh"] = _frame(hip - knee, toes)
        rotations[f"{s}_shank"] = _frame(knee - ankle, toes)
        rotations[f"{s}_foot"] = _frame(np.array([0.0, 0.0, 1.0]), toes)
    return rotations

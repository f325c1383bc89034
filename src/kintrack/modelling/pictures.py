# SPDX-License-Identifier: Apache-2.0
"""Pictures of the human: legal poses, and what each shape coefficient does and explains."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.body import load_body, run_kinematics
from kintrack.export import contact_sheet
from kintrack.export.overlay import PART_COLORS
from kintrack.files import make_result_folder
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, PinholeCamera
from kintrack.human import posed
from kintrack.raster import rasterise
from kintrack.rig import load_rig, model_folder
from kintrack.skin import load_skin, skinned_vertices, vertex_normals

POSES_DEG: dict[str, dict[str, float]] = {
    "zero": {},
    "arms sideways": {"shoulder_elevation": 90, "shoulder_plane": -35},
    "arms up": {"shoulder_elevation": 165, "clavicle_elevation": 25},
    "reaching": {"shoulder_plane": 60, "shoulder_elevation": 60},
    "hands on hips": {
        "shoulder_elevation": 55,
        "shoulder_plane": -50,
        "shoulder_rotation": 55,
        "elbow_flexion": 100,
    },
    "sitting": {"hip_flexion": 90, "knee_flexion": 90, "elbow_flexion": 45},
    "squatting": {
        "hip_flexion": 115,
        "knee_flexion": 135,
        "ankle_dorsiflexion": 35,
        "hip_abduction": 15,
        "shoulder_plane": 65,
        "shoulder_elevation": 45,
        "spine_flexion": 30,
    },
}
"""Poses by hinge, both sides alike [deg]."""
VIEWS_DEG = (0, 60)
"""Headings from which a body is drawn, 0 = from the front [deg]."""
SHAPES_A_ROW = 5
"""Coefficients side by side; each below itself with the other sign."""
_CAMERA = PinholeCamera(260, 380, 340.0, 340.0, 130.0, 195.0)
_DISTANCE_M = 2.4


def draw_body(
    shape: ndarray | None, pose_deg: dict[str, float], heading_deg: float, title: str
) -> UInt8[ndarray, "h w 3"]:
    """One body, tinted by body part and shaded, R G B."""
    body, skin = load_body(shape=shape), load_skin("display", shape=shape)
    vertices = skinned_vertices(run_kinematics(body, posed(body, pose_deg)), skin)
    a = np.radians(180 + heading_deg)
    R = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    seen = (vertices @ R.T + [_DISTANCE_M, 0, 0]) @ T_LEVEL_WORLD_CAMERA[:3, :3]
    _, face = rasterise(seen, skin.faces, _CAMERA)
    facing = -vertex_normals(seen, skin.faces)[skin.faces].mean(axis=1)[:, 2]
    shade = 0.25 + 0.75 * np.clip(facing, 0, 1)
    colors = np.asarray(PART_COLORS)[skin.labels[skin.faces[:, 0]]] * shade[:, None]
    picture = np.full((_CAMERA.height, _CAMERA.width, 3), 245, dtype=np.uint8)
    picture[face >= 0] = colors[face[face >= 0]].astype(np.uint8)
    cv2.putText(
        picture, title, (8, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (60, 60, 60), 1, cv2.LINE_AA
    )
    return picture


def draw_model(folder: Path) -> tuple[Path, Path]:
    """Write `model_poses.png` and `model_shapes.png`.

    Args:
        folder: Where to write; made if missing.

    Returns:
        The two files.
    """
    make_result_folder(folder)
    poses = [
        draw_body(None, pose, view, title if view == 0 else "")
        for view in VIEWS_DEG
        for title, pose in POSES_DEG.items()
    ]
    explained = load_rig(model_folder()).explained
    count = len(explained)
    shapes = [
        draw_body(value * np.eye(count)[k], {}, 0, f"b{k} = {value:+.0f}  ({explained[k]:.2%})")
        for first in range(0, count, SHAPES_A_ROW)
        for value in (-2.0, 2.0)
        for k in range(first, min(first + SHAPES_A_ROW, count))
    ]
    files = folder / "model_poses.png", folder / "model_shapes.png"
    for path, images, columns in zip(
        files, (poses, shapes), (len(POSES_DEG), SHAPES_A_ROW), strict=True
    ):
        cv2.imwrite(str(path), cv2.cvtColor(contact_sheet(images, columns), cv2.COLOR_RGB2BGR))
    return files

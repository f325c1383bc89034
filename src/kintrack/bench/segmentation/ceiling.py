# SPDX-License-Identifier: Apache-2.0
"""What perfect labels and perfect joints would score where a witness' joints are counted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bench.cases import CLEAN
from kintrack.bench.segmentation.cases import Case
from kintrack.bench.segmentation.witness import OWN, JointCounts, witness_summary
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.folder import open_folder
from kintrack.sequence.frame import Frame
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import REFERENCE_FILE, read_reference_joints
from segmentation.evaluate import true_labels
from segmentation.preprocess import HOLE, frame_input

DEEP_M = 0.25
"""A joint centre lies at most so far behind the surface that the camera sees there; if it is
farther, something hides it [m]."""


def ceiling(cases: Sequence[Case]) -> dict[str, Any]:
    """True joints on true labels, over recordings without objects.

    Args:
        cases: Recordings with true labels and joints.

    Returns:
        See `witness_summary`.
    """
    counts = JointCounts()
    for case in cases:
        path = case.sequence / REFERENCE_FILE
        files = (path, case.sequence / OCCLUSION_FILE)
        if case.condition != CLEAN or not all(file.is_file() for file in files):
            continue
        names, positions = read_reference_joints(path)
        _, hidden = read_occlusion(case.sequence / OCCLUSION_FILE)
        for frame, joints, behind in zip(
            open_folder(case.sequence), positions, hidden, strict=False
        ):
            if frame.depth_m is None or frame.labels is None:
                continue
            read = frame_input(frame)[3] != HOLE
            size = (frame.camera.width, frame.camera.height)
            seen = _seen(frame, names, joints)
            seen = {n: seen[n] for n in seen if not behind[JOINT_NAMES.index(n)]}
            counts.add(true_labels(frame), read, seen, size)
    return witness_summary(counts.plain())


def _seen(
    frame: Frame, names: Sequence[str], joints_camera: Float[ndarray, "j 3"]
) -> dict[str, Float[ndarray, " 2"]]:
    """Pixels of the joints that nothing hides."""
    assert frame.depth_m is not None
    found = {}
    for name, joint in zip(names, joints_camera, strict=True):
        if name not in OWN or not (np.isfinite(joint).all() and joint[2] > 0):
            continue
        u, v = frame.camera.project(joint)
        column, row = round(float(u)), round(float(v))
        if 0 <= column < frame.camera.width and 0 <= row < frame.camera.height:
            depth = frame.depth_m[row, column]
            if depth == 0 or depth > joint[2] - DEEP_M:
                found[name] = np.array([u, v])
    return found

# SPDX-License-Identifier: Apache-2.0
"""What the bench compares: every way to get joints from a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy import ndarray

from kintrack.fit import fit_sequence
from kintrack.geometry import camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.sequence.reference import read_reference_joints

BEFORE_S = 1.0 / 30.0
"""How long before the recording a tracker that starts warm is started [s]."""


@dataclass(frozen=True)
class Task:
    """One recording for one method."""

    sequence: Path
    """The recording."""
    clean: Path
    """The same without the object."""
    pitch_deg: float
    """How far the camera looks down [deg]."""
    result: Path
    """Result folder to write."""


Method = Callable[[Task, Callable[[], None]], None]
"""Writes the result and calls after every frame."""


def geometry(task: Task, on_frame: Callable[[], None]) -> None:
    """The geometric tracker alone, started at the true joints before the object appears.

    In [Wan19] every tracker has the right pose to begin with, too. The size of the person is
    estimated from the clean first frame.
    """
    names, joints = read_reference_joints(task.clean / "reference_joints.csv")
    first = open_sequence(task.clean).frame(0)
    known = np.full((len(JOINT_NAMES), 3), np.nan)
    for name, place in zip(names, joints[0], strict=True):
        known[JOINT_NAMES.index(name)] = place
    _fit(task, on_frame, (replace(first, timestamp_s=first.timestamp_s - BEFORE_S), known))


def geometry_cold(task: Task, on_frame: Callable[[], None]) -> None:
    """The geometric tracker alone, which has to start by itself on what it sees."""
    _fit(task, on_frame, None)


def _fit(task: Task, on_frame: Callable[[], None], begun: tuple[Frame, ndarray] | None) -> None:
    fit_sequence(
        open_sequence(task.sequence),
        task.result,
        T_world_camera=camera_pose(task.pitch_deg),
        on_frame=lambda frame, found: on_frame(),
        begun=begun,
    )


METHODS: dict[str, Method] = {"geometry": geometry, "geometry_cold": geometry_cold}
"""Every method by name."""

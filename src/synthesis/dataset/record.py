# SPDX-License-Identifier: Apache-2.0
"""One take on disk: made in a hidden folder, which gets its name when it is whole."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from kintrack.errors import DatasetError, ResultError, SceneError
from kintrack.files import write_json
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.write import SequenceWriter
from synthesis.film import film
from synthesis.scene import Scene, build_scene
from synthesis.takes import Take

TAKE_FILE = "take.json"
REDRAWS = 4
"""How often a take whose scene cannot be built is drawn anew."""


def folder_of(root: Path, take: Take) -> Path:
    """Where a take lies in a dataset."""
    return root / take.part / take.name


def partial_of(root: Path, take: Take) -> Path:
    """Where it lies until it is whole."""
    return root / take.part / f".{take.name}.partial"


def is_recorded(root: Path, take: Take) -> bool:
    """Whether the whole take is there.

    Raises:
        DatasetError: if another take has its name.
    """
    path = folder_of(root, take) / TAKE_FILE
    if not path.is_file():
        return False
    try:
        there = json.loads(path.read_text(encoding="utf-8"))["take"]
    except (OSError, ValueError, KeyError) as error:
        raise DatasetError(f"{path}: cannot be read ({error}); remove its folder") from error
    if there != json.loads(json.dumps(asdict(take))):
        raise DatasetError(f"{path.parent} holds another take; choose another folder or remove it")
    return True


def record(
    take: Take, root: Path, mocap: Path | None = None, on_frame: Callable[[], None] = lambda: None
) -> Path:
    """Make a take.

    Args:
        take: What to make.
        root: Folder of the dataset.
        mocap: Folder of motion capture clips.
        on_frame: Called after every frame.

    Returns:
        The sequence folder.

    Raises:
        DatasetError: if the disk is full or the scene cannot be built; nothing of it is left.
    """
    partial, folder = partial_of(root, take), folder_of(root, take)
    shutil.rmtree(partial, ignore_errors=True)
    try:
        scene, draw = _scene(take, mocap)
        writer = SequenceWriter(partial, scene.sensor.camera)
        for exposure in film(scene, np.random.default_rng((*take.seed, draw, 1))):
            writer.write(
                exposure.timestamp_s,
                exposure.depth_m,
                color=exposure.color,
                labels=exposure.labels,
                joint_positions_m=exposure.joint_positions_camera_m,
                hidden_share=exposure.hidden_share,
                hidden_joints=[
                    name
                    for name, hidden in zip(JOINT_NAMES, exposure.hidden_joints, strict=True)
                    if hidden
                ],
            )
            on_frame()
        write_json(
            partial / TAKE_FILE,
            {
                "take": asdict(take),
                "draw": draw,
                "T_world_camera": scene.Ts_world_camera[0].tolist(),
            },
        )
        shutil.rmtree(folder, ignore_errors=True)
        partial.rename(folder)
    except BaseException as error:
        shutil.rmtree(partial, ignore_errors=True)
        if isinstance(error, ResultError | OSError):
            raise DatasetError(
                f"{folder}: cannot be written ({error}); what was made before is intact, "
                f"the same command goes on from there"
            ) from error
        raise
    return folder


def _scene(take: Take, mocap: Path | None) -> tuple[Scene, int]:
    """The take's scene, from the first draw that has one."""
    for draw in range(REDRAWS):
        try:
            return build_scene(replace(take, seed=(*take.seed, draw)), mocap), draw
        except SceneError as error:
            problem = error
    raise DatasetError(f"{take.part}/{take.name}: no scene in {REDRAWS} draws ({problem})")

# SPDX-License-Identifier: Apache-2.0
"""The state of a training in one safetensors file with a JSON entry; nothing is pickled.

No random state is kept: every draw is a function of the seed and of the number of the step. A
file is written beside its place, read back and then renamed, and the one before it stays; a
reader takes the newest that is whole.
"""

from __future__ import annotations

import json
import os
import warnings
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from segmentation.errors import WeightsError

ENTRY = "kintrack.checkpoint"
VERSION = 1
KEPT = 2
"""Checkpoints that are kept."""
PATTERN = "checkpoint-*.safetensors"


@dataclass(frozen=True)
class Checkpoint:
    """All that training needs to go on."""

    step: int
    """Steps done."""
    tensors: Mapping[str, ndarray]
    """Weights, their moving average and the optimiser's moments."""
    facts: Mapping[str, Any]
    """Whatever JSON holds: config, time spent, losses not yet logged."""


def save_checkpoint(folder: Path, state: Checkpoint) -> Path:
    """Write a checkpoint, which is then the newest, and drop all but the last `KEPT`.

    Raises:
        WeightsError: if a tensor is not finite, or the file cannot be written; older checkpoints
            are as they were.
    """
    path = folder / f"checkpoint-{state.step:08d}.safetensors"
    broken = [name for name, tensor in state.tensors.items() if not np.isfinite(tensor).all()]
    if broken:
        raise WeightsError(f"{path} was not written: {broken[0]} holds NaN or infinity")
    tensors = {name: np.ascontiguousarray(tensor) for name, tensor in state.tensors.items()}
    entry = {"version": VERSION, "step": state.step, "crc": _crc(tensors), **state.facts}
    beside = folder / f".{path.name}.{os.getpid()}.tmp"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with beside.open("wb") as file:
            file.write(save(tensors, {ENTRY: json.dumps(entry)}))
            file.flush()
            os.fsync(file.fileno())
        load_checkpoint(beside)
        beside.replace(path)
    except OSError as error:
        raise WeightsError(f"{path} cannot be written: {error}") from None
    finally:
        beside.unlink(missing_ok=True)
    _prune(folder, path)
    return path


def load_checkpoint(path: Path) -> Checkpoint:
    """Read a checkpoint and check all of it.

    Raises:
        WeightsError: if it is missing, cut off, changed or of another kind.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            facts = json.loads((file.metadata() or {}).get(ENTRY, "null"))
            tensors = {name: file.get_tensor(name) for name in file.keys()}
    except (SafetensorError, OSError, ValueError) as error:
        raise WeightsError(f"{path} is no whole checkpoint: {error}") from None
    if not isinstance(facts, dict) or facts.get("version") != VERSION:
        raise WeightsError(f"{path} is no checkpoint of this version of kintrack")
    if facts.pop("crc") != _crc(tensors):
        raise WeightsError(f"{path} is no whole checkpoint: its checksum does not fit")
    return Checkpoint(facts["step"], tensors, facts)


def latest_checkpoint(folder: Path) -> Checkpoint | None:
    """The newest whole checkpoint of a folder; a warning names those that are not.

    Returns:
        It, or None if there is no checkpoint at all.

    Raises:
        WeightsError: if there are checkpoints, but none is whole.
    """
    paths = sorted(folder.glob(PATTERN), reverse=True)
    problems: list[str] = []
    for path in paths:
        try:
            found = load_checkpoint(path)
        except WeightsError as error:
            problems.append(str(error))
            continue
        for problem in problems:
            warnings.warn(f"{problem}; training goes on from {path.name}", stacklevel=2)
        return found
    if problems:
        raise WeightsError(f"{'; '.join(problems)}; remove them to begin anew")
    return None


def _prune(folder: Path, newest: Path) -> None:
    """Drop old checkpoints; later ones are broken, or training would have gone on from them."""
    others = sorted(path for path in folder.glob(PATTERN) if path != newest)
    older = [path for path in others if path < newest]
    for path in others:
        if path not in older[-(KEPT - 1) :]:
            path.unlink()


def _crc(tensors: Mapping[str, ndarray]) -> int:
    crc = 0
    for name in sorted(tensors):
        crc = zlib.crc32(tensors[name].tobytes(), zlib.crc32(name.encode(), crc))
    return crc

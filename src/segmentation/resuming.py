# SPDX-License-Identifier: Apache-2.0
"""How far a run is, kept in its folder and found there again."""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from segmentation.checkpoint import Checkpoint, latest_checkpoint, save_checkpoint
from segmentation.curves import LOG_FILE, read_log, write_log
from segmentation.errors import SegmentationError
from segmentation.evaluate import Scores
from segmentation.learner import Learner
from segmentation.weights import Weights


@dataclass
class Run:
    """What changes as training goes on, beside the network."""

    step: int = 0
    """Steps done."""
    elapsed_s: float = 0.0
    """Time spent, before and since the last resumption [s]."""
    losses: list[float] = field(default_factory=list)
    """Losses that are not in the log yet."""
    scores: Scores | None = None
    """Of the last validation."""


def resume(output: Path, learner: Learner, identity: dict[str, Any]) -> Run:
    """Where to go on; the log is cut to that step.

    Args:
        output: Folder of the run.
        learner: Takes what the newest whole checkpoint holds.
        identity: What makes a run another one, by name.

    Raises:
        SegmentationError: if the folder holds another run.
        WeightsError: if no checkpoint of the folder is whole.
    """
    found = latest_checkpoint(output) if output.is_dir() else None
    if found is None:
        if learner.group.leads and (output / LOG_FILE).is_file():
            (output / LOG_FILE).unlink()
        return Run()
    for key, ours in identity.items():
        theirs = found.facts.get(key)
        if theirs != plain(ours):
            raise SegmentationError(f"{output} holds another run: {_difference(key, theirs, ours)};"
                                    " choose another folder, or the same options")  # fmt: skip
    learner.restore(found.tensors)
    if learner.group.leads:
        entries = [e for e in read_log(output / LOG_FILE) if e["step"] <= found.step]
        write_log(output / LOG_FILE, entries)
    return Run(found.step, found.facts["elapsed_s"], list(found.facts["losses"]))


def keep(output: Path, learner: Learner, run: Run, identity: dict[str, Any]) -> None:
    """Write a checkpoint from which `resume` goes on."""
    facts = {**identity, "elapsed_s": run.elapsed_s, "losses": run.losses}
    save_checkpoint(output, Checkpoint(run.step, learner.tensors(), facts))


def mark_of(weights: Weights) -> str:
    """Tells these weights from others."""
    crc = 0
    for name in sorted(weights.tensors):
        crc = zlib.crc32(np.ascontiguousarray(weights.tensors[name]).tobytes(), crc)
    return f"weights {crc:08x}"


def plain(value: Any) -> Any:
    """As it comes back from JSON."""
    return json.loads(json.dumps(value))


def _difference(key: str, theirs: Any, ours: Any) -> str:
    ours = plain(ours)
    if not isinstance(theirs, dict) or not isinstance(ours, dict):
        return f"its {key} is {theirs}, not {ours}"
    names = [name for name in ours if theirs.get(name) != ours[name]]
    return ", ".join(f"its {name} is {theirs.get(name)}, not {ours[name]}" for name in names)

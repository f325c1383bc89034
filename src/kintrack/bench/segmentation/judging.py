# SPDX-License-Identifier: Apache-2.0
"""One recording through several networks: every frame is read once, each result is kept on disk."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.bench.segmentation.cases import Case
from kintrack.bench.segmentation.networks import Network
from kintrack.bench.segmentation.samples import (
    DEPTH,
    DEPTH_ONCE,
    MODALITIES,
    Labelled,
    Sample,
    samples,
)
from kintrack.bench.segmentation.witness import JointCounts
from kintrack.errors import DatasetError
from kintrack.files import write_json
from segmentation.evaluate import N, confusion, scores_of
from segmentation.labels import BACKGROUND, IGNORED

MIN_JOINTS = 6
"""A frame with fewer visible joints has no score of its own."""


@dataclass
class Tally:
    """What is counted over a recording."""

    counts: ndarray = field(default_factory=lambda: np.zeros((N, N), np.int64))
    """Pixels by true label and label."""
    counts_strict: ndarray = field(default_factory=lambda: np.zeros((N, N), np.int64))
    """The same, readings of unknown meaning taken for background."""
    counts_of_pixels: ndarray = field(default_factory=lambda: np.zeros((N, N), np.int64))
    """Pixels of the image with a reading, by true label and label."""
    mask: ndarray = field(default_factory=lambda: np.zeros((2, 2), np.int64))
    """Pixels by person in truth and by label."""
    mask_read: ndarray = field(default_factory=lambda: np.zeros((2, 2), np.int64))
    """The same, only where there is a depth reading."""
    joints: JointCounts = field(default_factory=JointCounts)
    """A witness' joints."""
    scores: list[tuple[int, float]] = field(default_factory=list)
    """Number of a frame and how good it is, 0 to 1: intersection over union of the parts or the
    mask, or else the share of joints on their own part; NaN where there are too few."""

    def add(self, sample: Sample, labelled: Labelled) -> None:
        """Count a frame."""
        labels = labelled.cells
        score = float("nan")
        if sample.joints:
            right, seen = self.joints.add(labels, sample.read, sample.joints, sample.size)
            score = right / seen if seen >= MIN_JOINTS else score
        if sample.truth is not None:
            own = confusion(sample.truth, labels)
            self.counts += own
            self.counts_strict += confusion(_as_background(sample), labels)
            score = scores_of(own).non_background_iou
        if sample.truth_of_pixels is not None:
            self.counts_of_pixels += confusion(sample.truth_of_pixels, labelled.pixels)
        if sample.mask is not None:
            own = _pairs(sample.mask, labels)
            self.mask += own
            self.mask_read += _pairs(np.where(sample.read, sample.mask, np.uint8(IGNORED)), labels)
            score = own[1, 1] / max(own.sum() - own[0, 0], 1)
        self.scores.append((sample.index, float(score)))

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "counts": self.counts.tolist(),
            "counts_strict": self.counts_strict.tolist(),
            "counts_of_pixels": self.counts_of_pixels.tolist(),
            "mask": self.mask.tolist(),
            "mask_read": self.mask_read.tolist(),
            "joints": self.joints.plain(),
            "scores": [(n, round(x, 4)) for n, x in self.scores if np.isfinite(x)],
        }


def judge(
    case: Case,
    networks: Sequence[Network],
    folder: Path,
    digest: str,
    on_frame: Callable[[], None] = lambda: None,
) -> dict[tuple[str, str], dict[str, Any]]:
    """Judge a recording; what was judged before is read instead.

    Args:
        case: The recording.
        networks: What labels it.
        folder: Where results are kept.
        digest: Of the code that decides them.
        on_frame: Called after every frame.

    Returns:
        (network's name, one of `MODALITIES`) -> what `Tally.plain` tells.

    Raises:
        DatasetError: if no frame can be judged.
        InputError: if a depth or a label is not what it must be.
    """
    fingerprint = case.fingerprint()
    has_color = (case.sequence / "rgb.txt").is_file()
    modalities = MODALITIES if has_color else (DEPTH, DEPTH_ONCE)
    found: dict[tuple[str, str], dict[str, Any]] = {}
    missing: list[tuple[Network, str, Path, str]] = []
    for network in networks:
        for modality in modalities:
            place = (
                folder
                / network.kept_in
                / modality.replace(",", "").replace(" ", "_")
                / f"{case.key}.json"
            )
            key = f"{network.digest} {network.segmenter.runtime} {digest} {fingerprint}"
            kept = _kept(place, key)
            if kept is None:
                missing.append((network, modality, place, key))
            else:
                found[network.name, modality] = kept
    if not missing:
        return found
    tallies = {(net.name, modality): Tally() for net, modality, _, _ in missing}
    frames = 0
    for sample in samples(case):
        for network, modality, _, _ in missing:
            labelled = sample.labels_by(network.segmenter, modality)
            tallies[network.name, modality].add(sample, labelled)
        frames += 1
        on_frame()
    if not frames:
        raise DatasetError(f"{case.sequence}: none of its frames has depth and a truth to judge by")
    for network, modality, place, key in missing:
        plain = {"key": key, "frames": frames, **tallies[network.name, modality].plain()}
        place.parent.mkdir(parents=True, exist_ok=True)
        write_json(place, plain)
        found[network.name, modality] = json.loads(place.read_text())
    return found


def _as_background(sample: Sample) -> UInt8[ndarray, "106 128"]:
    """The truth with unknown readings, which are no bars, as background."""
    assert sample.truth is not None
    return np.where((sample.truth == IGNORED) & sample.read, np.uint8(BACKGROUND), sample.truth)


def _pairs(mask: ndarray, labels: ndarray) -> ndarray:
    counted = mask != IGNORED
    pairs = 2 * mask[counted].astype(int) + (labels[counted] > 0)
    return np.bincount(pairs, minlength=4).reshape(2, 2)


def _kept(path: Path, key: str) -> dict[str, Any] | None:
    try:
        kept = json.loads(path.read_text())
    except (OSError, ValueError):
        return None
    return kept if isinstance(kept, dict) and kept.get("key") == key else None

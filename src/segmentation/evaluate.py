# SPDX-License-Identifier: Apache-2.0
"""How well labels agree with the truth: confusion, intersection over union, pixel accuracy."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from numba import njit
from numpy import ndarray

from kintrack.errors import DatasetError
from kintrack.sequence.frame import Frame
from segmentation.labels import BACKGROUND, IGNORED, INPUT_HEIGHT, INPUT_WIDTH, LABELS
from segmentation.picture import checked, keep_sorted
from segmentation.preprocess import cell_samples, letterbox
from segmentation.runtime import Segmenter

N = len(LABELS)


@dataclass(frozen=True)
class Scores:
    """What a confusion matrix says, each 0 to 1; NaN where neither truth nor labels have pixels."""

    pixel_accuracy: float
    """Share of pixels with the true label."""
    background_iou: float
    """Of the background."""
    non_background_iou: float
    """Person's pixels with the right part, over pixels that are person in truth or by label."""
    person_iou: float
    """The same if any part counts as right: of the person's mask."""
    part_iou: dict[str, float]
    """Of every part by name."""
    mean_part_iou: float
    """Mean of `part_iou`, absent parts left out."""

    def summary(self) -> dict[str, Any]:
        """All of it in one dict without nesting, NaN as None."""
        flat = {
            "pixel_accuracy": self.pixel_accuracy,
            "background_iou": self.background_iou,
            "non_background_iou": self.non_background_iou,
            "person_iou": self.person_iou,
            "mean_part_iou": self.mean_part_iou,
            **self.part_iou,
        }
        return {k: round(v, 5) if np.isfinite(v) else None for k, v in flat.items()}


def confusion(truth: UInt8[ndarray, "*n"], labels: UInt8[ndarray, "*n"]) -> Int[ndarray, "7 7"]:
    """How many pixels of true label i got label j; `IGNORED` truth is left out.

    Args:
        truth: True labels.
        labels: Labels to judge, same shape, 0 to 6.
    """
    counted = truth != IGNORED
    pairs = truth[counted].astype(np.int64) * N + labels[counted]
    return np.bincount(pairs, minlength=N * N).reshape(N, N)


def iou_of(counts: Int[ndarray, "7 7"]) -> Float[ndarray, " 7"]:
    """Intersection over union of every label; NaN for one that occurs nowhere."""
    both = np.diag(counts).astype(float)
    union = counts.sum(axis=0) + counts.sum(axis=1) - both
    return np.asarray(np.divide(both, union, out=np.full(N, np.nan), where=union > 0))


def scores_of(counts: Int[ndarray, "7 7"]) -> Scores:
    """Scores of a confusion matrix, `counts[true, labelled]`."""
    iou = iou_of(counts)
    total, background = counts.sum(), counts[BACKGROUND, BACKGROUND]
    right = np.trace(counts)
    parts = dict(zip(LABELS[1:], iou[1:].tolist(), strict=True))
    present = iou[1:][np.isfinite(iou[1:])]
    return Scores(
        pixel_accuracy=_share(right, total),
        background_iou=float(iou[BACKGROUND]),
        non_background_iou=_share(right - background, total - background),
        person_iou=_share(counts[1:, 1:].sum(), total - background),
        part_iou=parts,
        mean_part_iou=float(present.mean()) if len(present) else float("nan"),
    )


def true_labels(frame: Frame) -> UInt8[ndarray, "106 128"]:
    """The truth at the network's size: the label of the reading that a network's cell shows.

    A cell without reading is background, one in a bar is `IGNORED`.

    Raises:
        DatasetError: if the frame has no labels or no depth, or one of them is not what it must be.
    """
    if frame.labels is None or frame.depth_m is None:
        raise DatasetError(f"frame {frame.index} cannot be judged: {frame.problem or 'no labels'}")
    checked(frame, "labels to judge by")
    return labels_shown(frame.depth_m, frame.labels)


def labels_shown(
    depth_m: Float[ndarray, "h w"], labels: UInt8[ndarray, "r c"]
) -> UInt8[ndarray, "106 128"]:
    """Labels of an image at the network's size: of the very readings that its cells show.

    Args:
        depth_m: Depth [m], 0 = no reading.
        labels: Labels of the same image, at any size.

    Returns:
        The labels; background in a cell without reading, `IGNORED` in the bars.
    """
    height, width = depth_m.shape
    shown = np.full((INPUT_HEIGHT, INPUT_WIDTH), IGNORED, dtype=np.uint8)
    _fill_shown(np.asarray(depth_m), labels, letterbox(width, height), shown)
    return shown


def evaluate(
    segmenter: Segmenter,
    sequences: Iterable[Iterable[Frame]],
    on_frame: Callable[[int], None] = lambda done: None,
) -> Int[ndarray, "7 7"]:
    """Confusion matrix over all labelled frames of some recordings.

    Args:
        segmenter: What labels.
        sequences: Recordings; frames without labels or depth are left out.
        on_frame: Called with the number of frames judged.

    Returns:
        `counts[true, labelled]`; see `scores_of`.

    Raises:
        DatasetError: if no frame can be judged.
    """
    counts, done = np.zeros((N, N), dtype=np.int64), 0
    for sequence in sequences:
        for frame in sequence:
            if frame.labels is None or frame.depth_m is None:
                continue
            counts += confusion(true_labels(frame), segmenter.segment(frame))
            done += 1
            on_frame(done)
    if not done:
        raise DatasetError("no frame with depth and labels in the recordings to evaluate on")
    return counts


def _share(part: int, whole: int) -> float:
    return float(part / whole) if whole else float("nan")


@njit(cache=True)
def _fill_shown(depth, labels, fit, out):
    """Labels of the readings that `preprocess.network_input` takes; `IGNORED` holes stay that."""
    rows, down = cell_samples(fit.rows, fit.height)
    columns, across = cell_samples(fit.columns, fit.width)
    tall, wide = labels.shape
    most = rows.shape[1] * columns.shape[1]
    found, seen = np.empty(most), np.empty(most, dtype=np.uint8)
    for i in range(fit.rows):
        for j in range(fit.columns):
            n = 0
            unread = np.uint8(BACKGROUND)
            for a in range(down[i]):
                for b in range(across[j]):
                    v, u = rows[i, a], columns[j, b]
                    label = labels[
                        (2 * v + 1) * tall // (2 * fit.height),
                        (2 * u + 1) * wide // (2 * fit.width),
                    ]
                    if depth[v, u] <= 0.0:
                        unread = label if label == IGNORED else unread
                        continue
                    keep_sorted(found, seen, n, depth[v, u], label)
                    n += 1
            read = n > 0 and 2 * n >= down[i] * across[j]
            out[fit.top + i, fit.left + j] = seen[(n - 1) // 2] if read else unread

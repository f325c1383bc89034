# SPDX-License-Identifier: Apache-2.0
"""Pictures of the segmentation bench: scores over distance, and predictions good and bad."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy import ndarray

from kintrack.bench.cases import CLEAN
from kintrack.bench.segmentation.cases import COMPOSITES, CONDITIONS, TEST
from kintrack.bench.segmentation.networks import Network
from kintrack.bench.segmentation.samples import DEPTH, MODALITIES, RGBD, Sample, samples
from kintrack.bench.segmentation.summary import OBJECTS, Judged
from kintrack.bench.segmentation.witness import OWN
from kintrack.files import write_atomically
from segmentation.labels import IGNORED, LABELS
from segmentation.preprocess import COLOR_MIDDLE, COLOR_SCALE, FARTHEST, HOLE, NEAREST, letterbox

SYNTHETIC_FILE, REAL_FILE = "segmentation.png", "segmentation_real.png"
PAINT = np.array(
    [[38, 38, 38], [230, 75, 60], [80, 175, 75], [60, 120, 230], [245, 190, 50], [190, 80, 215],
     [60, 205, 205]], dtype=np.uint8,
)  # fmt: skip
"""Colour of every label."""
UNKNOWN = (255, 255, 255)
RANKS = {"good": 0.85, "typical": 0.5, "bad": 0.0}
"""Which of a recording's frames are shown, by their place among all from worst to best."""


def write_pictures(
    content: dict[str, Any], networks: Sequence[Network], judged: Sequence[Judged], folder: Path
) -> tuple[Path, ...]:
    """Draw `segmentation.png` and, where there are real recordings, `segmentation_real.png`.

    Args:
        content: Of `segmentation.json`.
        networks: The networks, the one that ships first.
        judged: Every recording by every network.
        folder: Where the pictures go.

    Returns:
        The files.

    Raises:
        ResultError: if one cannot be written.
    """
    figures = {SYNTHETIC_FILE: _synthetic(content, networks, judged)}
    if any(row.case.group != TEST for row in judged):
        figures[REAL_FILE] = _real(networks[0], judged)
    for name, figure in figures.items():
        save = partial(figure.savefig, format="png", dpi=150, metadata={"Software": None})
        write_atomically(folder / name, save)
    return tuple(folder / name for name in figures)


def painted(labels: UInt8[ndarray, "h w"]) -> UInt8[ndarray, "h w 3"]:
    """Labels in colours; what is unknown is white."""
    known = PAINT[np.minimum(labels, len(PAINT) - 1)]
    return np.where((labels == IGNORED)[..., None], np.array(UNKNOWN, np.uint8), known)


def seen(sample: Sample) -> UInt8[ndarray, "106 128 3"]:
    """What the network is shown: colour where there is any, else depth."""
    if sample.colored:
        color = sample.image[:3].transpose(1, 2, 0) * COLOR_SCALE + COLOR_MIDDLE
        return np.clip(color, 0, 255).astype(np.uint8)
    return seen_depth(sample)


def seen_depth(sample: Sample) -> UInt8[ndarray, "106 128 3"]:
    """Depth, near is bright; holes are black."""
    grey = 255.0 * (FARTHEST - sample.image[3]) / (FARTHEST - NEAREST)
    grey = np.where(sample.image[3] == HOLE, 0.0, np.clip(grey, 25.0, 255.0))
    return np.repeat(grey[..., None], 3, axis=2).astype(np.uint8)


def _synthetic(
    content: dict[str, Any], networks: Sequence[Network], judged: Sequence[Judged]
) -> Figure:
    """Scores above, frames of held-out people below."""
    shown = _frames_shown(networks[0], judged)
    columns = 2 + len(networks)
    size = (max(8.0, 1.75 * columns), 3.4 + 1.4 * len(shown))
    figure = Figure(figsize=size, layout="constrained")
    heights = (3.2, 1.4 * len(shown))
    top, bottom = figure.subfigures(2, 1, squeeze=False, height_ratios=heights)[:, 0]
    left, right = top.subplots(1, 2, width_ratios=(1, 1.7))
    _over_distance(left, content)
    _by_part(right, content)
    axes = bottom.subplots(len(shown), columns, squeeze=False)
    titles = ["input", "truth", *(network.name for network in networks)]
    for n, (row, (judgement, sample, note)) in enumerate(zip(axes, shown, strict=True)):
        assert sample.truth is not None
        pictures = [seen(sample), painted(np.where(sample.truth == IGNORED, 0, sample.truth))]
        pictures += [painted(_labels(network, sample, RGBD)) for network in networks]
        for axis, picture, title in zip(row, pictures, titles, strict=True):
            _show(axis, picture, title if n == 0 else "")
        row[0].set_ylabel(f"{judgement.case.condition}, {note}", fontsize=6.5)
    return figure


def _frames_shown(network: Network, judged: Sequence[Judged]) -> list[tuple[Judged, Sample, str]]:
    """One recording per condition: its typical frame, and for objects the bad one of another."""
    rows = [r for r in judged if r.case.group == TEST and r.network == network.name
            and r.modality == RGBD]  # fmt: skip
    found = []
    for n, condition in enumerate(CONDITIONS):
        own = [r for r in rows if r.case.condition == condition]
        for rank in ("typical",) if condition == CLEAN else ("typical", "bad"):
            if own:
                judgement = own[(n + (rank == "bad")) % len(own)]
                found += _chosen(judgement, rank)
    return found


def _chosen(judgement: Judged, rank: str) -> list[tuple[Judged, Sample, str]]:
    """The frame of a recording that has a rank; none if no frame has a score."""
    ordered = sorted(judgement.plain["scores"], key=lambda one: (one[1], one[0]))
    if not ordered:
        return []
    index, score = ordered[min(len(ordered) - 1, int(RANKS[rank] * len(ordered)))]
    sample = next(samples(judgement.case, [index]))
    return [(judgement, sample, f"{rank}: {100 * score:.0f} %")]


def _real(network: Network, judged: Sequence[Judged]) -> Figure:
    """Good, typical and bad frames of every real recording; joints that miss their part in red."""
    groups = dict.fromkeys(row.case.group for row in judged if row.case.group != TEST)
    figure = Figure(figsize=(10.5, 1.75 * len(groups) + 0.5), layout="constrained")
    axes = figure.subplots(len(groups), 2 * len(RANKS), squeeze=False)
    for row, group in zip(axes, groups, strict=True):
        own = [r for r in judged if r.case.group == group and r.network == network.name]
        modality = RGBD if any(r.modality == RGBD for r in own) else DEPTH
        own = [r for r in own if r.modality == modality]
        pooled = sorted(((score, n, r) for r in own for n, score in r.plain["scores"]),
                        key=lambda one: (one[0], one[1], one[2].case.key))  # fmt: skip
        for at, (rank, place) in enumerate(RANKS.items()):
            pair = row[2 * at : 2 * at + 2]
            if not pooled:
                for axis in pair:
                    axis.axis("off")
                continue
            score, index, judgement = pooled[min(len(pooled) - 1, int(place * len(pooled)))]
            sample = next(samples(judgement.case, [index]))
            labels = _labels(network, sample, modality)
            _show(pair[0], seen(sample), f"{rank}: {100 * score:.0f} %")
            _show(pair[1], painted(labels), "")
            _draw_joints(pair, sample, labels)
        note = {COMPOSITES: "part IoU", "uva_turn": "mask IoU"}.get(group, "joints on own part")
        row[0].set_ylabel(f"{group}\n{note}", fontsize=7)
    return figure


def _draw_joints(axes: Sequence[Axes], sample: Sample, labels: UInt8[ndarray, "106 128"]) -> None:
    fit = letterbox(*sample.size)
    for name, (u, v) in sample.joints.items():
        x = (u + 0.5) * fit.columns / sample.size[0] + fit.left - 0.5
        y = (v + 0.5) * fit.rows / sample.size[1] + fit.top - 0.5
        row, column = round(float(y)) - fit.top, round(float(x)) - fit.left
        if not (0 <= row < fit.rows and 0 <= column < fit.columns):
            continue
        own = LABELS[labels[row + fit.top, column + fit.left]] in OWN[name]
        for axis in axes:
            axis.plot(x, y, "o", ms=2.6, mec="black", mew=0.4, color="white" if own else "red")


def _labels(network: Network, sample: Sample, modality: str) -> UInt8[ndarray, "106 128"]:
    return sample.labels_by(network.segmenter, modality).cells


def _show(axis: Axes, picture: ndarray, title: str) -> None:
    axis.imshow(picture, interpolation="nearest")
    axis.set_title(title, fontsize=7)
    axis.set(xticks=(), yticks=())


def _over_distance(axis: Axes, content: dict[str, Any]) -> None:
    """Non-background IoU over the object's distance: networks by colour, inputs by line."""
    by_network = content["labels"].get(TEST, {})
    order = (CLEAN, *reversed(CONDITIONS[1:]))
    styles = dict(zip(MODALITIES, ("-", ":", "--", "-."), strict=True))
    for n, name in enumerate(content["order"]):
        for modality, style in styles.items():
            found = by_network.get(name, {}).get(modality, {})
            values = [found.get(c, {}).get("non_background_iou") for c in order]
            heights = [np.nan if value is None else 100 * value for value in values]
            axis.plot(order, heights, style, marker="o", ms=3, lw=1.3, color=f"C{n}")
    axis.set_ylabel("non-background IoU [%]", fontsize=8)
    axis.set_xlabel("object before the person", fontsize=8)
    axis.set_ylim(bottom=0)
    axis.tick_params(labelsize=7)
    axis.grid(alpha=0.3, lw=0.5)
    handles = [Line2D([], [], ls=style, lw=1.3, color="0.2") for style in styles.values()]
    axis.legend(handles, list(styles), fontsize=6, frameon=False, ncols=4, loc="upper center",
                bbox_to_anchor=(0.5, 1.12), columnspacing=1.0)  # fmt: skip


def _by_part(axis: Axes, content: dict[str, Any]) -> None:
    """IoU of every part, objects at all distances, with colour."""
    by_network = content["labels"].get(TEST, {})
    names = ("background_iou", "non_background_iou", *LABELS[1:])
    width = 0.8 / max(len(by_network), 1)
    for n, name in enumerate(content["order"]):
        found = by_network.get(name, {}).get(RGBD, {}).get(OBJECTS, {})
        heights = [100 * (found.get(key) or 0.0) for key in names]
        places = np.arange(len(names)) + (n + 0.5) * width - 0.4
        axis.bar(places, heights, width, label=name, color=f"C{n}")
    words = [name.removesuffix("_iou").replace("_", " ") for name in names]
    axis.set_xticks(range(len(names)), words, rotation=25, fontsize=7, ha="right")
    axis.set_ylabel("IoU, objects at 30-60 cm [%]", fontsize=8)
    axis.set_ylim(0, 102)
    axis.tick_params(axis="y", labelsize=7)
    axis.grid(alpha=0.3, lw=0.5, axis="y")
    axis.legend(fontsize=6.5, frameon=False, ncols=6, loc="upper center", bbox_to_anchor=(0.5, 1.1))

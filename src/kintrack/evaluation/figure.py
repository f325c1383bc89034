# SPDX-License-Identifier: Apache-2.0
"""The figure of a comparison: accuracy over threshold, joint by joint, and over time."""

from __future__ import annotations

import re

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kintrack.evaluation.comparison import Evaluation

_BLUE, _ORANGE, _GREY = "#0072b2", "#d55e00", "#999999"


def plot_evaluation(evaluation: Evaluation) -> Figure:
    """The accuracy curve, mean and median of each joint, and the mean over joints over time."""
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    axes = figure.subplot_mosaic("AB;CC", width_ratios=(1.0, 1.5), height_ratios=(1.6, 1.0))
    _plot_accuracy(axes["A"], evaluation)
    _plot_joints(axes["B"], evaluation)
    _plot_time(axes["C"], evaluation)
    for axis in axes.values():
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=7.5)
        axis.xaxis.label.set_fontsize(8.5)
        axis.yaxis.label.set_fontsize(8.5)
    return figure


def _plot_accuracy(axis: Axes, evaluation: Evaluation) -> None:
    for label, scores, style in (
        ("tracking frames", evaluation.tracking, {"color": _BLUE, "marker": "o", "ms": 2.5}),
        ("all posed frames", evaluation.posed, {"color": _ORANGE, "linestyle": "--"}),
    ):
        if scores.samples:
            axis.plot(
                100 * scores.thresholds_m, 100 * scores.accuracy, label=label, lw=1.3, **style
            )
    axis.set(xlabel="threshold [cm]", ylabel="joints within threshold [%]", ylim=(0, 102))
    axis.set(xlim=100 * evaluation.posed.thresholds_m[[0, -1]], xticks=(2, 5, 10, 15, 20))
    axis.set_title("accuracy over threshold, all joints", fontsize=8.5)
    axis.grid(alpha=0.3, lw=0.5)
    if evaluation.posed.samples:
        axis.legend(loc="lower right", fontsize=7.5, frameon=False)


def _plot_joints(axis: Axes, evaluation: Evaluation) -> None:
    scores = evaluation.posed
    x = np.arange(len(scores.joint_names))
    axis.bar(x - 0.2, 100 * scores.joint_mean_m, 0.4, color=_BLUE, label="mean")
    axis.bar(x + 0.2, 100 * scores.joint_median_m, 0.4, color=_ORANGE, label="median")
    axis.axhline(100 * scores.mean_m, color="black", lw=0.7, ls=":", label="mean of all")
    axis.set_xticks(x, [_in_words(name) for name in scores.joint_names], rotation=90)
    axis.set_title("each joint, all posed frames", fontsize=8.5)
    axis.set(ylabel=f"{evaluation.measure} [cm]", xlim=(-0.7, len(x) - 0.3))
    axis.legend(loc="upper left", ncols=3, fontsize=7.5, frameon=False)
    axis.margins(y=0.2)


def _plot_time(axis: Axes, evaluation: Evaluation) -> None:
    seconds = evaluation.timestamps_s - evaluation.timestamps_s[0]
    seen = np.isfinite(evaluation.distances_m)
    total_m = np.where(seen, evaluation.distances_m, 0.0).sum(axis=1)
    counts = seen.sum(axis=1)
    mean_m = np.where(counts > 0, total_m / np.maximum(counts, 1), np.nan)
    axis.plot(seconds, 100 * mean_m, color=_BLUE, lw=1.0)
    if not evaluation.is_tracking.all():
        edges = np.concatenate([seconds[:1], (seconds[1:] + seconds[:-1]) / 2, seconds[-1:]])
        axis.stairs(
            ~evaluation.is_tracking,
            edges,
            fill=True,
            transform=axis.get_xaxis_transform(),
            color=_GREY,
            alpha=0.35,
            lw=0,
            label="status not tracking",
        )
        axis.legend(loc="upper right", fontsize=7.5, frameon=False)
    axis.set_title("mean over joints, frame by frame", fontsize=8.5)
    axis.set(xlabel="time [s]", ylabel=f"{evaluation.measure} [cm]")
    axis.set_xlim(seconds[0], max(seconds[-1], 1e-3))
    axis.set_ylim(bottom=0)
    axis.grid(alpha=0.3, lw=0.5)


def _in_words(joint: str) -> str:
    """l_hip as left hip."""
    return re.sub("^l_", "left ", re.sub("^r_", "right ", joint)).replace("_", " ")

# SPDX-License-Identifier: Apache-2.0
"""Pictures of the accuracy bench: accuracy over threshold, and every joint seen or hidden."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kintrack.joints import JOINT_NAMES
from kintrack.result import write_atomically

CURVES_FILE, JOINTS_FILE = "accuracy.png", "joints.png"
_COLORS = {"clean": "#999999", "60 cm": "#56b4e9", "45 cm": "#e69f00", "30 cm": "#d55e00"}
_LINES = ("-", "--", ":", "-.")
_TITLES = {
    "alone": "synthetic, nothing around the person",
    "room": "synthetic, in rooms",
    "real": "real recordings, against the clean fit",
    "kinect": "real recordings, agreement with the Kinect",
}


def write_pictures(content: dict[str, Any], folder: Path) -> tuple[Path, ...]:
    """Draw `accuracy.png` and `joints.png` from the content of `accuracy.json`.

    Returns:
        The files.

    Raises:
        ResultError: if one cannot be written.
    """
    figures = {CURVES_FILE: draw_curves(content["scores"]), JOINTS_FILE: _joints(content["scores"])}
    for name, figure in figures.items():
        write_atomically(folder / name, partial(figure.savefig, format="png", dpi=180))
    return tuple(folder / name for name in figures)


def draw_curves(scores: dict[str, Any]) -> Figure:
    """Share of joints within a threshold, a line style per method, a colour per distance.

    Rows are all, visible and hidden joints; columns are groups of recordings.
    """
    groups = [g for g in _TITLES if any(g in by_group for by_group in scores.values())]
    figure = Figure(figsize=(3.1 * len(groups) + 0.6, 7.6), layout="constrained")
    axes = figure.subplots(3, len(groups), squeeze=False, sharex=True, sharey=True)
    for row, part in zip(axes, ("all", "visible", "hidden"), strict=True):
        for axis, group in zip(row, groups, strict=True):
            _curves(axis, scores, group, part)
            axis.grid(alpha=0.3, lw=0.5)
            axis.spines[["top", "right"]].set_visible(False)
            axis.tick_params(labelsize=7)
        row[0].set_ylabel(f"{part} joints within threshold [%]", fontsize=8)
    for axis, group in zip(axes[0], groups, strict=True):
        axis.set_title(_TITLES[group], fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel("threshold [cm]", fontsize=8)
    axes[0][0].set(ylim=(0, 102), xticks=(2, 5, 10, 15, 20))
    axes[0][-1].legend(fontsize=6.5, frameon=False, loc="lower right")
    return figure


def _curves(axis: Axes, scores: dict[str, Any], group: str, part: str) -> None:
    for (method, by_group), line in zip(scores.items(), _LINES * len(scores), strict=False):
        for condition, found in by_group.get(group, {}).items():
            if found[part]["accuracy"] is None:
                continue
            axis.plot(
                100 * np.array(found["thresholds_m"]),
                100 * np.array(found[part]["accuracy"]),
                line,
                color=_COLORS[condition],
                lw=1.3,
                label=f"{method}, {condition}",
            )


def _joints(scores: dict[str, Any]) -> Figure:
    """Mean error of every joint at every distance, first method, a row per group."""
    by_group = next(iter(scores.values()))
    groups = [group for group in _TITLES if group in by_group]
    figure = Figure(figsize=(7.6, 2.3 * len(groups) + 0.6), layout="constrained")
    axes = figure.subplots(len(groups), 1, squeeze=False, sharex=True)[:, 0]
    x = np.arange(len(JOINT_NAMES))
    for axis, group in zip(axes, groups, strict=True):
        conditions = by_group[group]
        width = 0.8 / len(conditions)
        for n, (condition, found) in enumerate(conditions.items()):
            means = [found["joints"][name]["mean_m"] for name in JOINT_NAMES]
            heights = [np.nan if mean is None else 100 * mean for mean in means]
            axis.bar(
                x + (n + 0.5) * width - 0.4,
                heights,
                width,
                color=_COLORS[condition],
                label=condition,
            )
        axis.set_ylabel("mean error [cm]", fontsize=8)
        axis.set_title(_TITLES[group], fontsize=8)
        axis.tick_params(labelsize=7)
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].legend(fontsize=7, frameon=False, ncols=4)
    words = [re.sub("^l_", "left ", re.sub("^r_", "right ", name)) for name in JOINT_NAMES]
    axes[-1].set_xticks(x, words, rotation=90)
    return figure

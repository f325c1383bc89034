# SPDX-License-Identifier: Apache-2.0
"""The figure on real recordings: accuracy over threshold, agreement by action."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scoring import ACTIONS, JOINT_KINDS, RecordingScore, pool

from kintrack.files import write_atomically
from kintrack.metrics import THRESHOLDS_M

_COLORS = ("#56b4e9", "#0072b2", "#e69f00", "#d55e00", "#009e73", "#cc79a7", "#999999")
_BLUE, _ORANGE = "#0072b2", "#d55e00"


def write_figure(scores: Sequence[RecordingScore], path: Path) -> None:
    """Draw the figure into a PNG file."""
    figure = Figure(figsize=(9.6, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
    _accuracy(left, scores)
    _actions(right, scores)
    for axis in (left, right):
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8)
    write_atomically(path, lambda file: figure.savefig(file, format="png", dpi=150))


def _accuracy(axis: Axes, scores: Sequence[RecordingScore]) -> None:
    x = 100 * THRESHOLDS_M
    for kind, color in zip(JOINT_KINDS, _COLORS, strict=True):
        axis.plot(x, 100 * pool(scores, kind).accuracy, color=color, lw=1.2, label=kind)
    axis.plot(x, 100 * pool(scores).accuracy, color="black", lw=2.2, label="all joints")
    axis.set(xlim=(x[0], x[-1]), ylim=(0, 101), xticks=(2, 5, 10, 15, 20))
    axis.set_xlabel("distance to the Kinect's joint at most [cm]", fontsize=8.5)
    axis.set_ylabel("share of joints [%]", fontsize=8.5)
    axis.set_title(f"{len(scores)} recordings, every frame with a pose", fontsize=9)
    axis.grid(alpha=0.3, lw=0.5)
    axis.legend(loc="lower right", fontsize=8, frameon=False)


def _actions(axis: Axes, scores: Sequence[RecordingScore]) -> None:
    rows = [
        (name, pool(members))
        for number, name in ACTIONS.items()
        if (members := [s for s in scores if s.action == number])
    ]
    y = np.arange(len(rows))
    axis.barh(y - 0.2, [100 * p.mean_m for _, p in rows], 0.4, color=_BLUE, label="mean distance")
    axis.barh(
        y + 0.2,
        [100 * p.offset_free_m for _, p in rows],
        0.4,
        color=_ORANGE,
        label="constant offsets taken off",
    )
    axis.axvline(7.0, color=_BLUE, lw=0.9, ls="--")
    axis.axvline(4.5, color=_ORANGE, lw=0.9, ls="--")
    axis.set_yticks(y, [name for name, _ in rows])
    axis.invert_yaxis()
    axis.set_xlabel("distance to the Kinect's joints [cm]; dashed: targets over all", fontsize=8.5)
    axis.set_title("by action", fontsize=9)
    axis.margins(x=0.12)
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2, fontsize=8, frameon=False)

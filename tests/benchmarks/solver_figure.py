# SPDX-License-Identifier: Apache-2.0
"""The figure on the two solvers: how fast Gauss-Newton closes in, and a hinge at its limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy import ndarray

from kintrack.files import write_atomically

_STYLES = {
    "no limits": {"color": "#999999", "ls": ":", "lw": 1.4},
    "gauss-newton": {"color": "#0072b2", "ls": "-", "lw": 2.4},
    "ipopt": {"color": "#d55e00", "ls": "--", "lw": 1.4},
}


@dataclass(frozen=True)
class LimitTrace:
    """One hinge over the frames of a recording."""

    hinge: str
    """Its name and the recording's."""
    lower_deg: float
    """Lower limit [deg]."""
    upper_deg: float
    """Upper limit [deg]."""
    angles_deg: dict[str, Float[ndarray, " f"]]
    """How it was solved -> angle per frame [deg]."""


def write_figure(steps: Sequence[int], agreements, trace: LimitTrace, path: Path) -> None:
    """Draw the figure into a PNG file."""
    figure = Figure(figsize=(9.6, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    _closing_in(left, steps, agreements)
    _hinge(right, trace)
    for axis in (left, right):
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(labelsize=8)
        axis.grid(alpha=0.3, lw=0.5)
    write_atomically(path, lambda file: figure.savefig(file, format="png", dpi=150))


def _closing_in(axis: Axes, steps: Sequence[int], agreements) -> None:
    groups = {
        "no limit active": ("#0072b2", [a.excess for a in agreements if a.active == 0]),
        "limits active": ("#d55e00", [a.excess for a in agreements if a.active > 0]),
    }
    for says, (color, members) in groups.items():
        if not members:
            continue
        excess = 100 * np.maximum(np.array(members), 1e-8)
        label = f"{says} ({len(members)} problems)"
        axis.plot(steps, np.median(excess, axis=0), "o-", ms=3, color=color, label=label)
        axis.plot(steps, np.percentile(excess, 95, axis=0), ls=":", color=color)
    axis.axhline(1.0, color="black", lw=0.8, ls="--")
    axis.set(xscale="log", yscale="log", xticks=steps, xticklabels=[str(s) for s in steps])
    axis.set_xlabel("Gauss-Newton steps on one problem", fontsize=8.5)
    axis.set_ylabel("cost above IPOPT's minimum [%]", fontsize=8.5)
    axis.set_title("median, dotted: 95th percentile; dashed: 1 %", fontsize=9)
    axis.legend(fontsize=8, frameon=False)


def _hinge(axis: Axes, trace: LimitTrace) -> None:
    for says, angles in trace.angles_deg.items():
        axis.plot(angles, label=says, **_STYLES[says])
    near = min(
        (trace.lower_deg, trace.upper_deg),
        key=lambda limit: float(np.nanmin(np.abs(trace.angles_deg["gauss-newton"] - limit))),
    )
    axis.axhline(near, color="black", lw=0.8, ls="--", label=f"limit, {near:.0f} deg")
    axis.set_xlabel("frame after the start", fontsize=8.5)
    axis.set_ylabel("angle [deg]", fontsize=8.5)
    axis.set_title(trace.hinge, fontsize=9)
    axis.legend(fontsize=8, frameon=False, ncols=2)

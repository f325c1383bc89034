# SPDX-License-Identifier: Apache-2.0
"""The figure on sensor models: their errors over depth, and their images beside real ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy import ndarray

from kintrack.files import write_atomically

CURVES = {
    "step": "Kinect v1: step to the next level [mm]",
    "plane": "Kinect v1: residual of planes [mm]",
    "kinect_v2": "Kinect v2: deviation over time [mm]",
    "stereo": "active stereo: deviation over a wall [mm]",
}
"""Panel -> its title."""

_COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#000000", "#e69f00", "#56b4e9")


@dataclass(frozen=True)
class Curve:
    """A line of a panel."""

    name: str
    """As the legend says it."""
    depth_m: Float[ndarray, " n"]
    """Depth [m]."""
    value_mm: Float[ndarray, " n"]
    """What the panel shows [mm]."""
    reference: bool
    """Whether it is a recording or a published curve, not a model."""


def write_figure(
    curves: Mapping[str, Sequence[Curve]], images: Mapping[str, Float[ndarray, "h w"]], path: Path
) -> None:
    """Draw the figure into a PNG file."""
    figure = Figure(figsize=(13.0, 8.6), layout="constrained")
    top, bottom = figure.subfigures(2, 1, height_ratios=(1.0, 1.35))
    for axis, (name, title) in zip(top.subplots(1, len(CURVES)), CURVES.items(), strict=True):
        _draw(axis, curves[name], title)
    for column, (name, depth) in zip(
        bottom.subplots(2, len(images)).T, images.items(), strict=True
    ):
        column[0].imshow(_colored(depth), interpolation="nearest")
        column[1].imshow(_shaded(depth), cmap="gray", vmin=0, vmax=1, interpolation="nearest")
        column[0].set_title(name, fontsize=9)
        for axis in column:
            axis.set_axis_off()
    write_atomically(path, lambda file: figure.savefig(file, format="png", dpi=130))


def _draw(axis: Axes, curves: Sequence[Curve], title: str) -> None:
    for curve, color in zip(curves, _COLORS, strict=False):
        style = {"ls": "--"} if curve.reference else {"ls": "-", "lw": 2.0}
        order = np.argsort(curve.depth_m)
        axis.plot(
            curve.depth_m[order], curve.value_mm[order], color=color, label=curve.name, **style
        )
    axis.set_title(title, fontsize=9)
    axis.set_xlabel("depth [m]", fontsize=8.5)
    axis.set(xlim=(0.5, 4.6), ylim=(0.0, None))
    axis.grid(alpha=0.3, lw=0.5)
    axis.tick_params(labelsize=8)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(fontsize=7, frameon=False)


def _colored(depth_m: Float[ndarray, "h w"]) -> Float[ndarray, "h w 3"]:
    """Depth from 0.8 to 4.2 m as colour, holes black."""
    color = colormaps["turbo"](np.clip((depth_m - 0.8) / 3.4, 0.0, 1.0))[..., :3]
    return color * (depth_m > 0)[..., None]


def _shaded(depth_m: Float[ndarray, "h w"]) -> Float[ndarray, "h w"]:
    """Brightness of the surface under slanting light, holes black."""
    h, w = depth_m.shape
    f = 0.8 * w
    rays = np.dstack([*np.meshgrid((np.arange(w) - w / 2) / f, (np.arange(h) - h / 2) / f)])
    points = np.dstack([rays, np.ones((h, w))]) * depth_m[..., None]
    normal = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-12)
    return np.abs(normal @ [0.3, -0.4, 0.87]) * (depth_m > 0)

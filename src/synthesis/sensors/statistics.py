# SPDX-License-Identifier: Apache-2.0
"""How a depth sensor errs, measured on its images alone: no truth is needed.

The same functions look at real recordings and at synthetic ones. 0 = no reading everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray
from numpy.lib.stride_tricks import sliding_window_view

EDGE_M = 0.25
"""Depth between neighbouring readings that makes an edge [m]."""
GAP_PX = 40
"""Longer runs of holes do not belong to an edge [px]."""


def quantisation_steps(
    depths_m: Float[ndarray, "t h w"],
) -> tuple[Float[ndarray, " n"], Float[ndarray, " n"]]:
    """Levels that a sensor reports and the step from each to the next.

    Returns:
        Level [m] and step [m], shape (N,) each; levels met fewer than 10 times are left out.
    """
    levels, count = np.unique(np.round(depths_m[depths_m > 0], 4), return_counts=True)
    levels = levels[count >= 10]
    return levels[:-1], np.diff(levels)


def plane_residuals(
    depths_m: Float[ndarray, "t h w"], window_px: int, stride_px: int = 4, most: float = 0.02
) -> tuple[Float[ndarray, " n"], Float[ndarray, " n"]]:
    """Root mean square distance from the plane that fits each full window best.

    A plane is 1/z linear in the pixel, so the fit is linear least squares on 1/z.

    Args:
        depths_m: Images [m].
        window_px: Side of the window [px].
        stride_px: Between windows [px].
        most: Windows with a residual beyond this share of the depth hold an edge and are left out.

    Returns:
        Median depth [m] and residual along z [m] of each window, shape (N,) each.
    """
    half = (window_px - 1) / 2
    v, u = np.indices((window_px, window_px)).reshape(2, -1) - half
    basis = np.linalg.qr(np.column_stack([np.ones(window_px**2), u, v]))[0]
    z_m, rms_m = [np.empty(0)], [np.empty(0)]
    for depth in depths_m:
        windows = sliding_window_view(depth, (window_px, window_px))[::stride_px, ::stride_px]
        windows = windows.reshape(-1, window_px**2)
        windows = windows[np.all(windows > 0, axis=1)].astype(float)
        inverse = 1.0 / windows
        residual = inverse - (inverse @ basis) @ basis.T
        z = np.median(windows, axis=1)
        flat = np.abs(residual).max(axis=1, initial=0.0) * z < most
        z_m.append(z[flat])
        rms = np.sqrt(np.sum(residual[flat] ** 2, axis=1) / (window_px**2 - 3))
        rms_m.append(rms * z[flat] ** 2)
    return np.concatenate(z_m), np.concatenate(rms_m)


def temporal_std(
    depths_m: Float[ndarray, "t h w"], most: float = 0.02
) -> tuple[Float[ndarray, " n"], Float[ndarray, " n"]]:
    """Standard deviation over time of pixels that always read and see nothing move.

    Args:
        depths_m: Images of a camera that stands still [m].
        most: A pixel whose range exceeds this share of its depth is left out.

    Returns:
        Mean depth [m] and standard deviation [m] of each pixel, shape (N,) each.
    """
    mean = depths_m.mean(axis=0)
    still = (depths_m > 0).all(axis=0) & (np.ptp(depths_m, axis=0) < most * mean)
    return mean[still], depths_m[:, still].std(axis=0, ddof=1)


@dataclass(frozen=True)
class Edges:
    """Places where depth jumps along a row, across holes or not."""

    frame: Int[ndarray, " n"]
    """Image."""
    row: Int[ndarray, " n"]
    """Row."""
    column: Int[ndarray, " n"]
    """Last reading of the nearer surface [px]."""
    gap_px: Int[ndarray, " n"]
    """Holes between the surfaces."""
    near_m: Float[ndarray, " n"]
    """Depth of the nearer surface [m]."""
    far_m: Float[ndarray, " n"]
    """Depth of the farther surface [m]."""
    near_right: Bool[ndarray, " n"]
    """Whether the nearer surface is the one to the right."""


def edges(depths_m: Float[ndarray, "t h w"]) -> Edges:
    """Every depth edge along rows; holes between its surfaces count up to `GAP_PX`."""
    t, v, u = np.nonzero(depths_m > 0)
    after = (t[1:] == t[:-1]) & (v[1:] == v[:-1])
    z = depths_m[t, v, u].astype(float)
    gap = u[1:] - u[:-1] - 1
    jump = z[1:] - z[:-1]
    i = np.flatnonzero(after & (gap <= GAP_PX) & (np.abs(jump) > EDGE_M))
    right = jump[i] < 0
    return Edges(
        t[i],
        v[i],
        np.where(right, u[i + 1], u[i]),
        gap[i],
        np.minimum(z[i], z[i + 1]),
        np.maximum(z[i], z[i + 1]),
        right,
    )


def raggedness_px(found: Edges, lag_px: int = 1) -> float:
    """How far edges stray from straight lines between rows a lag apart [px].

    Root mean square of u(v - k) - 2 u(v) + u(v + k), over sqrt(6): the standard deviation of
    strays that rows do not share. Edges that run on by more than 4 px a row are left out.
    """
    key = np.stack([found.frame, found.row, found.near_right.astype(int)], axis=1)
    order = np.lexsort([found.column, *key.T[::-1]])
    at: dict[tuple[int, ...], list[int]] = {}
    for k in order:
        at.setdefault(tuple(map(int, key[k])), []).append(int(found.column[k]))
    reach = 4 * lag_px
    second = []
    for (frame, row, side), columns in at.items():
        above, below = (np.array(at.get((frame, row + s, side), [])) for s in (-lag_px, lag_px))
        if len(above) and len(below):
            for u in columns:
                a, b = above[np.abs(above - u).argmin()], below[np.abs(below - u).argmin()]
                if abs(a - u) <= reach and abs(b - u) <= reach:
                    second.append(a - 2 * u + b)
    return float(np.sqrt(np.mean(np.square(second)) / 6.0)) if second else float("nan")


def hole_share_beside_edges(depths_m: Float[ndarray, "t h w"]) -> float:
    """Share of the holes that lie between the two surfaces of an edge along the row."""
    holes = int(np.count_nonzero(depths_m <= 0))
    return float(edges(depths_m).gap_px.sum() / max(holes, 1))


def hole_share_by_depth(
    depths_m: Float[ndarray, "t h w"], bounds_m: Float[ndarray, " b1"]
) -> Float[ndarray, " b"]:
    """Share of holes by depth; a hole has the depth of the farther reading beside it in the row.

    Args:
        depths_m: Images [m].
        bounds_m: Bounds of the bins [m], shape (B + 1,).

    Returns:
        Share of holes, NaN where a bin is empty, shape (B,).
    """
    n = depths_m.shape[-1]
    column = np.arange(n)
    left = np.maximum.accumulate(np.where(depths_m > 0, column, 0), axis=-1)
    right = np.minimum.accumulate(np.where(depths_m > 0, column, n - 1)[..., ::-1], axis=-1)
    filled = np.maximum(
        np.take_along_axis(depths_m, left, -1), np.take_along_axis(depths_m, right[..., ::-1], -1)
    )
    every = np.histogram(filled[filled > 0], bounds_m)[0]
    holes = np.histogram(filled[(filled > 0) & (depths_m <= 0)], bounds_m)[0]
    return np.where(every > 0, holes / np.maximum(every, 1), np.nan)


def flying_share(depths_m: Float[ndarray, "t h w"]) -> float:
    """Share of the readings amid an edge that float between its surfaces.

    Amid an edge are readings whose neighbours two columns away lie `EDGE_M` or more apart; those
    farther than a quarter of that from both float.
    """
    a, b, c = depths_m[..., :-4], depths_m[..., 2:-2], depths_m[..., 4:]
    amid = (a > 0) & (b > 0) & (c > 0) & (np.abs(a - c) > EDGE_M)
    low, high = np.minimum(a, c), np.maximum(a, c)
    margin = 0.25 * (high - low)
    floats = amid & (b > low + margin) & (b < high - margin)
    return float(floats.sum() / max(int(amid.sum()), 1))

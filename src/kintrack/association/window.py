# SPDX-License-Identifier: Apache-2.0
"""Association by window search [Wan19, Walsman17], and its reverse.

Skin to pixels: every visible vertex projects into the depth image and takes the nearest observed
3-D point in a window around that pixel. Pixels to skin: a regular subset of the observed pixels
takes the nearest visible vertex, so that an arm which the model does not cover pulls it back.
Where the image is labelled, background never pairs [Wan19]. A pair of two different parts counts as
longer than it is: with true labels that is as good as forbidding it, and a network errs.
"""

from __future__ import annotations

import math
import os
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numba import njit
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.association.observation import Observation


class Pairs(NamedTuple):
    """Vertices and the observed points they should lie on."""

    vertex: Int[ndarray, " n"]
    """Vertex index."""
    points_camera: Float[ndarray, "n 3"]
    """Observed point, camera frame [m]."""
    from_skin: int
    """How many of the pairs were found from the skin; they come first."""


PART_M = 0.08
"""Networks take one part for another: so far apart do pairs of two parts seem to be [m]."""
APART_M = 10.0
"""Parts lie this far from each other along the fourth axis of the tree [m]; above any gate."""
MAX_HALF_WINDOW = 8
"""Pixels looked at on each side of the projection; wider windows skip pixels evenly."""


def associate(
    observation: Observation,
    vertices_camera: Float[ndarray, "v 3"],
    visible: Bool[ndarray, " v"],
    gate_m: float,
    pixel_gate_m: float,
    pixel_pairs: int,
    vertex_labels: UInt8[ndarray, " v"],
    part_m: float = PART_M,
) -> Pairs:
    """Pair skin and observation in both directions.

    Args:
        observation: Observed points with the region that may be the person.
        vertices_camera: Skin vertices, camera frame [m].
        visible: Vertices that may pair.
        gate_m: Largest distance of a pair found from the skin [m].
        pixel_gate_m: Largest distance of a pair found from a pixel [m].
        pixel_pairs: About how many pixels look for a vertex; 0 for the paper's one direction.
        vertex_labels: Body part of every vertex; counts only where the observation is labelled.
        part_m: By how much a pair of two different parts counts as longer, squares added [m]; above
            both gates no such pair is made [Wan19, 5].

    Returns:
        The pairs, in a fixed order.
    """
    index = np.flatnonzero(visible)
    camera = observation.camera
    searched = _second_core().submit(
        _search,
        vertices_camera[index],
        observation.points_camera,
        _wanted(observation),
        vertex_labels[index] if observation.labels is not None else np.ones(len(index), np.uint8),
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        gate_m,
        part_m,
    )
    seen, part = sample_region(observation, pixel_pairs)
    if len(seen) and len(index):
        skin, skin_part = vertices_camera[index], vertex_labels[index]
        nearest = _nearest(skin, skin_part, seen, part, pixel_gate_m, part_m)
        near = nearest < len(index)
        seen, taken = seen[near], index[nearest[near]]
    else:
        seen, taken = seen[:0], index[:0]
    pixel = searched.result()
    found = pixel >= 0
    flat = observation.points_camera.reshape(-1, 3)
    return Pairs(
        np.concatenate([index[found], taken]),
        np.concatenate([flat[pixel[found]], seen]),
        int(found.sum()),
    )


def _nearest(
    skin: Float[ndarray, "v 3"],
    skin_part: UInt8[ndarray, " v"],
    points: Float[ndarray, "n 3"],
    part: UInt8[ndarray, " n"] | None,
    gate_m: float,
    part_m: float,
) -> Int[ndarray, " n"]:
    """Nearest vertex of each point, V where none is near enough."""
    if part is None:
        return _ask(skin, points, gate_m)[1]
    own = np.column_stack([skin, APART_M * skin_part])
    distance, nearest = _ask(own, np.column_stack([points, APART_M * part]), gate_m)
    if part_m < gate_m:
        across, anywhere = _ask(skin, points, math.sqrt(gate_m**2 - part_m**2))
        nearest = np.where(np.hypot(across, part_m) < distance, anywhere, nearest)
    return nearest


def _ask(
    skin: Float[ndarray, "v d"], points: Float[ndarray, "n d"], gate_m: float
) -> tuple[Float[ndarray, " n"], Int[ndarray, " n"]]:
    """Distance to the nearest vertex and which it is; infinite and V beyond the gate."""
    tree = cKDTree(skin, balanced_tree=False, compact_nodes=False)
    distance, nearest = map(np.asarray, tree.query(points, distance_upper_bound=gate_m))
    return distance, nearest


@cache
def _second_core() -> ThreadPoolExecutor:
    """Threads for the window search, which runs beside the tree search."""
    return ThreadPoolExecutor(max_workers=2, thread_name_prefix="kintrack-window")


os.register_at_fork(after_in_child=_second_core.cache_clear)


def sample_region(
    observation: Observation, count: int
) -> tuple[Float[ndarray, "n 3"], UInt8[ndarray, " n"] | None]:
    """About `count` points of the region on a regular pixel grid.

    Returns:
        Points in the camera frame [m], and their labels, none of them 0, if there are any.
    """
    if not count:
        return np.zeros((0, 3)), None
    wanted = _wanted(observation)
    step = max(1, int(np.sqrt(np.count_nonzero(wanted) / count)))
    label = wanted[::step, ::step]
    thin = label > 0
    points = observation.points_camera[::step, ::step][thin]
    return points, None if observation.labels is None else label[thin]


def _wanted(observation: Observation) -> UInt8[ndarray, "h w"]:
    """Label with which a pixel may pair, 0 for none; 1 throughout the region without labels."""
    region = observation.region.view(np.uint8)
    return region if observation.labels is None else observation.labels * region


@njit(cache=True, nogil=True)
def _search(v, points, wanted, part, fx, fy, cx, cy, gate, part_m):
    h, w = wanted.shape
    out = np.full(v.shape[0], -1, dtype=np.int64)
    for i in range(v.shape[0]):
        x, y, z = v[i, 0], v[i, 1], v[i, 2]
        u = int(np.floor(fx * x / z + cx + 0.5))
        r = int(np.floor(fy * y / z + cy + 0.5))
        half = int(np.ceil(fx * gate / z))
        step = (half + MAX_HALF_WINDOW - 1) // MAX_HALF_WINDOW
        half = half // step * step
        best = gate * gate
        above = max(0, -((r - half) // step)) * step if r < half else 0
        left = max(0, -((u - half) // step)) * step if u < half else 0
        for a in range(r - half + above, min(h, r + half + 1), step):
            for b in range(u - half + left, min(w, u + half + 1), step):
                if wanted[a, b] == 0:
                    continue
                dx = points[a, b, 0] - x
                dy = points[a, b, 1] - y
                dz = points[a, b, 2] - z
                d = dx * dx + dy * dy + dz * dz
                if wanted[a, b] != part[i]:
                    d += part_m * part_m
                if d < best:
                    best = d
                    out[i] = a * w + b
    return out

# SPDX-License-Identifier: Apache-2.0
"""Smooth noise from hashed lattice points: no state, the same value at the same place."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numba import njit
from numpy import ndarray


def noise(points: Float[ndarray, "n 3"], seed: int = 0) -> Float[ndarray, " n"]:
    """Smooth value noise in -1..1 with lattice spacing 1, shape (N,)."""
    return _noise(np.ascontiguousarray(points, dtype=float), seed)


def rough(points: Float[ndarray, "n 3"], seed: int = 0, octaves: int = 3) -> Float[ndarray, " n"]:
    """Sum of noise at doubled frequencies and halved heights, within -1..1, shape (N,)."""
    total, height = np.zeros(len(points)), 1.0
    for n in range(octaves):
        total += height * noise(points * 2.0**n, seed + 7919 * n)
        height *= 0.5
    return total / (2.0 - 2.0 * height)


def cells(points: Float[ndarray, "n 3"], seed: int = 0) -> Float[ndarray, " n"]:
    """A random number in 0..1 for the unit cell of each point, shape (N,)."""
    return _cells(np.ascontiguousarray(np.floor(points)), seed)


@njit(cache=True)
def _hash(x, y, z, seed):
    h = np.uint64(x * 73856093) ^ np.uint64(y * 19349663) ^ np.uint64(z * 83492791)
    h = (h ^ np.uint64(seed)) * np.uint64(0x9E3779B97F4A7C15)
    h = (h ^ (h >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    h = h ^ (h >> np.uint64(32))
    return np.float64(h & np.uint64(0xFFFFFF)) / 16777215.0


@njit(cache=True)
def _cells(points, seed):
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        out[i] = _hash(np.int64(points[i, 0]), np.int64(points[i, 1]), np.int64(points[i, 2]), seed)
    return out


@njit(cache=True)
def _noise(points, seed):
    out = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        x, y, z = np.floor(points[i, 0]), np.floor(points[i, 1]), np.floor(points[i, 2])
        u, v, w = points[i, 0] - x, points[i, 1] - y, points[i, 2] - z
        u, v, w = u * u * (3.0 - 2.0 * u), v * v * (3.0 - 2.0 * v), w * w * (3.0 - 2.0 * w)
        total = 0.0
        for a in range(2):
            for b in range(2):
                for c in range(2):
                    share = (u if a else 1.0 - u) * (v if b else 1.0 - v) * (w if c else 1.0 - w)
                    total += share * _hash(np.int64(x) + a, np.int64(y) + b, np.int64(z) + c, seed)
        out[i] = 2.0 * total - 1.0
    return out

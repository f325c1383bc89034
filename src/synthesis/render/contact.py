# SPDX-License-Identifier: Apache-2.0
"""How things near the floor keep diffuse light from it.

A map of the floor says which cells have something low, at knee or at hip height above them; each
map is blurred by about its height and takes its share of the light, a coarse stand-in for the solid
angle that the things cover.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

CELL_M = 0.04
"""Side of a cell [m]."""
LAYERS = ((0.012, 0.15, 0.05, 0.6), (0.15, 0.6, 0.16, 0.35), (0.6, 1.2, 0.4, 0.25))
"""Least and largest height [m], blur [m], share of the light that full cover takes."""
REACH_M = 0.8
"""How far the map goes beyond the things [m]."""
LARGEST_M = 12.0
"""Largest side of the map [m]."""
FLOOR_M = 0.03
"""Surfaces that look up below this height are floor [m]."""
PLASTIC = (0.7548776662466927, 0.5698402909980532)
"""Steps that fill a square evenly: inverse of the plastic number and its square (Roberts 2018)."""


class FloorMap(NamedTuple):
    """Share of diffuse light that reaches the floor."""

    corner: Float[ndarray, " 2"]
    """Of the first cell, world x and y [m]."""
    share: Float[ndarray, "a b"]
    """By cell along x and y, 0..1; 1 outside."""


class Sampling(NamedTuple):
    """Points on a mesh that move with it."""

    face: Int[ndarray, " n"]
    """Triangle of each."""
    u: Float[ndarray, " n"]
    """Weight of its second corner."""
    v: Float[ndarray, " n"]
    """Weight of its third corner."""


def floor_map(points_world: Float[ndarray, "n 3"]) -> FloorMap:
    """The map under a cloud of points on the things' surfaces.

    Args:
        points_world: Points [m]; what lies on the floor or above 1.2 m has no effect.
    """
    low = points_world[points_world[:, 2] < LAYERS[-1][1]]
    if len(low) == 0:
        return FloorMap(np.zeros(2), np.ones((1, 1), dtype=np.float32))
    middle = 0.5 * (low[:, :2].min(axis=0) + low[:, :2].max(axis=0))
    size = np.minimum(np.ptp(low[:, :2], axis=0) + 2.0 * REACH_M, LARGEST_M)
    corner = middle - 0.5 * size
    covered = _covered(low, corner, *np.ceil(size / CELL_M).astype(int))
    share = np.ones(covered.shape[1:], dtype=np.float32)
    for cells, (_, _, blur_m, taken) in zip(covered, LAYERS, strict=True):
        share *= 1.0 - taken * cv2.GaussianBlur(cells, (0, 0), blur_m / CELL_M)
    return FloorMap(corner, share)


def darken(
    diffuse: Float[ndarray, "n 3"],
    place: Float[ndarray, "n 3"],
    normal: Float[ndarray, "n 3"],
    floor: FloorMap,
) -> None:
    """Take from the diffuse light of the floor, in place.

    Args:
        diffuse: Radiance, changed.
        place: Where, world frame [m].
        normal: Unit normals there.
        floor: The map.
    """
    _darken(diffuse, place, normal, *floor)


def surface_sampling(vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"]) -> Sampling:
    """Points on a mesh, two for each cell's area; the same for the same mesh."""
    a, b, c = np.moveaxis(np.asarray(vertices, dtype=float)[faces], 1, 0)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    count = np.diff(np.floor(2.0 * np.cumsum(area) / CELL_M**2), prepend=0.0)
    face = np.repeat(np.arange(len(a)), count.astype(int))
    n = np.arange(len(face))
    u, v = n * PLASTIC[0] % 1.0, n * PLASTIC[1] % 1.0
    over = u + v > 1.0
    return Sampling(face, np.where(over, 1.0 - u, u), np.where(over, 1.0 - v, v))


def surface_points(
    vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"], sampling: Sampling
) -> Float[ndarray, "n 3"]:
    """Where the points of a sampling are, shape (N, 3)."""
    return np.asarray(_points(vertices, faces, *sampling))


@njit(cache=True)
def _points(vertices, faces, face, u, v):
    out = np.empty((face.shape[0], 3))
    for n in range(face.shape[0]):
        a, b, c = faces[face[n], 0], faces[face[n], 1], faces[face[n], 2]
        w = 1.0 - u[n] - v[n]
        for k in range(3):
            out[n, k] = w * vertices[a, k] + u[n] * vertices[b, k] + v[n] * vertices[c, k]
    return out


@njit(cache=True)
def _covered(points, corner, width, height):
    out = np.zeros((len(LAYERS), width, height), dtype=np.float32)
    for n in range(points.shape[0]):
        i = int(np.floor((points[n, 0] - corner[0]) / CELL_M))
        j = int(np.floor((points[n, 1] - corner[1]) / CELL_M))
        if 0 <= i < width and 0 <= j < height:
            for k in range(len(LAYERS)):
                if LAYERS[k][0] <= points[n, 2] < LAYERS[k][1]:
                    out[k, i, j] = 1.0
    return out


@njit(cache=True)
def _darken(diffuse, place, normal, corner, share):
    width, height = share.shape
    for n in range(diffuse.shape[0]):
        if normal[n, 2] < 0.9 or abs(place[n, 2]) > FLOOR_M:
            continue
        x, y = (place[n, 0] - corner[0]) / CELL_M - 0.5, (place[n, 1] - corner[1]) / CELL_M - 0.5
        i, j = int(np.floor(x)), int(np.floor(y))
        if i < 0 or j < 0 or i + 1 >= width or j + 1 >= height:
            continue
        a, b = x - i, y - j
        near = (1 - b) * share[i, j] + b * share[i, j + 1]
        far = (1 - b) * share[i + 1, j] + b * share[i + 1, j + 1]
        light = (1 - a) * near + a * far
        for c in range(3):
            diffuse[n, c] *= light

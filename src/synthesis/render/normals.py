# SPDX-License-Identifier: Apache-2.0
"""Normals that are smooth on curved surfaces and break at edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

EDGE_RAD = np.radians(40.0)
"""Triangles at one vertex that are turned against each other by more than this form an edge."""


@dataclass(frozen=True)
class Smoothing:
    """Which corners of triangles share a normal."""

    groups: Int[ndarray, "f 3"]
    """Group of each corner."""
    count: int
    """How many groups there are."""


def smoothing(vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"]) -> Smoothing:
    """Corners at one vertex share a normal if a chain of triangles without an edge joins them.

    Args:
        vertices: Vertices in the shape that says what is an edge.
        faces: Triangles.
    """
    faces = np.ascontiguousarray(faces, dtype=np.int64)
    corners = np.argsort(faces.ravel(), kind="stable")
    first = np.searchsorted(faces.ravel()[corners], np.arange(len(vertices) + 1))
    a, b, c = np.moveaxis(np.asarray(vertices, dtype=float)[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    groups, count = _groups(corners, first, normal, np.cos(EDGE_RAD))
    return Smoothing(groups.reshape(-1, 3), count)


def group_normals(
    vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"], shared: Smoothing
) -> Float[ndarray, "g 3"]:
    """Unit normal of each group, triangles weighted by area, shape (G, 3)."""
    return np.asarray(_normals(vertices, faces, shared.groups, shared.count))


@njit(cache=True)
def _groups(corners, first, normal, cosine):
    groups = np.empty(corners.shape[0], dtype=np.int64)
    count = 0
    for v in range(first.shape[0] - 1):
        of_vertex = corners[first[v] : first[v + 1]]
        groups[of_vertex] = -1
        for seed in of_vertex:
            if groups[seed] >= 0:
                continue
            groups[seed] = count
            grown = True
            while grown:
                grown = False
                for a in of_vertex:
                    if groups[a] != count:
                        continue
                    n = normal[a // 3]
                    for b in of_vertex:
                        m = normal[b // 3]
                        if groups[b] < 0 and n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > cosine:
                            groups[b] = count
                            grown = True
            count += 1
    return groups, count


@njit(cache=True)
def _normals(vertices, faces, groups, count):
    out = np.zeros((count, 3))
    for f in range(faces.shape[0]):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        f0, f1, f2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = e1 * f2 - e2 * f1, e2 * f0 - e0 * f2, e0 * f1 - e1 * f0
        for k in range(3):
            g = groups[f, k]
            out[g, 0] += x
            out[g, 1] += y
            out[g, 2] += z
    for g in range(count):
        size = np.sqrt(out[g, 0] ** 2 + out[g, 1] ** 2 + out[g, 2] ** 2)
        if size > 0.0:
            out[g] /= size
    return out

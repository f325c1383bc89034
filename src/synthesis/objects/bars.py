# SPDX-License-Identifier: Apache-2.0
"""Bent bars, sheets, and where a part goes."""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.typing import ArrayLike

from synthesis.mesh import Material, Mesh, mesh_of
from synthesis.objects.shapes import grid_faces, loft


def put(
    mesh: Mesh,
    at: ArrayLike = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
    pitch: float = 0.0,
    roll: float = 0.0,
) -> Mesh:
    """The mesh rolled about x, pitched about y, turned about z [rad], then moved [m]."""
    return mesh.moved(pose(at, yaw, pitch, roll))


def pose(
    at: ArrayLike, yaw: float = 0.0, pitch: float = 0.0, roll: float = 0.0
) -> Float[ndarray, "4 4"]:
    """T with rotation Rz(yaw) Ry(pitch) Rx(roll) [rad] and translation `at` [m]."""
    (cy, sy), (cp, sp), (cr, sr) = ((math.cos(a), math.sin(a)) for a in (yaw, pitch, roll))
    T = np.eye(4)
    T[:3, :3] = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    T[:3, 3] = at
    return T


def place(at: ArrayLike, y: ArrayLike, z: ArrayLike) -> Float[ndarray, "4 4"]:
    """T_thing_place from where it is and its y and z axes, which must be orthogonal."""
    T = np.eye(4)
    T[:3, 1] = np.asarray(y, dtype=float) / np.linalg.norm(y)
    T[:3, 2] = np.asarray(z, dtype=float) / np.linalg.norm(z)
    T[:3, 0] = np.cross(T[:3, 1], T[:3, 2])
    T[:3, 3] = at
    return T


SAME_PLACE_M = 1e-6
"""Points of a path nearer than this are one [m]."""


def bent(points: ArrayLike, radius: float, steps: int = 4) -> ndarray:
    """A path whose corners are rounded by parabolas that start `radius` before each [m]."""
    knots = np.asarray(points, dtype=float)
    apart = np.linalg.norm(np.diff(knots, axis=0), axis=1) > SAME_PLACE_M
    knots = knots[np.concatenate([[True], apart])]
    path = [knots[0]]
    for before, corner, after in zip(knots[:-2], knots[1:-1], knots[2:], strict=True):
        a, b = before - corner, after - corner
        la, lb = np.linalg.norm(a), np.linalg.norm(b)
        a, b = a / la * min(radius, 0.49 * la), b / lb * min(radius, 0.49 * lb)
        for t in np.linspace(0, 1, steps + 1):
            path.append(corner + (1 - t) ** 2 * a + t**2 * b)
    return np.array([*path, knots[-1]])


def staple(a: ArrayLike, b: ArrayLike, out: ArrayLike, radius: float, steps: int = 2) -> ndarray:
    """A path from a out along `out`, across, and back to b, its corners rounded [m]."""
    first, last, away = (np.asarray(p, dtype=float) for p in (a, b, out))
    return bent(np.stack([first, first + away, last + away, last]), radius, steps)


def tube(
    path: ArrayLike,
    radius: ArrayLike,
    material: Material,
    sides: int = 8,
    flat: float = 1.0,
) -> Mesh:
    """A bar along a path, its rings turning as little as possible.

    Args:
        path: Points [m], shape (M, 3).
        radius: Radius [m], one or one a point.
        material: What it is made of.
        sides: Corners of each ring.
        flat: Thickness over width; below 1 a strap, wide across the path's first bend or, if it
            is straight, across y.
    """
    path = np.asarray(path, dtype=float)
    radii = np.broadcast_to(np.asarray(radius, dtype=float), len(path))
    ways = np.gradient(path, axis=0)
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-12)
    side = _across(ways)
    t = (np.arange(sides) + 0.5) * 2 * np.pi / sides
    rings = []
    for point, way, r in zip(path, ways, radii, strict=True):
        side = side - way * (side @ way)
        side /= np.linalg.norm(side)
        other = np.cross(way, side)
        ring = np.cos(t)[:, None] * side + flat * np.sin(t)[:, None] * other
        rings.append(point + r * ring)
    return loft(np.stack(rings), material)


def _across(ways: ndarray) -> ndarray:
    across = np.cross(ways[0], ways[np.argmin(ways @ ways[0])])
    if np.linalg.norm(across) > 1e-6:
        return across
    return np.eye(3)[1] if abs(ways[0, 1]) < 0.9 else np.eye(3)[0]


def sheet(points: Float[ndarray, "m n 3"], thickness: float, material: Material) -> Mesh:
    """A bent plate: a grid of points [m] and its offset, with a rim.

    The upper side is the one from which n turns right of m.
    """
    points = np.asarray(points, dtype=float)
    m, n = points.shape[:2]
    along, across = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normal = np.cross(across, along)
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
    upper, lower = points + normal * thickness / 2, points - normal * thickness / 2
    u = np.cumsum(np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=2), 0)
    v = np.cumsum(np.linalg.norm(np.diff(points, axis=1, prepend=points[:, :1]), axis=2), 1)
    coords = np.stack([u, v, 0 * u], 2).reshape(-1, 3)
    faces = grid_faces(m, n)
    i = np.arange(m * n).reshape(m, n)
    rim = np.concatenate([i[0, :-1], i[:-1, -1], i[-1, :0:-1], i[:0:-1, 0]])
    after = np.roll(rim, -1)
    sides = np.concatenate(
        [
            np.stack([rim, rim + m * n, after + m * n], 1),
            np.stack([rim, after + m * n, after], 1),
        ]
    )
    return mesh_of(
        np.concatenate([upper.reshape(-1, 3), lower.reshape(-1, 3)]),
        np.concatenate([faces, faces[:, ::-1] + m * n, sides]),
        material,
        np.concatenate([coords, coords]),
    )

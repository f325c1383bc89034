# SPDX-License-Identifier: Apache-2.0
"""Solid shapes to build things from; each stands on z = 0 about the z axis, faces outward.

Places on the material are metres: the first coordinate runs along the grain.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.typing import ArrayLike

from synthesis.mesh import Material, Mesh, mesh_of

SMALLEST_AREA_M2 = 1e-10
"""Triangles below this vanish where rings meet in a point [m^2]."""


def loft(rings: Float[ndarray, "m n 3"], material: Material, lengthwise: bool = True) -> Mesh:
    """A closed skin over rings of points, with flat ends.

    Args:
        rings: Points [m]; each ring turns counter-clockwise about the way to the next ring, and its
            own middle sees all of it.
        material: What it is made of.
        lengthwise: True if the grain runs from ring to ring, False if it runs around them.
    """
    rings = np.asarray(rings, dtype=float)
    m, n = rings.shape[:2]
    closed = np.concatenate([rings, rings[:, :1]], axis=1)  # (m, n+1, 3)
    along = np.linalg.norm(np.diff(rings.mean(axis=1), axis=0), axis=1)
    slope = np.linalg.norm(np.diff(rings, axis=0), axis=2).mean(axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.maximum(along, slope))])
    widest = np.argmax(np.linalg.norm(np.diff(closed, axis=1), axis=2).sum(axis=1))
    around = np.linalg.norm(np.diff(closed[widest], axis=0), axis=1)
    around = np.concatenate([[0.0], np.cumsum(around)])
    u, v = np.meshgrid(along, around, indexing="ij")
    places = np.stack([u, v, 0 * u] if lengthwise else [v, u, 0 * u], axis=2).reshape(-1, 3)
    faces = grid_faces(m, n + 1)
    vertices = [closed.reshape(-1, 3)]
    coords = [places]
    triangles = [faces]
    for ring, first, flip in (
        (rings[0], m * (n + 1), True),
        (rings[-1], m * (n + 1) + n + 1, False),
    ):
        end, end_coords, fan = _end(ring, flip)
        vertices.append(end)
        coords.append(end_coords)
        triangles.append(fan + first)
    points, index = np.concatenate(vertices), np.concatenate(triangles)
    a, b, c = np.moveaxis(points[index], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return mesh_of(points, index[area > SMALLEST_AREA_M2], material, np.concatenate(coords))


def grid_faces(m: int, n: int) -> ndarray:
    """Two triangles per cell of an (m, n) grid, seen from where n turns right of m."""
    i = np.arange(m * n).reshape(m, n)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]
    return np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1, 3)


def _end(ring: ndarray, flip: bool) -> tuple[ndarray, ndarray, ndarray]:
    n = len(ring)
    points = np.concatenate([ring, ring.mean(axis=0, keepdims=True)])
    order = np.argsort(-np.ptp(ring, axis=0), kind="stable")[:2]
    coords = np.zeros((n + 1, 3))
    coords[:, :2] = points[:, order]
    i, after = np.arange(n), np.roll(np.arange(n), -1)
    middle = np.full(n, n)
    return points, coords, np.stack([middle, after, i] if flip else [middle, i, after], axis=1)


def rounded_rectangle(
    size_x: float, size_y: float, corner: float = 0.0, points: int = 4
) -> Float[ndarray, "n 2"]:
    """Outline of a rectangle about the origin, counter-clockwise, (4 or 4 * points, 2) [m]."""
    hx, hy = size_x / 2, size_y / 2
    corners = np.array([[hx, hy], [-hx, hy], [-hx, -hy], [hx, -hy]])
    if corner <= 0:
        return corners
    corner = min(corner, hx, hy)
    turn = np.linspace(0, np.pi / 2, points)
    centres = np.sign(corners) * [hx - corner, hy - corner]
    angles = turn[None] + np.arange(4)[:, None] * np.pi / 2  # (4, p)
    arc = corner * np.stack([np.cos(angles), np.sin(angles)], axis=2)
    return (centres[:, None] + arc).reshape(-1, 2)


def ellipse(radius_x: float, radius_y: float | None = None, sides: int = 24) -> ndarray:
    """Outline of an ellipse (a circle if one radius is given), counter-clockwise, (sides, 2)."""
    t = np.arange(sides) * 2 * np.pi / sides
    return np.stack(
        [radius_x * np.cos(t), (radius_x if radius_y is None else radius_y) * np.sin(t)], 1
    )


def prism(
    outline: Float[ndarray, "n 2"], height: float, material: Material, edge: float = 0.0
) -> Mesh:
    """An outline raised along z, with rims rounded by a radius `edge` [m]."""
    before, after = np.roll(outline, 1, axis=0), np.roll(outline, -1, axis=0)
    way = after - before
    normal = np.stack([way[:, 1], -way[:, 0]], 1) / np.linalg.norm(way, axis=1, keepdims=True)
    if edge <= 0:
        steps = [(0.0, 0.0), (0.0, height)]
    else:
        turn = [edge * (1 - c) for c in (0.0, 0.7071, 1.0)]
        rise = [edge * (1 - c) for c in (1.0, 0.7071, 0.0)]
        steps = [*zip(turn, rise, strict=True)]
        steps += [(inset, height - z) for inset, z in reversed(steps)]
    rings = [
        np.column_stack([outline - inset * normal, np.full(len(outline), z)]) for inset, z in steps
    ]
    size = np.ptp(outline, axis=0)
    return loft(np.stack(rings), material, lengthwise=height >= min(size))


def box(
    size: ArrayLike,
    material: Material,
    edge: float = 0.0,
    corner: float | None = None,
    taper: float = 1.0,
) -> Mesh:
    """A box of size (x, y, z) [m].

    Args:
        size: Lengths along x, y, z [m].
        material: What it is made of.
        edge: Radius of the rims of top and bottom [m].
        corner: Radius of the upright edges [m]; `edge` if None.
        taper: Size of the bottom over that of the top.
    """
    x, y, z = np.asarray(size, dtype=float).tolist()
    edge = min(edge, 0.49 * min(x, y, z))
    corner = max(edge, edge if corner is None else corner)
    insets, heights = [0.0, 0.0], [0.0, z]
    if edge > 0:
        turn = np.array([0.0, 0.5, 1.0]) * np.pi / 2
        insets = [*(edge * (1 - np.sin(turn))), *(edge * (1 - np.cos(turn)))]
        heights = [*(edge * (1 - np.cos(turn))), *(z - edge * (1 - np.sin(turn)))]
    rings = []
    for inset, h in zip(insets, heights, strict=True):
        round_ = max(corner - inset, 1e-5) if corner > 0 else 0.0
        outline = rounded_rectangle(x - 2 * inset, y - 2 * inset, round_, 3)
        outline = outline * (taper + (1 - taper) * h / z)
        rings.append(np.column_stack([outline, np.full(len(outline), h)]))
    mesh = loft(np.stack(rings), material, lengthwise=z >= min(x, y))
    return mesh if corner > 0 else faceted(mesh)


def faceted(mesh: Mesh) -> Mesh:
    """The same triangles without common vertices, so that no light takes their edges as round."""
    index = mesh.faces.reshape(-1)
    return replace(
        mesh,
        vertices=mesh.vertices[index],
        coords=mesh.coords[index],
        labels=mesh.labels[index],
        faces=np.arange(len(index)).reshape(-1, 3),
    )


def cylinder(
    radius: float, height: float, material: Material, edge: float = 0.0, sides: int = 20
) -> Mesh:
    """A round post, rims rounded by `edge` [m]."""
    return prism(ellipse(radius, sides=sides), height, material, min(edge, 0.49 * height))

# SPDX-License-Identifier: Apache-2.0
"""Round and soft shapes; each stands on z = 0 about the z axis, faces outward."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from synthesis.mesh import Material, Mesh
from synthesis.objects.shapes import ellipse, loft


def lathe(profile: ArrayLike, material: Material, sides: int = 24) -> Mesh:
    """A body of revolution about z.

    Args:
        profile: Radius and height [m] from the middle of the bottom, out, up and (for a hollow
            body) down again inside.
        material: What it is made of.
        sides: Corners of each ring.
    """
    turn = ellipse(1.0, sides=sides)
    rings = [
        np.column_stack([r * turn, np.full(sides, z)]) for r, z in np.asarray(profile, dtype=float)
    ]
    return loft(np.stack(rings), material)


def sphere(radius: float, material: Material, sides: int = 32) -> Mesh:
    """A ball."""
    turn = np.linspace(0, np.pi, sides // 2 + 1)
    return lathe(radius * np.column_stack([np.sin(turn), 1 - np.cos(turn)]), material, sides)


def cushion(
    size: ArrayLike, material: Material, softness: float = 0.6, sides: int = 28, rows: int = 9
) -> Mesh:
    """A stuffed block of size (x, y, z): a superellipsoid (Barr 1981), its seam where it is widest.

    Args:
        size: Lengths [m].
        material: Cover.
        softness: 0.2 nearly a box, 1 an ellipsoid.
        sides: Corners of each ring.
        rows: Rings.
    """
    lengths = np.asarray(size, dtype=float)
    axes = np.roll(np.arange(3), 2 - int(np.argmin(lengths)))  # the thinnest comes last
    half = lengths[axes] / 2
    t = (np.arange(sides) + 0.5) * 2 * np.pi / sides
    up = np.linspace(-np.pi / 2, np.pi / 2, rows)
    ring = np.stack([_power(np.cos(t), 0.6 * softness), _power(np.sin(t), 0.6 * softness)], 1)
    wide, high = _power(np.cos(up), softness), _power(np.sin(up), softness)
    rings = np.zeros((rows, sides, 3))
    rings[..., :2] = wide[:, None, None] * ring * half[:2]
    rings[..., 2] = half[2] * high[:, None]
    mesh = loft(rings, material)
    flat = np.abs(mesh.vertices[:, :2]).max(axis=1, keepdims=True)
    deep = half[2] - np.abs(mesh.vertices[:, 2:])
    coords = mesh.vertices * [1, 1, 0] * (1 + deep / np.maximum(flat, 1e-9))
    vertices = np.empty_like(mesh.vertices)
    vertices[:, axes] = mesh.vertices
    vertices[:, 2] += lengths[2] / 2
    return replace(mesh, vertices=vertices, coords=coords)


def _power(x: ndarray, exponent: float) -> ndarray:
    return np.sign(x) * np.abs(x) ** exponent

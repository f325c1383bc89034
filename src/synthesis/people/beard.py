# SPDX-License-Identifier: Apache-2.0
"""Beards, from stubble to full ones, grown on the skin of the jaw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from kintrack.skin import vertex_normals
from synthesis.noise import noise, rough
from synthesis.people.drape import step
from synthesis.people.form import main_surface
from synthesis.people.hair import LINE
from synthesis.people.scalp import Head, of_head
from synthesis.people.sheet import Sheet, cut, smoother, triangulated

UPPER_LINE = (-0.047, -0.047, -0.062, -0.05, -0.02, 0.01)
"""Upper edge of a beard at growing distance from the middle of the face, average head [m]."""


def grow_beard(head: Head, length_m: float, seed: int) -> Sheet:
    """A full beard with free lips.

    Args:
        head: Whose.
        length_m: Length at the chin [m].
        seed: Of its outline.
    """
    person, s = head.person, head.scale
    local = (person.bind_vertices - head.centre) / s
    low = main_surface(person) & (local[:, 2] < 0.03) & (local[:, 2] > -0.15)
    low &= (local[:, 0] > -0.02) & (np.abs(local[:, 1]) < 0.078)
    faces, used = triangulated(person.skin.faces, low[person.skin.faces].all(axis=1))
    x, y, z = local[used].T
    normals = vertex_normals(person.bind_vertices[used], faces)
    mean = smoother(faces, len(used))
    for _ in range(12):
        normals = 0.5 * normals + 0.5 * (mean @ normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    upper = np.interp(np.abs(y), [0.0, 0.022, 0.035, 0.055, 0.066, 0.08], UPPER_LINE)
    lips = np.hypot(y / 0.026, (z + 0.064) / 0.009) - 1.0
    jaw = z + 0.125 + 0.35 * np.maximum(0.03 - x, 0.0)
    field = np.minimum(np.minimum(upper - z, 0.01 * lips), np.minimum(jaw, (x + 0.005) * 0.7))
    field = field + 0.002 * noise(local[used] / 0.008, seed)
    thick = (
        length_m * step(field, -0.002, 0.02) * (0.8 + 0.3 * rough(local[used] / 0.015, seed + 1))
    )
    thick = thick * (0.25 + 0.75 * step(x, 0.005, 0.06))
    vertices = person.bind_vertices[used] + normals * (0.0015 + np.maximum(thick, 0.0))[:, None]
    sheet = of_head(head, vertices, faces, field[:, None])
    skin = np.zeros_like(sheet.weights)
    rows = np.arange(len(used))[:, None]
    np.add.at(skin, (rows, person.skin.links[used]), person.skin.weights[used])
    return cut(replace(sheet, weights=skin), field, LINE)

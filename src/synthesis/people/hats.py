# SPDX-License-Identifier: Apache-2.0
"""Caps, woollen hats and hats with a brim."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.noise import noise
from synthesis.people.drape import step
from synthesis.people.scalp import Head, bowl_faces, directions_at, elevations, of_head, sectors
from synthesis.people.sheet import Sheet, cut, hem, lengthened

RIM = 5
"""Number of the cut along the rim."""
ROWS = 24
HATS = {
    "cap": ((30.0, 8.0), 0.012, ((0.03, -0.002), (0.06, -0.010), (0.085, -0.020))),
    "wool": ((32.0, -18.0), 0.014, ((0.006, 0.002), (0.007, 0.025), (0.003, 0.04))),
    "brim": ((30.0, 12.0), 0.016, ((0.02, -0.001), (0.05, -0.004), (0.08, -0.008))),
}
"""Elevation of the rim in front and behind [deg], thickness, outward and upward steps [m]."""


def put_on_hat(head: Head, kind: str, seed: int) -> Sheet:
    """A hat.

    Args:
        head: Whose.
        kind: One of `HATS`.
        seed: Of its dents.
    """
    (front, back), thick, profile = HATS[kind]
    grid = np.meshgrid(sectors(), elevations(np.radians(back - 8.0), ROWS), indexing="xy")
    azimuth = np.r_[0.0, grid[0].ravel()]
    elevation = np.r_[0.5 * np.pi, grid[1].ravel()]
    d = directions_at(azimuth, elevation)
    high = 0.012 * step(d[:, 2], 0.3, 0.9) * (kind != "brim") + 0.03 * step(d[:, 2], 0.55, 0.8) * (
        kind == "brim"
    )
    dent = 0.003 * noise(d * 4.0, seed)
    vertices = head.centre + d * (head.reach(d) + thick * head.scale + high + dent)[:, None]
    line = np.radians(back + (front - back) * 0.5 * (1.0 + np.cos(azimuth)))
    field = (elevation - line) * 0.09
    sheet = cut(of_head(head, vertices, bowl_faces(ROWS), field[:, None]), field, RIM)
    start = hem(sheet, RIM)
    return lengthened(sheet, RIM, *_rim(head, sheet, start, np.array(profile), kind))


def _rim(
    head: Head, sheet: Sheet, start: ndarray, profile: Float[ndarray, "k 2"], kind: str
) -> tuple[list[ndarray], list[ndarray], list[ndarray], ndarray]:
    """Rows of the rim with their weights, labels and room."""
    top = sheet.vertices[start]
    out = (top - head.centre) * [1.0, 1.0, 0.0]
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    size = step(out[:, 0], 0.45, 0.9) if kind == "cap" else np.ones(len(top))
    forward = np.array([1.0, 0.0, 0.0]) if kind == "cap" else 0.0 * out
    ahead = out * 0.35 + 0.65 * forward if kind == "cap" else out
    rows = [
        top + ahead * (x * size)[:, None] + [0.0, 0.0, 1.0] * ((z * size)[:, None] - 1e-4)
        for x, z in profile
    ]
    k = len(rows)
    return rows, [sheet.weights[start]] * k, [sheet.labels[start]] * k, np.zeros(k)

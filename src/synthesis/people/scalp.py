# SPDX-License-Identifier: Apache-2.0
"""Shells round the skull, on which hair and hats are built."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray
from scipy.spatial import ConvexHull

from synthesis.people.form import dense_weights, main_surface
from synthesis.people.person import Person
from synthesis.people.sheet import Sheet

SECTORS = 72
"""Directions of a shell."""
HEAD_LABEL = 1
HEAD_M = 0.153
"""Base of the skull to crown of the average head [m]."""
EYES_M = 0.105
"""Height of the crown above the centre of the average head [m]."""
ABOVE_EARS_M = (0.045, 0.07)
"""Band below the crown whose width is that of the skull [m]."""


@dataclass(frozen=True)
class Head:
    """A skull without ears."""

    person: Person
    """Whose."""
    centre: Float[ndarray, " 3"]
    """Between the ears at the height of the eyes, root frame [m]."""
    scale: float
    """Size; 1 is the average adult."""
    planes: Float[ndarray, "p 4"]
    """Planes of the convex hull about the centre."""

    def reach(self, directions: Float[ndarray, "n 3"]) -> Float[ndarray, " n"]:
        """Distance from the centre to the skull [m], shape (N,)."""
        along = directions @ self.planes[:, :3].T
        distance = -self.planes[:, 3] / np.where(along > 1e-6, along, 1e-6)
        return np.where(along > 1e-6, distance, np.inf).min(axis=1)

    def link(self, name: str) -> int:
        """Index of a link."""
        return self.person.skin.link_names.index(name)

    def origin(self, name: str) -> Float[ndarray, " 3"]:
        """Origin of a link [m]."""
        return self.person.rig.Ts_root_link[self.link(name)][:3, 3]


def head_of(person: Person) -> Head:
    """The head of a person."""
    head = person.skin.link_names.index("head")
    of_head = main_surface(person) & (dense_weights(person)[:, head] > 0.7)
    points = person.bind_vertices[of_head]
    base, crown = person.rig.Ts_root_link[head][2, 3], points[:, 2].max()
    scale = float((crown - base) / HEAD_M)
    depth = crown - points[:, 2]
    band = (depth > ABOVE_EARS_M[0] * scale) & (depth < ABOVE_EARS_M[1] * scale)
    half, x = np.abs(points[band, 1]).max(), points[band, 0]
    centre = np.array([0.5 * (x.min() + x.max()), 0.0, crown - EYES_M * scale])
    skull = points[points[:, 2] > base - 0.045 * scale] - centre
    skull[:, 1] = np.clip(skull[:, 1], -half, half)
    nose = (skull[:, 2] < 0.02 * scale) & (skull[:, 0] > 0.6 * (x.max() - centre[0]))
    return Head(person, centre, scale, ConvexHull(skull[~nose]).equations)


def directions_at(
    azimuth: Float[ndarray, ...], elevation: Float[ndarray, ...]
) -> Float[ndarray, "... 3"]:
    """Unit vectors; azimuth 0 is forward and grows to the left [rad]."""
    c = np.cos(elevation)
    return np.stack([c * np.cos(azimuth), c * np.sin(azimuth), np.sin(elevation)], axis=-1)


def sectors() -> Float[ndarray, " s"]:
    """Azimuth of each column of a shell [rad]."""
    return (np.arange(SECTORS) / SECTORS * 2.0 - 1.0) * np.pi


def elevations(lowest_rad: float, rows: int) -> Float[ndarray, " r"]:
    """Elevation of each row of a shell below its pole, downwards [rad]."""
    return 0.5 * np.pi - (0.5 * np.pi - lowest_rad) * np.arange(1, rows + 1) / rows


def bowl_faces(rows: int) -> Int[ndarray, "f 3"]:
    """Triangles of a pole followed by rows of `SECTORS` vertices, outwards counter-clockwise."""
    a = np.arange(SECTORS)
    b = (a + 1) % SECTORS
    parts = [np.stack([0 * a, 1 + a, 1 + b], axis=1)]
    for n in range(rows - 1):
        upper, lower = 1 + n * SECTORS, 1 + (n + 1) * SECTORS
        parts.append(np.stack([upper + a, lower + a, lower + b], axis=1))
        parts.append(np.stack([upper + a, lower + b, upper + b], axis=1))
    return np.concatenate(parts)


def of_head(
    head: Head,
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    fields: Float[ndarray, "v k"],
    room_m: Float[ndarray, " v"] | float = 0.0,
) -> Sheet:
    """A sheet that moves with the head; what hangs low moves with neck and chest.

    Args:
        head: Whose.
        vertices: Vertices [m].
        faces: Triangles.
        fields: Fields to cut along.
        room_m: How far each vertex may sway [m].
    """
    n = len(vertices)
    top, neck = head.origin("head")[2] - 0.01, head.origin("neck")[2]
    shoulders = neck - 0.12
    z = vertices[:, 2]
    weights = np.zeros((n, len(head.person.skin.link_names)))
    free = np.clip((z - neck) / (top - neck), 0.0, 1.0)
    low = np.clip((neck - z) / (neck - shoulders), 0.0, 1.0)
    weights[:, head.link("head")] = free
    weights[:, head.link("neck")] = (1.0 - free) * (1.0 - low)
    weights[:, head.link("chest")] = (1.0 - free) * low
    room = np.broadcast_to(np.asarray(room_m, dtype=float), n).copy()
    return Sheet(
        vertices,
        faces,
        weights,
        np.full(n, HEAD_LABEL, np.uint8),
        room,
        0.3 * room,
        np.zeros(n, np.uint8),
        np.full(n, -1),
        fields,
    )

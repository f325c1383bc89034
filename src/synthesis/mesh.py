# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes with materials and part labels: the one form in which anything is rendered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import LABELS


class Pattern(Protocol):
    """Albedo as a function of the place on a material."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Linear red, green, blue reflectance in 0..1, shape (N, 3), at coordinates (N, 3)."""
        ...


@dataclass(frozen=True)
class Material:
    """What a surface does with light."""

    pattern: Pattern
    """Colour."""
    infrared: float = 0.5
    """Reflectance for the sensor's own light (about 850 nm), 0..1."""
    gloss: float = 0.0
    """Share of mirror-like reflection, 0..1."""


@dataclass(frozen=True)
class Mesh:
    """Triangles in one frame, with a place on a material and a body part per vertex."""

    vertices: Float[ndarray, "v 3"]
    """Vertices [m]."""
    faces: Int[ndarray, "f 3"]
    """Triangles, counter-clockwise from outside."""
    coords: Float[ndarray, "v 3"]
    """Where each vertex lies on its material: metres, or (u, v, 0) of an image."""
    materials: tuple[Material, ...]
    """Materials that `face_material` counts."""
    face_material: Int[ndarray, " f"]
    """Material of each triangle."""
    labels: UInt8[ndarray, " v"]
    """Body part of each vertex (`kintrack.geometry.LABELS`), 0 for things."""

    def moved(self, T: Float[ndarray, "4 4"]) -> Mesh:
        """The mesh in another frame: every vertex x becomes R x + t; T may also scale."""
        return replace(self, vertices=self.vertices @ T[:3, :3].T + T[:3, 3])


def mesh_of(
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    material: Material,
    coords: Float[ndarray, "v 3"] | None = None,
    labels: UInt8[ndarray, " v"] | None = None,
    name: str = "mesh",
) -> Mesh:
    """A mesh of one material.

    Args:
        vertices: Vertices [m].
        faces: Triangles.
        material: What it is made of.
        coords: Places on the material; the vertices themselves if None.
        labels: Body parts; background if None.
        name: What to call it in an error.

    Raises:
        SceneError: if there are no faces, a vertex is not finite, an index has no vertex, or a
            label is unknown.
    """
    vertices = np.asarray(vertices, dtype=float).reshape(-1, 3)
    faces = np.asarray(faces, dtype=np.int64).reshape(-1, 3)
    if len(faces) == 0:
        raise SceneError(f"{name}: the mesh has no faces; triangles are needed")
    broken = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(broken):
        raise SceneError(
            f"{name}: vertex {broken[0]} is {vertices[broken[0]].tolist()}; "
            f"{len(broken)} of {len(vertices)} vertices are not finite"
        )
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise SceneError(
            f"{name}: a triangle names vertex {faces.max() if faces.min() >= 0 else faces.min()}; "
            f"0 to {len(vertices) - 1} exist"
        )
    labels = np.zeros(len(vertices), np.uint8) if labels is None else np.asarray(labels, np.uint8)
    if labels.max() >= len(LABELS):
        raise SceneError(f"{name}: label {labels.max()}; 0 to {len(LABELS) - 1} exist")
    coords = vertices if coords is None else np.asarray(coords, dtype=float)
    return Mesh(vertices, faces, coords, (material,), np.zeros(len(faces), np.int64), labels)


def join(meshes: Sequence[Mesh]) -> Mesh:
    """All meshes in one, in order; vertices and faces keep theirs.

    Raises:
        SceneError: if there is none.
    """
    if not meshes:
        raise SceneError("no mesh to join; at least one is needed")
    first_vertex = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    first_material = np.cumsum([0, *(len(mesh.materials) for mesh in meshes)])
    return Mesh(
        vertices=np.concatenate([mesh.vertices for mesh in meshes]),
        faces=np.concatenate(
            [mesh.faces + n for mesh, n in zip(meshes, first_vertex[:-1], strict=True)]
        ),
        coords=np.concatenate([mesh.coords for mesh in meshes]),
        materials=tuple(material for mesh in meshes for material in mesh.materials),
        face_material=np.concatenate(
            [mesh.face_material + n for mesh, n in zip(meshes, first_material[:-1], strict=True)]
        ),
        labels=np.concatenate([mesh.labels for mesh in meshes]),
    )

# SPDX-License-Identifier: Apache-2.0
"""A mesh with all that its triangles say wherever they are."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.mesh import Mesh
from synthesis.render.cast import Caster
from synthesis.render.contact import FloorMap, floor_map, surface_points, surface_sampling
from synthesis.render.normals import group_normals, smoothing
from synthesis.render.shade import infrared


class Part:
    """A mesh with all that does not change when it moves."""

    def __init__(self, mesh: Mesh) -> None:
        """Look at every triangle once.

        Args:
            mesh: In the shape that says what is an edge.
        """
        self.mesh = mesh
        self.infrared = infrared(mesh.materials)[mesh.face_material]
        self.gloss = np.array([m.gloss for m in mesh.materials])[mesh.face_material]
        self.labels = np.sort(mesh.labels[mesh.faces], axis=1)[:, 1]
        self.smoothing = smoothing(mesh.vertices, mesh.faces)
        self.sampling = surface_sampling(mesh.vertices, mesh.faces)
        self._normals: tuple[Caster, ndarray] | None = None

    def normals(self, caster: Caster) -> Float[ndarray, "g 3"]:
        """Normals of the groups of corners, kept until other triangles are asked for."""
        if self._normals is None or self._normals[0] is not caster:
            normals = group_normals(caster.vertices, caster.faces, self.smoothing)
            self._normals = caster, normals
        return self._normals[1]

    def floor_map(self, caster: Caster) -> FloorMap:
        """What the triangles take from the light of the floor."""
        return floor_map(surface_points(caster.vertices, caster.faces, self.sampling))

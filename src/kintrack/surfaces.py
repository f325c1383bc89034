# SPDX-License-Identifier: Apache-2.0
"""The surface of every frame of a written result: loaded, posed, and written as meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.deformation.carry import carried
from kintrack.deformation.relief import Relief, relief_of
from kintrack.errors import ResultError
from kintrack.export.coloring import COLORINGS, colors_of, residuals_of
from kintrack.export.mesh import write_glb, write_ply
from kintrack.files import make_result_folder
from kintrack.fit import load_person
from kintrack.geometry import invert_rigid, transform_points
from kintrack.human import Human, load_human
from kintrack.offsets import SURFACE_FILE, load_offsets
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence.frame import SequenceReader
from kintrack.skin import Skin, load_skin, skinned_vertices, vertex_normals


@dataclass(frozen=True)
class Surfaces:
    """Everything that the surface of a frame needs."""

    human: Human
    """Body; its skin is the tracking skin."""
    T_world_camera: Float[ndarray, "4 4"]
    """Camera pose."""
    track: Track
    """Poses."""
    relief: Relief
    """The skin that is raised."""
    offsets_m: Float[ndarray, "n v"]
    """Offsets of its vertices [m], 0 where there are none."""

    def vertices(self, index: int) -> Float[ndarray, "v 3"] | None:
        """Vertices of a frame, world frame [m]; None where there is no pose."""
        q = self.track.q[index]
        if not np.isfinite(q).all():
            return None
        skin = self.relief.raised(self.offsets_m[index])
        return skinned_vertices(run_kinematics(self.human.body, q), skin)


def load_surfaces(folder: Path, resolution: str = "tracking") -> Surfaces:
    """Read a result.

    Args:
        folder: Result folder; without offsets in it, the skin is as it was at the start.
        resolution: `tracking`, or `display`, whose offsets include the thickness of the clothes.

    Raises:
        ResultError: if a file is missing, broken, or does not fit the others.
    """
    human, T_world_camera = load_person(folder)
    track = Track.load(folder / TRACK_FILE)
    vertices, path = len(human.skin.labels), folder / SURFACE_FILE
    offsets = np.zeros((len(track), vertices))
    if path.exists():
        stored = load_offsets(path)
        if stored.shape != offsets.shape:
            raise ResultError(
                f"{path}: {stored.shape[0]} frames of {stored.shape[1]} vertices; "
                f"{len(track)} of {vertices} are needed"
            )
        offsets = np.nan_to_num(stored)
    if resolution == "tracking":
        relief = relief_of(human.body, human.skin)
        return Surfaces(human, T_world_camera, track, relief, offsets)
    shape = human.shape if len(human.shape) else None
    fine = load_skin(resolution, human.folder, shape)
    raised = offsets + _worn(human, load_human(human.folder, shape).skin)
    offsets = np.stack([carried(human.body, human.skin, fine, row) for row in raised])
    return Surfaces(human, T_world_camera, track, relief_of(human.body, fine), offsets)


def _worn(human: Human, bare: Skin) -> Float[ndarray, " v"]:
    """How far outside the bare skin a human's skin lies, along the bare normals [m]."""
    state = run_kinematics(human.body, human.body.neutral())
    inner, outer = skinned_vertices(state, bare), skinned_vertices(state, human.skin)
    return ((outer - inner) * vertex_normals(inner, bare.faces)).sum(axis=1)


def write_surfaces(
    folder: Path,
    output: Path,
    sequence: SequenceReader | None = None,
    resolution: str = "tracking",
    coloring: str = "offset",
    formats: Sequence[str] = ("ply", "gltf"),
    every: int = 1,
) -> int:
    """Write the surface of every frame with a pose, world frame, z up in PLY, y up in glTF.

    Args:
        folder: Result folder.
        output: Folder for `000000.ply` and `000000.glb`, by frame; made where missing.
        sequence: The recording; needed for residuals.
        resolution: `tracking` or `display`.
        coloring: What the colours mean, one of `COLORINGS`.
        formats: `ply`, `gltf` or both.
        every: Every how many frames.

    Returns:
        How many frames were written.

    Raises:
        ResultError: if an option is unknown, the result is broken, or a file cannot be written.
    """
    if coloring not in COLORINGS:
        raise ResultError(f"coloring {coloring!r}: {', '.join(COLORINGS)} are possible")
    if every < 1 or not formats or not set(formats) <= {"ply", "gltf"}:
        raise ResultError(f"every = {every}, formats = {formats}: 1 or more; ply, gltf")
    if coloring == "residual" and sequence is None:
        raise ResultError("residuals need the recording")
    surfaces = load_surfaces(folder, resolution)
    make_result_folder(output)
    skin, count = surfaces.relief.skin, 0
    T_camera_world = invert_rigid(surfaces.T_world_camera)
    for index in range(0, len(surfaces.track), every):
        vertices, offsets = surfaces.vertices(index), surfaces.offsets_m[index]
        if vertices is None:
            continue
        frame = None if sequence is None else sequence.frame(index)
        seen = transform_points(T_camera_world, vertices)
        colors = colors_of(coloring, skin, offsets, seen, frame)
        path = output / f"{index:06d}"
        if "ply" in formats:
            values = {"offset_m": offsets}
            if frame is not None:
                values["residual_m"] = residuals_of(seen, skin, frame)
            write_ply(path.with_suffix(".ply"), vertices, skin.faces, colors, values)
        if "gltf" in formats:
            normals = vertex_normals(vertices, skin.faces)
            write_glb(path.with_suffix(".glb"), vertices, normals, skin.faces, colors)
        count += 1
    return count

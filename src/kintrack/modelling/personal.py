# SPDX-License-Identifier: Apache-2.0
"""One person's own model folder: URDF, skins and visual meshes, as the model that ships has them.

Bodies are as dense as the average adult's, and a person's mass is shared out between the segments
as hers is; centres, inertias, capsules and the flexion of elbows, knees and hips follow the shape.
"""

from __future__ import annotations

import shutil
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.files import make_result_folder, write_atomically
from kintrack.modelling.limits import CONTACTS, contact_ratios, flexion_limits
from kintrack.modelling.segments import BODY_MASS_INDEX, SegmentBody, segment_bodies
from kintrack.modelling.skeleton import JOINT_OF_SEGMENT, SEGMENTS
from kintrack.modelling.urdf import human_urdf
from kintrack.rig import load_rig, read_arrays
from kintrack.shape import ShapeSpace, checked_shape, load_shape_space


def write_personal_model(
    shape: Float[ndarray, " k"], folder: Path, source: Path | None = None
) -> None:
    """Write a folder that `load_human`, Pinocchio, MuJoCo and planners read.

    Args:
        shape: Shape coefficients.
        folder: Where to write; made where missing, files in it are replaced.
        source: Model folder; the one that ships if None.

    Raises:
        ResultError: if the folder cannot be written.
        ModelError: if the shape does not fit the model.
    """
    space = load_shape_space(source)
    b = checked_shape(space, shape)
    make_result_folder(folder / "skin" / "visual")
    bodies, average = person_bodies(space, b), person_bodies(space, np.zeros(len(b)))
    published = {
        f"{JOINT_OF_SEGMENT[segment.name]}_{hinge.name}": hinge.upper_deg
        for segment in SEGMENTS
        for hinge in segment.hinges
    }
    limits = flexion_limits(
        {hinge: published[hinge] for hinge in CONTACTS},
        contact_ratios(average, _origins(space, np.zeros(len(b)))),
        contact_ratios(bodies, _origins(space, b)),
    )
    display = load_shape_space(source, "display")
    visuals = _write_visuals(display, b, folder)
    text = human_urdf(_frames(space, b), _extra_points(space, b), bodies, visuals, limits)
    write_atomically(folder / "human.urdf", partial(_put, text.encode()))
    for name, skin in (("tracking", space), ("display", display)):
        _write_skin(skin, b, folder / "skin" / f"{name}.npz", name)
    _write_rig(space, b, folder / "skin" / "rig.npz")
    licence = space.folder / "skin" / "LICENSE.md"
    if licence.is_file():
        shutil.copyfile(licence, folder / "skin" / licence.name)


def person_bodies(space: ShapeSpace, b: Float[ndarray, " k"]) -> dict[str, SegmentBody]:
    """Mass, inertia and capsule of a person's links; mass grows with the volume."""
    faces, weights = space.skin.faces, np.zeros((len(space.vertices_m), len(space.rig.link_names)))
    np.put_along_axis(weights, space.skin.links, space.skin.weights, axis=1)
    average_kg = BODY_MASS_INDEX * np.ptp(space.vertices_m[:, 2]) ** 2
    vertices = space.vertices(b)
    mass_kg = average_kg * volume(vertices, faces) / volume(space.vertices_m, faces)
    return segment_bodies(vertices, faces, weights, _frames(space, b), float(mass_kg))


def volume(vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"]) -> float:
    """Volume of a closed surface [m^3]."""
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return float(np.einsum("fi,fi->", np.cross(a, b), c) / 6.0)


def _origins(space: ShapeSpace, b: ndarray) -> dict[str, ndarray]:
    return dict(zip(space.rig.link_names, space.origins(b), strict=True))


def _frames(space: ShapeSpace, b: ndarray) -> dict[str, ndarray]:
    Ts = space.rig.Ts_root_link.copy()
    Ts[:, :3, 3] = space.origins(b)
    return dict(zip(space.rig.link_names, Ts, strict=True))


def _extra_points(space: ShapeSpace, b: ndarray) -> dict[str, tuple[str, ndarray]]:
    """Fixed frames: name -> link and place in it [m]."""
    body = space.body(b)
    out = {}
    for name in space.extra_basis_m:
        frame = body.model.frames[body.model.getFrameId(name)]
        link = int(np.flatnonzero(body.link_joints == frame.parentJoint)[0])
        out[name] = (body.link_names[link], np.array(frame.placement.translation))
    return out


def _write_visuals(display: ShapeSpace, b: ndarray, folder: Path) -> dict[str, str]:
    """One rigid piece of the display skin per link, in the link's frame."""
    weights = np.zeros((len(display.vertices_m), len(display.rig.link_names)))
    np.put_along_axis(weights, display.skin.links, display.skin.weights, axis=1)
    faces = display.skin.faces
    owner = np.sort(weights.argmax(axis=1)[faces], axis=1)[:, 1]
    vertices, files = display.vertices(b), {}
    for i, (name, T) in enumerate(_frames(display, b).items()):
        files[name] = f"skin/visual/{name}.stl"
        triangles = ((vertices - T[:3, 3]) @ T[:3, :3])[faces[owner == i]]
        content = stl(triangles)
        write_atomically(folder / files[name], partial(_put, content))
    return files


def _put(content: bytes, file: BinaryIO) -> None:
    file.write(content)


def stl(triangles: Float[ndarray, "f 3 3"]) -> bytes:
    """Triangles as a binary STL file [m]."""
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    facet = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows = np.zeros(len(triangles), facet)
    rows["normal"] = normals / np.maximum(lengths, 1e-12)
    rows["corners"] = triangles
    return bytes(80) + np.uint32(len(rows)).tobytes() + rows.tobytes()


def _write_skin(space: ShapeSpace, b: ndarray, path: Path, name: str) -> None:
    arrays: dict[str, Any] = read_arrays(
        space.folder / "skin" / f"{name}.npz", "faces", "weight_links", "weights", "labels"
    )
    vertices = space.vertices(b).astype(np.float32)
    none = np.zeros((0, len(vertices), 3), np.float16)
    arrays |= {"vertices_m": vertices, "shape_basis_m": none}
    write_atomically(path, lambda file: np.savez_compressed(file, **arrays))


def _write_rig(space: ShapeSpace, b: ndarray, path: Path) -> None:
    names = load_rig(space.folder).link_names
    arrays: dict[str, Any] = {
        "link_names": np.array(names),
        "link_labels": read_arrays(space.folder / "skin" / "rig.npz", "link_labels")["link_labels"],
        "Ts_root_link_bind": np.stack(list(_frames(space, b).values())),
        "origins_basis_m": np.zeros((0, len(names), 3)),
        "extra_names": np.array(list(space.extra_basis_m)),
        "extra_basis_m": np.zeros((0, len(space.extra_basis_m), 3)),
        "explained_variance": np.zeros(0),
    }
    write_atomically(path, lambda file: np.savez_compressed(file, **arrays))

# SPDX-License-Identifier: Apache-2.0
"""Surfaces from RGB-D images: cut-out objects, and whole rooms to put behind people."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from kintrack.sequence.camera_file import read_camera_file
from kintrack.sequence.folder import open_folder
from kintrack.sequence.images import read_color, read_depth
from synthesis.mesh import Material, Mesh, mesh_of
from synthesis.objects.files import GREY, standing
from synthesis.objects.thing import Thing
from synthesis.patterns import Image

JUMP_M, JUMP_SHARE = 0.04, 0.02
"""Neighbours farther apart than 4 cm + 2 % of their depth are no surface."""
DEPTH_SCALE_M = 0.001
"""Metres per unit where the camera file does not tell."""
INFRARED = 0.5
"""Reflectance of what a depth camera has seen."""
T_TURN_CAMERA = np.array(
    [[0.0, 0.0, -1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""From a level camera to a frame whose x looks back at the camera, z up."""


def load_cutout(folder: Path, frame: int = 0) -> Thing:
    """A thing from one image of a sequence folder whose depth is zero outside of it.

    Args:
        folder: Sequence folder; colour is optional. The camera counts as level.
        frame: Which image.

    Returns:
        What the camera saw of it, standing on z = 0, its seen side forward.

    Raises:
        SequenceError: if the folder cannot be read or has no such frame.
        SceneError: if the frame is unusable or holds no surface.
    """
    seen = open_folder(Path(folder)).frame(frame)
    if seen.depth_m is None:
        raise SceneError(f"cut-out {folder}, frame {frame}: {seen.problem}")
    mesh = scene_mesh(seen.depth_m, seen.color, seen.camera, name=f"cut-out {folder}")
    used = np.unique(mesh.faces)
    index = np.zeros(len(mesh.vertices), dtype=np.int64)
    index[used] = np.arange(len(used))
    mesh = replace(
        mesh,
        vertices=mesh.vertices[used],
        coords=mesh.coords[used],
        labels=mesh.labels[used],
        faces=index[mesh.faces],
    )
    return Thing(Path(folder).name, standing(mesh.moved(T_TURN_CAMERA)))


def scene_mesh(
    depth_m: Float[ndarray, "h w"],
    color: UInt8[ndarray, "h w 3"] | None,
    camera: PinholeCamera,
    name: str = "depth image",
) -> Mesh:
    """The surface that a depth image shows, in the camera frame.

    Args:
        depth_m: Depth along z [m], 0 = no reading.
        color: R G B registered to depth; grey if None.
        camera: Its camera.
        name: What to call it in an error.

    Returns:
        One vertex per pixel with a reading; triangles between neighbours unless depth jumps.

    Raises:
        SceneError: if there is no triangle.
    """
    depth = np.asarray(depth_m, dtype=float)
    h, w = depth.shape
    index = np.full(depth.shape, -1, dtype=np.int64)
    index[depth > 0] = np.arange(np.count_nonzero(depth))
    rows, columns = np.nonzero(depth)
    vertices = camera.back_project(depth)[rows, columns]
    faces = index.reshape(-1)[_triangles(depth)]
    if color is None:
        return mesh_of(vertices, faces, Material(GREY, INFRARED), name=name)
    coords = np.stack([(columns + 0.5) / w, 1.0 - (rows + 0.5) / h, 0.0 * rows], axis=1)
    return mesh_of(vertices, faces, Material(Image(color), INFRARED), coords, name=name)


def _triangles(depth: Float[ndarray, "h w"]) -> Int[ndarray, "f 3"]:
    """Pixel numbers of triangles over neighbours that belong to one surface, facing the camera."""
    i = np.arange(depth.size).reshape(depth.shape)
    a, b, c, d = (x.reshape(-1) for x in (i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]))
    z = depth.reshape(-1)
    skew = np.abs(z[a] - z[c]) > np.abs(z[b] - z[d])
    broken = (z[a] == 0) | (z[c] == 0)
    other = (skew & (z[b] > 0) & (z[d] > 0)) | broken  # cut the quad from b to d
    first = np.where(other[:, None], np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other[:, None], np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    faces = np.concatenate([first, second])
    corners = z[faces]
    near, far = corners.min(axis=1), corners.max(axis=1)
    return faces[(near > 0) & (far - near <= JUMP_M + JUMP_SHARE * near)]


def load_scene_frame(folder: Path, index: int = 0) -> Mesh:
    """The surface that one view of a room shows, in its camera's frame.

    Args:
        folder: A folder of `NNNNNN.depth.png`, `NNNNNN.color.jpg` and a `camera.json`, or a
            sequence folder.
        index: Which view, counted from 0.

    Raises:
        SequenceError: if the folder, its camera or an image cannot be read.
        SceneError: if there is no such view, or it holds no surface.
    """
    folder = Path(folder)
    paths = sorted(folder.glob("*.depth.png"))
    name = f"view {index} of {folder}"
    if not paths:
        seen = open_folder(folder).frame(index)
        if seen.depth_m is None:
            raise SceneError(f"{name}: {seen.problem}")
        return scene_mesh(seen.depth_m, seen.color, seen.camera, name=name)
    if not 0 <= index < len(paths):
        raise SceneError(f"{name}: allowed are 0 to {len(paths) - 1}")
    camera, scale_m = read_camera_file(folder / "camera.json")
    depth_m = read_depth(paths[index], camera, DEPTH_SCALE_M if scale_m is None else scale_m)
    picture = paths[index].with_name(paths[index].name.replace(".depth.png", ".color.jpg"))
    color = read_color(picture, camera) if picture.is_file() else None
    return scene_mesh(depth_m, color, camera, name=name)

# SPDX-License-Identifier: Apache-2.0
"""Things from mesh files: glTF, OBJ, PLY and STL, in metres."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import SceneError
from synthesis.extras import needed
from synthesis.mesh import Material, Mesh, join, mesh_of
from synthesis.objects.thing import Thing
from synthesis.patterns import Image, Plain

SUFFIXES = (".glb", ".gltf", ".obj", ".ply", ".stl")
"""Formats that are read."""
SIZE_M = (0.001, 20.0)
"""Smallest and largest extent of a thing [m]."""
MOST_FACES = 200_000
"""More triangles than this are refused."""
STANDS_M = 0.002
"""How near to zero the lowest point of an axis lies if the thing stands on it [m]."""
GREY = Plain((0.4, 0.4, 0.4))
"""Of meshes that have no colour."""


@dataclass(frozen=True)
class VertexColors:
    """Colours that vary between the vertices: the coords are the linear colour itself."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        return np.clip(coords, 0.0, 1.0)


def load_thing(path: Path, unit_m: float = 1.0, up: str | None = None) -> Thing:
    """Read a mesh file, set it on z = 0 with its middle over the origin.

    glTF says that y points up and z forward; other formats say nothing and are taken with z up and
    x forward. A file whose mesh stands on zero of just one of these axes is believed instead:
    simulators write glTF with z up.

    Args:
        path: The file; its scene graph is applied, textures and colours are kept.
        unit_m: Metres per unit of the file.
        up: "y" or "z"; None to tell by the rule above.

    Raises:
        SceneError: if the file is missing or no mesh, has no faces, too many of them or vertices
            that are not finite, or is smaller than 1 mm or larger than 20 m.
    """
    path = Path(path)
    if up not in (None, "y", "z"):
        raise SceneError(f"{path}: up = {up!r}; allowed: 'y', 'z' or None")
    mesh = join(list(_parts(_scene(path), path)))
    mesh = replace(mesh, vertices=mesh.vertices * unit_m)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    size = high - low
    if not SIZE_M[0] <= size.max() <= SIZE_M[1]:
        raise SceneError(
            f"{path} is {' x '.join(f'{s:.6g}' for s in size)} m large; allowed: {SIZE_M[0]:g} to "
            f"{SIZE_M[1]:g} m. Metres are expected; scale a file that has other units"
        )
    if up is None:
        stands = np.abs(low) < STANDS_M
        up = "y" if path.suffix.lower() in (".glb", ".gltf") else "z"
        if stands[1] != stands[2]:
            up = "y" if stands[1] else "z"
    if up == "y":
        mesh = replace(mesh, vertices=mesh.vertices[:, [2, 0, 1]])
    return Thing(path.stem, standing(mesh))


def standing(mesh: Mesh) -> Mesh:
    """The mesh moved so that it stands on z = 0 with the middle of its extent over the origin."""
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle = 0.5 * (low + high)
    return replace(mesh, vertices=mesh.vertices - [middle[0], middle[1], low[2]])


def _scene(path: Path) -> Any:
    trimesh = needed("trimesh")
    if not path.is_file():
        raise SceneError(f"mesh file {path} does not exist")
    if path.suffix.lower() not in SUFFIXES:
        raise SceneError(f"mesh file {path}: allowed are {', '.join(SUFFIXES)}")
    try:
        return trimesh.load(str(path), force="scene", process=False)
    except Exception as error:
        raise SceneError(f"mesh file {path} cannot be read: {error}") from error


def _parts(scene: Any, path: Path) -> Iterator[Mesh]:
    faces = 0
    for node in scene.graph.nodes_geometry:
        T_scene_part, name = scene.graph[node]
        part = scene.geometry[name]
        if not len(getattr(part, "faces", ())):
            continue
        faces += len(part.faces)
        if faces > MOST_FACES:
            raise SceneError(
                f"mesh file {path} has more than {MOST_FACES} triangles; simplify it first"
            )
        material, coords = _finish(part)
        mesh = mesh_of(part.vertices, part.faces, material, coords, name=str(path)).moved(
            np.asarray(T_scene_part, dtype=float)
        )
        if np.linalg.det(T_scene_part[:3, :3]) < 0:
            mesh = replace(mesh, faces=mesh.faces[:, ::-1])
        yield mesh
    if faces == 0:
        raise SceneError(f"mesh file {path} has no faces; triangles are needed")


def _finish(part: Any) -> tuple[Material, Float[ndarray, "v 3"]]:
    """Material of a trimesh geometry, and where its vertices lie on it."""
    visual, none = part.visual, np.zeros((len(part.vertices), 3))
    source = getattr(visual, "material", None)
    image = getattr(source, "baseColorTexture", None) or getattr(source, "image", None)
    uv = getattr(visual, "uv", None)
    if image is not None and uv is not None and len(uv) == len(none):
        pixels = np.asarray(image.convert("RGB"), dtype=np.uint8)
        brightness = float(((pixels / 255.0) ** 2.2).mean())
        none[:, :2] = np.nan_to_num(uv)
        return Material(Image(pixels), _infrared(brightness)), none
    if getattr(visual, "kind", None) == "vertex":
        colors = (np.asarray(visual.vertex_colors)[:, :3] / 255.0) ** 2.2
        return Material(VertexColors(), _infrared(float(colors.mean()))), colors
    color = np.array(GREY.color)
    if getattr(visual, "kind", None) == "face":
        color = (np.asarray(visual.face_colors)[:, :3] / 255.0).mean(axis=0) ** 2.2
    elif (linear := getattr(source, "baseColorFactor", None)) is not None:
        color = np.array(linear[:3], dtype=np.float64) / 255.0
    elif (shown := getattr(source, "diffuse", None)) is not None:
        color = (np.array(shown[:3], dtype=np.float64) / 255.0) ** 2.2
    r, g, b = color.tolist()
    return Material(Plain((r, g, b)), _infrared(float(color.mean()))), none


def _infrared(brightness: float) -> float:
    """A guess: most dyes pass near-infrared light, so dark surfaces are brighter there."""
    return 0.2 + 0.6 * brightness

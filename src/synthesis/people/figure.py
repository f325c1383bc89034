# SPDX-License-Identifier: Apache-2.0
"""A dressed person: skin, clothes, hair and shoes in one mesh that moves with the body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.body import BodyState
from kintrack.geometry import invert_rigid
from kintrack.skin import Skin, skinned_vertices, vertex_normals
from synthesis.mesh import Material, Mesh, join, mesh_of
from synthesis.people.form import dense_weights, main_surface
from synthesis.people.person import Person
from synthesis.people.sheet import Sheet, without
from synthesis.people.sway import Cloth, cloth_of, hang, swing_on


@dataclass(frozen=True)
class Figure:
    """A person with all that is worn."""

    person: Person
    """Whose body."""
    mesh: Mesh
    """Skin, clothes, hair and shoes in bind pose, root frame [m]; coords are these places."""
    skin: Skin
    """The same surface bound to the links."""
    cloth: Cloth
    """What sways."""


def figure_of(
    person: Person,
    bare: Sequence[tuple[Sheet, Material]],
    worn: Sequence[tuple[str, Sheet, Material]],
) -> Figure:
    """A figure of bare surfaces and of what is worn over them.

    Args:
        person: Whose body.
        bare: Surfaces of the body with their materials.
        worn: Name, surface and material of everything that is worn.

    Raises:
        SceneError: if a surface has no triangles or a vertex is not finite.
    """
    parts = [("body", *part) for part in bare] + list(worn)
    meshes = [
        mesh_of(sheet.vertices, sheet.faces, material, None, sheet.labels, name)
        for name, sheet, material in parts
    ]
    mesh = join(meshes)
    weights = np.concatenate([sheet.weights for _, sheet, _ in parts])
    order = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    top = np.take_along_axis(weights, order, axis=1)
    top = top / top.sum(axis=1, keepdims=True)
    Ts_link_root = invert_rigid(person.rig.Ts_root_link)
    T = Ts_link_root[order]
    points = np.einsum("vbij,vj->vbi", T[..., :3, :3], mesh.vertices) + T[..., :3, 3]
    names = person.skin.link_names
    skin = Skin(mesh.faces, order, top, np.ascontiguousarray(points), mesh.labels, names)
    normals = vertex_normals(mesh.vertices, mesh.faces)
    room = np.concatenate([sheet.room_m for _, sheet, _ in parts])
    gap = np.concatenate([sheet.gap_m for _, sheet, _ in parts])
    return Figure(person, mesh, skin, cloth_of(skin, person.rig.Ts_root_link, normals, room, gap))


def move(
    figure: Figure, states: Iterable[BodyState], dt_s: float
) -> Iterator[Float[ndarray, "v 3"]]:
    """The figure in every frame of a motion, cloth swaying.

    Args:
        figure: Who; at rest in the first frame.
        states: The body in every frame.
        dt_s: Time between frames [s].

    Yields:
        Vertices of `figure.mesh`, world frame [m], shape (V, 3).
    """
    cloth, swing = figure.cloth, None
    for state in states:
        vertices = skinned_vertices(state, figure.skin)
        carried = vertices[cloth.vertex]
        if swing is None:
            swing = hang(cloth, state.Ts_world_link, carried)
        else:
            swing_on(swing, cloth, state.Ts_world_link, carried, dt_s)
        vertices[cloth.vertex] = swing.places
        yield vertices


def bare_body(
    person: Person, hidden: Bool[ndarray, " v"], skin: Material, eyes: Material
) -> list[tuple[Sheet, Material]]:
    """The person's skin and eyes without what is hidden.

    Args:
        person: Whose.
        hidden: Vertices of the display skin that are never seen.
        skin: Of the skin.
        eyes: Of the eyes.
    """
    n = len(person.bind_vertices)
    zero = np.zeros(n)
    weights, main = dense_weights(person), main_surface(person)
    whole = Sheet(
        person.bind_vertices,
        person.skin.faces,
        weights,
        person.skin.labels,
        zero,
        zero,
        np.zeros(n, np.uint8),
        np.arange(n),
        np.zeros((n, 0)),
    )
    return [
        (without(whole, hidden | ~main), skin),
        (without(whole, main), eyes),
    ]

# SPDX-License-Identifier: Apache-2.0
"""The body as a tailor sees it: a refined surface that knows its limbs, girths and neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from kintrack.skin import vertex_normals
from synthesis.people.person import SIDES, Person
from synthesis.people.sheet import refined, smoother, triangulated

ARM = ("upper_arm", "forearm", "forearm_distal", "hand")
LEG = ("thigh", "shank", "foot")
SOFTENING = 24
"""Rounds in which skinning weights mix with their neighbours'."""

NORMAL_ROUNDS = 8
"""Rounds in which normals mix."""


@dataclass(frozen=True)
class Limbs:
    """Where each vertex lies along the arms or along the legs."""

    share: Float[ndarray, " v"]
    """How much of the vertex belongs to the limb, 0..1, smooth."""
    at: Float[ndarray, " v"]
    """0 at the limb's first joint, 1 at elbow or knee, 2 at wrist or ankle."""
    outward: Float[ndarray, "v 3"]
    """Unit vector away from the limb's axis."""
    radius_m: Float[ndarray, " v"]
    """Distance from the axis [m]."""
    along_m: Float[ndarray, " v"]
    """Distance along the axis [m]."""


@dataclass(frozen=True)
class Form:
    """Trunk, arms and legs, in bind pose and root frame."""

    person: Person
    """Whose body."""
    vertices: Float[ndarray, "v 3"]
    """Vertices [m]."""
    faces: Int[ndarray, "f 3"]
    """Triangles."""
    normals: Float[ndarray, "v 3"]
    """Smoothed outward normals."""
    weights: Float[ndarray, "v l"]
    """Softened skinning weight of every link."""
    labels: UInt8[ndarray, " v"]
    """Body part of each vertex."""
    skin_vertex: Int[ndarray, " v"]
    """Vertex of the person's skin that each vertex is, -1 = none."""
    neighbours: csr_array
    """Mean of the neighbours."""
    arms: Limbs
    """Both arms."""
    legs: Limbs
    """Both legs."""
    side: Float[ndarray, " v"]
    """1 on the left of the limbs, -1 on the right."""

    def origin(self, link: str) -> Float[ndarray, " 3"]:
        """Origin of a link in bind pose [m]."""
        return self.person.rig.Ts_root_link[self.person.skin.link_names.index(link)][:3, 3]

    def smoothed(self, values: ndarray, rounds: int) -> ndarray:
        """Values after rounds of mixing with the neighbours' mean."""
        for _ in range(rounds):
            values = 0.5 * values + 0.5 * (self.neighbours @ values)
        return values


def dense_weights(person: Person) -> Float[ndarray, "v l"]:
    """Skinning weight of every link for each vertex of the skin."""
    skin = person.skin
    out = np.zeros((len(skin.links), len(skin.link_names)))
    np.add.at(out, (np.arange(len(skin.links))[:, None], skin.links), skin.weights)
    return out


def main_surface(person: Person) -> Bool[ndarray, " v"]:
    """True on the vertices of the body's largest connected surface (not the eyes)."""
    faces, n = person.skin.faces, len(person.bind_vertices)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = csr_array((np.ones(len(edges)), edges.T), shape=(n, n))
    part = connected_components(graph, directed=False)[1]
    return part == np.bincount(part).argmax()


def form_of(person: Person) -> Form:
    """The form of a person.

    Args:
        person: Bare person.

    Returns:
        The body without head, fingers and toes, every triangle in four.
    """
    names, weights = person.skin.link_names, dense_weights(person)

    def of(*links: str) -> Float[ndarray, " v"]:
        return weights[:, [names.index(link) for link in links]].sum(axis=1)

    wanted = main_surface(person) & (of("head") < 0.75) & (of("l_foot", "r_foot") < 0.9)
    wanted &= of("l_hand", "r_hand") < 0.9
    faces, used = triangulated(person.skin.faces, wanted[person.skin.faces].all(axis=1))
    faces, ends = refined(faces, len(used))

    def halved(values: ndarray) -> ndarray:
        coarse = values[used].astype(float)
        return np.concatenate([coarse, coarse[ends].mean(axis=1)])

    vertices = halved(person.bind_vertices)
    neighbours = smoother(faces, len(vertices))
    soft, normals = halved(weights), vertex_normals(vertices, faces)
    for _ in range(SOFTENING):
        soft = 0.5 * soft + 0.5 * (neighbours @ soft)
    for _ in range(NORMAL_ROUNDS):
        normals = 0.5 * normals + 0.5 * (neighbours @ normals)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    coarse = person.skin.labels[used]
    side = np.where(vertices[:, 1] >= 0.0, 1.0, -1.0)
    bare = Form(
        person,
        vertices,
        faces,
        normals,
        soft,
        np.concatenate([coarse, coarse[ends[:, 0]]]),
        np.concatenate([used, np.full(len(ends), -1)]),
        neighbours,
        _limbs(person, vertices, soft, side, ARM),
        _limbs(person, vertices, soft, side, LEG),
        side,
    )
    return bare


def _limbs(
    person: Person, vertices: ndarray, weights: ndarray, side: ndarray, links: tuple[str, ...]
) -> Limbs:
    names, rig = person.skin.link_names, person.rig
    joints = {
        s: [rig.Ts_root_link[names.index(f"{s}_{link}")][:3, 3] for link in (*links[:2], links[-1])]
        for s in SIDES
    }
    left = (side > 0.0)[:, None]
    a, b, c = (np.where(left, joints["l"][k], joints["r"][k]) for k in range(3))
    share = weights[:, [names.index(f"{s}_{link}") for s in SIDES for link in links]].sum(axis=1)
    upper, lower = b - a, c - b
    length = np.linalg.norm(upper, axis=1), np.linalg.norm(lower, axis=1)
    t = np.minimum(((vertices - a) * upper).sum(axis=1) / length[0] ** 2, 1.0)
    t = np.where(share < 0.3, np.minimum(t, 0.3), t)
    u = np.where(share < 0.3, 0.0, ((vertices - b) * lower).sum(axis=1) / length[1] ** 2)
    u = np.maximum(u, 0.0)
    axis = a + upper * np.maximum(t, 0.0)[:, None] + lower * u[:, None]
    away = vertices - axis
    radius = np.linalg.norm(away, axis=1)
    away = away / np.maximum(radius, 1e-6)[:, None]
    return Limbs(share, t + u, away, radius, t * length[0] + u * length[1])

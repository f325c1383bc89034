# SPDX-License-Identifier: Apache-2.0
"""The skin: linear blend skinning, normals and analytic Jacobians.

s_i(q) = sum_b w_ib T_b(q) T_b(bind)^-1 s_i(bind)                     (linear blend skinning)
ds_i/dv_k = sum_b w_ib [k moves b] (J_lin,k + J_ang,k x x_ib),  x_ib = T_b(q) T_b(bind)^-1 s_i(bind)
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8
from numba import njit
from numpy import ndarray

from kintrack.body import BodyState
from kintrack.errors import ModelError
from kintrack.geometry import invert_rigid
from kintrack.rig import load_rig, model_folder, read_arrays, shape_coefficients


@dataclass(frozen=True)
class Skin:
    """A triangle mesh bound to the links of a body."""

    faces: Int[ndarray, "f 3"]
    """Triangles, counter-clockwise from outside."""
    links: Int[ndarray, "v 4"]
    """Links that move each vertex, indices into `link_names`."""
    weights: Float[ndarray, "v 4"]
    """Skinning weights, rows sum to 1."""
    points_link: Float[ndarray, "v 4 3"]
    """Each vertex in the frame of each of its links [m]."""
    labels: UInt8[ndarray, " v"]
    """Body part of each vertex, 1..6 (`kintrack.geometry.LABELS`)."""
    link_names: tuple[str, ...]
    """Names of the links that `links` counts."""


def load_skin(
    resolution: str = "tracking",
    folder: Path | None = None,
    shape: Float[ndarray, " k"] | None = None,
) -> Skin:
    """Read a skin of the human.

    Args:
        resolution: `tracking` (about 3,000 vertices) or `display` (about 14,000).
        folder: Model folder; the one that ships if None.
        shape: Shape coefficients [standard deviations]; the average adult if None.

    Returns:
        The skin.

    Raises:
        ModelError: if the resolution is unknown or a file is missing or broken.
    """
    if resolution not in ("tracking", "display"):
        raise ModelError(f"skin resolution {resolution!r}: 'tracking' or 'display' are allowed")
    folder = model_folder() if folder is None else folder
    rig = load_rig(folder, shape)
    skin = read_arrays(
        folder / "skin" / f"{resolution}.npz",
        "vertices_m",
        "faces",
        "weight_links",
        "weights",
        "labels",
        "shape_basis_m",
    )
    links = skin["weight_links"].astype(np.int64)
    Ts_link_root = invert_rigid(rig.Ts_root_link)[links]
    basis = skin["shape_basis_m"]
    b = shape_coefficients(shape, len(basis))
    vertices = skin["vertices_m"] + np.tensordot(b, basis[: len(b)].astype(float), 1)
    points = np.einsum("vbij,vj->vbi", Ts_link_root[..., :3, :3], vertices)
    return Skin(
        faces=skin["faces"].astype(np.int64),
        links=links,
        weights=skin["weights"].astype(float),
        points_link=np.ascontiguousarray(points + Ts_link_root[..., :3, 3]),
        labels=skin["labels"],
        link_names=rig.link_names,
    )


def skinned_vertices(state: BodyState, skin: Skin) -> Float[ndarray, "v 3"]:
    """Vertices of the skin at the state's pose, world frame [m], shape (V, 3)."""
    return _blend(state.Ts_world_link, skin.links, skin.weights, skin.points_link)


def vertex_normals(
    vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"]
) -> Float[ndarray, "v 3"]:
    """Outward unit normals, faces weighted by area, shape (V, 3)."""
    return _normals(vertices, faces)


def vertex_jacobians(
    state: BodyState, skin: Skin, vertex: Int[ndarray, " n"]
) -> Float[ndarray, "n 3 nv"]:
    """Derivative of chosen vertices with respect to v, world frame.

    Args:
        state: Body with kinematics computed.
        skin: Its skin.
        vertex: Vertex indices, shape (N,).

    Returns:
        J (N, 3, nv) [m per m or rad], through `pin.integrate`.
    """
    return _jacobians(state.Ts_world_link, state.J_world, state.body.support, *_rows(skin, vertex))


def _rows(skin: Skin, vertex: ndarray) -> tuple[ndarray, ndarray, ndarray]:
    return skin.links[vertex], skin.weights[vertex], skin.points_link[vertex]


@njit(cache=True, nogil=True)
def _blend(Ts, links, weights, points):
    out = np.zeros((links.shape[0], 3))
    for i in range(links.shape[0]):
        for b in range(4):
            w = weights[i, b]
            if w == 0.0:
                continue
            T = Ts[links[i, b]]
            x, y, z = points[i, b, 0], points[i, b, 1], points[i, b, 2]
            for r in range(3):
                out[i, r] += w * (T[r, 0] * x + T[r, 1] * y + T[r, 2] * z + T[r, 3])
    return out


@njit(cache=True, nogil=True)
def _normals(vertices, faces):
    out = np.zeros_like(vertices)
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ux = vertices[b, 0] - vertices[a, 0]
        uy = vertices[b, 1] - vertices[a, 1]
        uz = vertices[b, 2] - vertices[a, 2]
        vx = vertices[c, 0] - vertices[a, 0]
        vy = vertices[c, 1] - vertices[a, 1]
        vz = vertices[c, 2] - vertices[a, 2]
        nx = uy * vz - uz * vy
        ny = uz * vx - ux * vz
        nz = ux * vy - uy * vx
        for k in (a, b, c):
            out[k, 0] += nx
            out[k, 1] += ny
            out[k, 2] += nz
    for i in range(out.shape[0]):
        length = np.sqrt(out[i, 0] ** 2 + out[i, 1] ** 2 + out[i, 2] ** 2)
        if length > 0.0:
            out[i] /= length
    return out


@njit(cache=True, nogil=True)
def _jacobians(Ts, J, support, links, weights, points):
    n, nv = links.shape[0], J.shape[1]
    out = np.zeros((n, 3, nv))
    for i in range(n):
        for b in range(4):
            w = weights[i, b]
            if w == 0.0:
                continue
            T = Ts[links[i, b]]
            p = points[i, b]
            x = T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3]
            y = T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3]
            z = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
            for k in range(nv):
                if support[links[i, b], k]:
                    out[i, 0, k] += w * (J[0, k] + J[4, k] * z - J[5, k] * y)
                    out[i, 1, k] += w * (J[1, k] + J[5, k] * x - J[3, k] * z)
                    out[i, 2, k] += w * (J[2, k] + J[3, k] * y - J[4, k] * x)
    return out

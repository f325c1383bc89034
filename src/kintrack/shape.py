# SPDX-License-Identifier: Apache-2.0
"""The space of bodies: surface and joints are linear in a few coefficients.

In bind pose a person's vertices are v_i + sum_k b_k B_ki and her link origins o_l + sum_k b_k O_kl;
shape never turns a link. With R_l the rotation that a pose gives link l against bind pose, and p
its parent link,

do_l/db_k(q) = do_p/db_k(q) + R_p (O_kl - O_kp),                       the root's origin is q's own
ds_i/db_k(q) = sum_l w_il (do_l/db_k(q) + R_l (B_ki - O_kl))           (linear blend skinning)
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.body import FRAME_OF_JOINT, Body, BodyState, load_body, rigged_body
from kintrack.geometry import invert_rigid
from kintrack.joints import JOINT_NAMES
from kintrack.rig import Rig, load_rig, model_folder, read_arrays, shape_coefficients
from kintrack.skin import Skin, load_skin


@dataclass(frozen=True)
class ShapeSpace:
    """Bodies with K coefficients; bind pose, root frame [m]."""

    folder: Path
    """Model folder."""
    skin: Skin
    """Skin of the average adult, for its triangles, links and labels."""
    vertices_m: Float[ndarray, "v 3"]
    """Vertices of the average adult."""
    vertices_basis_m: Float[ndarray, "k v 3"]
    """Change of the vertices per unit of each coefficient."""
    rig: Rig
    """Links of the average adult."""
    origins_basis_m: Float[ndarray, "k l 3"]
    """Change of the link origins per unit of each coefficient."""
    extra_basis_m: dict[str, Float[ndarray, "k 3"]]
    """Change of the fixed frames that are no link's origin."""
    parents: Int[ndarray, " l"]
    """Parent of every link, -1 for the root; parents come first."""
    joint_links: Int[ndarray, " j"]
    """Link that carries each reported joint."""

    def __len__(self) -> int:
        """How many coefficients there are."""
        return len(self.vertices_basis_m)

    def vertices(self, b: Float[ndarray, " k"]) -> Float[ndarray, "v 3"]:
        """Bind pose of a person's skin [m]."""
        return self.vertices_m + np.tensordot(b, self.vertices_basis_m[: len(b)], 1)

    def origins(self, b: Float[ndarray, " k"]) -> Float[ndarray, "l 3"]:
        """Bind pose of a person's link origins [m]."""
        return self.rig.Ts_root_link[:, :3, 3] + np.tensordot(b, self.origins_basis_m[: len(b)], 1)

    def body(self, b: Float[ndarray, " k"]) -> Body:
        """A person's kinematic tree."""
        Ts = self.rig.Ts_root_link.copy()
        Ts[:, :3, 3] = self.origins(b)
        extra = {name: b @ basis[: len(b)] for name, basis in self.extra_basis_m.items()}
        return rigged_body(self.folder, replace(self.rig, Ts_root_link=Ts, extra_offsets=extra))

    def bound(self, b: Float[ndarray, " k"]) -> Skin:
        """A person's skin."""
        Ts = self.rig.Ts_root_link.copy()
        Ts[:, :3, 3] = self.origins(b)
        Ts_link_root = invert_rigid(Ts)[self.skin.links]
        points = np.einsum("vbij,vj->vbi", Ts_link_root[..., :3, :3], self.vertices(b))
        return replace(
            self.skin, points_link=np.ascontiguousarray(points + Ts_link_root[..., :3, 3])
        )

    def widened(self, fields_m: Float[ndarray, "r v 3"]) -> ShapeSpace:
        """The space with R further coefficients that move vertices and no joint.

        Args:
            fields_m: What one unit of each new coefficient does to the vertices, bind pose.
        """
        r, links = len(fields_m), self.origins_basis_m.shape[1]
        none = np.zeros((r, 3))
        return replace(
            self,
            vertices_basis_m=np.concatenate([self.vertices_basis_m, fields_m]),
            origins_basis_m=np.concatenate([self.origins_basis_m, np.zeros((r, links, 3))]),
            extra_basis_m={n: np.concatenate([e, none]) for n, e in self.extra_basis_m.items()},
        )


@cache
def load_shape_space(folder: Path | None = None, resolution: str = "tracking") -> ShapeSpace:
    """The population's shape space; the same folder is read once.

    Args:
        folder: Model folder; the one that ships if None.
        resolution: Skin, `tracking` or `display`.

    Returns:
        The space; coefficients are standard deviations of the population.

    Raises:
        ModelError: if a file is missing or broken.
    """
    folder = model_folder() if folder is None else folder
    skin, rig, body = load_skin(resolution, folder), load_rig(folder), load_body(folder)
    arrays = read_arrays(folder / "skin" / f"{resolution}.npz", "vertices_m", "shape_basis_m")
    bases = read_arrays(
        folder / "skin" / "rig.npz", "origins_basis_m", "extra_names", "extra_basis_m"
    )
    names = [str(name) for name in bases["extra_names"]]
    frames = [FRAME_OF_JOINT[name] for name in JOINT_NAMES]
    joints = [body.model.frames[body.model.getFrameId(name)].parentJoint for name in frames]
    return ShapeSpace(
        folder,
        skin,
        arrays["vertices_m"].astype(float),
        arrays["shape_basis_m"].astype(float),
        rig,
        bases["origins_basis_m"].astype(float),
        {name: bases["extra_basis_m"][:, i].astype(float) for i, name in enumerate(names)},
        _parents(body),
        np.array([int(np.flatnonzero(body.link_joints == joint)[0]) for joint in joints]),
    )


def checked_shape(space: ShapeSpace, shape: Float[ndarray, " k"] | None) -> Float[ndarray, " k"]:
    """Coefficients as many as the space has, the missing ones zero.

    Raises:
        ModelError: if there are too many or one is not finite.
    """
    b = np.zeros(len(space))
    given = shape_coefficients(shape, len(space))
    b[: len(given)] = given
    return b


def _parents(body: Body) -> Int[ndarray, " l"]:
    """The nearest ancestor of every link, by what moves them."""
    reach = body.support.sum(axis=1)
    parents = np.full(len(reach), -1)
    for link, moved_by in enumerate(body.support):
        above = [
            other
            for other in range(len(reach))
            if reach[other] < reach[link] and not (body.support[other] & ~moved_by).any()
        ]
        if above:
            parents[link] = max(above, key=lambda other: reach[other])
    return parents


def origin_jacobians(state: BodyState, space: ShapeSpace) -> Float[ndarray, "k l 3"]:
    """Derivative of the link origins with respect to the coefficients, world frame [m]."""
    turn = _turns(state, space)
    out = np.zeros_like(space.origins_basis_m)
    for link, parent in enumerate(space.parents):
        if parent >= 0:
            offset = space.origins_basis_m[:, link] - space.origins_basis_m[:, parent]
            out[:, link] = out[:, parent] + offset @ turn[parent].T
    return out


def joint_shape_jacobians(state: BodyState, space: ShapeSpace) -> Float[ndarray, "j 3 k"]:
    """Derivative of the reported joints with respect to the coefficients, world frame [m]."""
    turn, origins = _turns(state, space), origin_jacobians(state, space)
    out = np.empty((len(JOINT_NAMES), 3, len(space)))
    for j, name in enumerate(JOINT_NAMES):
        link, extra = space.joint_links[j], space.extra_basis_m.get(FRAME_OF_JOINT[name])
        moved = origins[:, link]
        if extra is not None:
            moved = moved + (extra - space.origins_basis_m[:, link]) @ turn[link].T
        out[j] = moved.T
    return out


def vertex_shape_jacobians(
    state: BodyState, space: ShapeSpace, vertex: Int[ndarray, " n"]
) -> Float[ndarray, "n 3 k"]:
    """Derivative of chosen vertices with respect to the coefficients, world frame [m].

    Args:
        state: A person of the space with kinematics computed.
        space: The space.
        vertex: Vertex indices, shape (N,).

    Returns:
        J (N, 3, K) [m per unit of a coefficient].
    """
    return _jacobians(
        _turns(state, space),
        origin_jacobians(state, space),
        space.origins_basis_m,
        space.vertices_basis_m,
        vertex,
        space.skin.links,
        space.skin.weights,
    )


def _turns(state: BodyState, space: ShapeSpace) -> Float[ndarray, "l 3 3"]:
    """R_l of the module's equations."""
    R_link_root = np.swapaxes(space.rig.Ts_root_link[:, :3, :3], 1, 2)
    return np.ascontiguousarray(state.Ts_world_link[:, :3, :3] @ R_link_root)


@njit(cache=True, nogil=True)
def _jacobians(turn, moved, origins, basis, vertex, all_links, all_weights):
    count, n = basis.shape[0], vertex.shape[0]
    links, weights = all_links[vertex], all_weights[vertex]
    out = np.zeros((n, 3, count))
    for i in range(n):
        for b in range(4):
            w = weights[i, b]
            if w == 0.0:
                continue
            link = links[i, b]
            R = turn[link]
            for k in range(count):
                x = basis[k, vertex[i], 0] - origins[k, link, 0]
                y = basis[k, vertex[i], 1] - origins[k, link, 1]
                z = basis[k, vertex[i], 2] - origins[k, link, 2]
                for r in range(3):
                    out[i, r, k] += w * (
                        moved[k, link, r] + R[r, 0] * x + R[r, 1] * y + R[r, 2] * z
                    )
    return out

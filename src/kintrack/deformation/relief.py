# SPDX-License-Identifier: Apache-2.0
"""Offsets of a skin along its own normals, which move with the links.

In bind pose vertex i has the unit normal n_i. Its offset o_i shifts the vertex within the frame of
every link b that moves it by o_i R_b(bind)^T n_i, so that s_i(q, o) = s_i(q, 0) + o_i d_i(q) with
d_i(q) = sum_b w_ib R_b(q) R_b(bind)^T n_i: a skin with offsets is a skin like any other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import Body, BodyState, run_kinematics
from kintrack.skin import Skin, skinned_vertices, vertex_normals


@dataclass(frozen=True)
class Relief:
    """A skin that can be raised and lowered."""

    skin: Skin
    """The skin without offsets."""
    normals_link: Float[ndarray, "v 4 3"]
    """Normal of each vertex in bind pose, in the frame of each of its links."""

    def raised(self, offsets_m: Float[ndarray, " v"]) -> Skin:
        """The skin with offsets [m]."""
        points = self.skin.points_link + offsets_m[:, None, None] * self.normals_link
        return replace(self.skin, points_link=points)

    def directions_world(self, state: BodyState) -> Float[ndarray, "v 3"]:
        """d_i(q), world frame [m per m]."""
        Ts = state.Ts_world_link.copy()
        Ts[:, :3, 3] = 0.0
        turned = replace(self.skin, points_link=self.normals_link)
        return skinned_vertices(replace(state, Ts_world_link=Ts), turned)


def relief_of(body: Body, skin: Skin) -> Relief:
    """The relief of a skin that is bound to a body."""
    state = run_kinematics(body, body.neutral())
    normals = vertex_normals(skinned_vertices(state, skin), skin.faces)
    R_world_link = state.Ts_world_link[skin.links][..., :3, :3]
    return Relief(skin, np.einsum("vbji,vj->vbi", R_world_link, normals))

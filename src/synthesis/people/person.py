# SPDX-License-Identifier: Apache-2.0
"""A person of the population, with the display skin and the soles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import Body, load_body, rigged_body, run_kinematics
from kintrack.geometry import invert_rigid
from kintrack.rig import Rig, load_rig, model_folder
from kintrack.skin import Skin, load_skin, skinned_vertices
from synthesis.people.population import SIDES, Facts, Hands, load_population

SOLE_HEIGHT_M = 0.012
"""How far above its lowest point a foot counts as sole [m]."""


@dataclass(frozen=True)
class Person:
    """A body, its skin, and the feet that stand on the floor."""

    body: Body
    """Kinematic tree."""
    skin: Skin
    """Display skin."""
    rig: Rig
    """Link frames in bind pose."""
    bind_vertices: Float[ndarray, "v 3"]
    """The display skin in bind pose, root frame [m]."""
    foot_points: dict[str, Float[ndarray, "n 3"]]
    """Skin of each foot in the foot's frame [m]."""
    heel: dict[str, Float[ndarray, " 3"]]
    """Rearmost point of each sole in the foot's frame [m]."""
    toe: dict[str, Float[ndarray, " 3"]]
    """Foremost point of each sole in the foot's frame [m]."""
    facts: Facts
    """Sex, age, height, mass."""


def load_person(index: int, hands: Hands = "relaxed") -> Person:
    """A bare person of the population.

    Args:
        index: Who, see `synthesis.people.population`.
        hands: `open`, `relaxed` or `closed`; or one per side, where a side left out is relaxed.

    Returns:
        The person. Joints are the person's own points, by the model's definitions; link frames are
        turned as the model's are.

    Raises:
        SceneError: if there is no such person or no such shape of a hand.
    """
    population = load_population()
    vertices, points = population.body(index, hands)
    rig = _rig(points)
    body = rigged_body(model_folder(), rig)
    skin = load_skin("display")
    Ts_link_root = invert_rigid(rig.Ts_root_link)[skin.links]
    points_link = np.einsum("vbij,vj->vbi", Ts_link_root[..., :3, :3], vertices)
    points_link += Ts_link_root[..., :3, 3]
    skin = replace(skin, points_link=np.ascontiguousarray(points_link))
    state = run_kinematics(body, body.neutral())
    posed = skinned_vertices(state, skin)
    foot_points, heel, toe = {}, {}, {}
    for side in SIDES:
        link = skin.link_names.index(f"{side}_foot")
        of_foot = (skin.weights * (skin.links == link)).sum(axis=1) > 0.9
        T = state.Ts_world_link[link]
        foot = (posed[of_foot] - T[:3, 3]) @ T[:3, :3]
        sole = foot[foot[:, 2] < foot[:, 2].min() + SOLE_HEIGHT_M]
        foot_points[side] = foot
        heel[side], toe[side] = sole[sole[:, 0].argmin()], sole[sole[:, 0].argmax()]
    return Person(body, skin, rig, vertices, foot_points, heel, toe, population.facts(index))


def _rig(points: dict[str, Float[ndarray, " 3"]]) -> Rig:
    """Link frames at a person's own joints, and by how much the other fixed frames move."""
    average, body = load_rig(model_folder()), load_body()
    Ts = average.Ts_root_link.copy()
    Ts[:, :3, 3] = [points[name] for name in average.link_names]
    offsets = {}
    for name in average.extra_offsets:
        frame = body.model.frames[body.model.getFrameId(name)]
        link = int(np.flatnonzero(body.link_joints == frame.parentJoint)[0])
        T = average.Ts_root_link[link]
        offsets[name] = points[name] - (T[:3, :3] @ frame.placement.translation + T[:3, 3])
    return Rig(average.link_names, Ts, offsets, average.explained)

# SPDX-License-Identifier: Apache-2.0
"""The average adult and how adults differ, taken from the parametric population of `anny`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.errors import ModelError
from kintrack.modelling.skeleton import Link, links

R_ROOT_SOURCE = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""The source body looks along -y with its left at +x; ours looks along +x with its left at +y."""

EXTRA_POINTS = ("l_hand_center", "r_hand_center", "l_toe_base", "r_toe_base")
"""Reported places that are no link's origin; `head_center` is added from the closed skin."""


@dataclass(frozen=True)
class SourceBody:
    """A body in bind pose with linear variation; root frame, metres."""

    vertices: Float[ndarray, "v 3"]
    """Mean vertices [m]."""
    faces: Int[ndarray, "f 3"]
    """Triangles, outward counter-clockwise; the outer surface and the eyes."""
    weights: Float[ndarray, "v l"]
    """Skinning weights over `links()`, rows sum to 1."""
    points: dict[str, Float[ndarray, 3]]
    """Mean link origins and `EXTRA_POINTS` [m]."""
    vertices_basis: Float[ndarray, "k v 3"]
    """Change of the vertices per standard deviation of each shape coefficient [m]."""
    points_basis: dict[str, Float[ndarray, "k 3"]]
    """Change of `points` per standard deviation [m]."""
    explained: Float[ndarray, " k"]
    """Share of the population's vertex variance per coefficient."""
    landmarks: dict[str, Float[ndarray, 3]]
    """Points that only orient frames: knuckles and toes [m]."""


def bone_link_matrix(bones: list[str], tree: tuple[Link, ...]) -> Float[ndarray, "b l"]:
    """One-hot matrix from source bones to links; every bone must belong to exactly one link."""
    matrix = np.zeros((len(bones), len(tree)))
    for i, bone in enumerate(bones):
        stem, _, tag = bone.partition(".")
        side = {"L": 1, "R": -1, "": 0}[tag]
        owners = [
            j
            for j, link in enumerate(tree)
            if any(stem == b or (b in _FAMILIES and stem.startswith(b)) for b in link.segment.bones)
            and link.side in (side, 0)
        ]
        if len(owners) != 1:
            raise ModelError(f"bone {bone!r} of the source body belongs to {len(owners)} links")
        matrix[i, owners[0]] = 1.0
    return matrix


_FAMILIES = ("finger", "metacarpal", "toe")
_ORIGIN_BONE = {
    "abdomen": "spine04",
    "chest": "spine02",
    "neck": "neck01",
    "head": "head",
    "clavicle": "clavicle",
    "upper_arm": "upperarm01",
    "forearm": "lowerarm01",
    "hand": "wrist",
    "thigh": "upperleg01",
    "shank": "lowerleg01",
    "foot": "foot",
}


def load_average_adult(samples: int, components: int, seed: int) -> SourceBody:
    """Mean and principal components of `samples` adults, 18 to 75 years, both sexes.

    Args:
        samples: How many people are drawn.
        components: How many shape coefficients are kept.
        seed: Seed of the draw.

    Returns:
        The mean body in the source's bind pose (arms half lowered) and its variation.
    """
    import anny
    import torch
    from anny.shape_distribution import SimpleShapeDistribution

    model = anny.Anny()
    torch.manual_seed(seed)
    ages = torch.distributions.Uniform(*torch.tensor([18.0, 75.0], dtype=torch.float64))
    people = SimpleShapeDistribution(model, morphological_age_distribution=ages)
    vertices, heads = [], []
    for start in range(0, samples, 100):
        _, phenotype = people.sample(min(100, samples - start))
        body = model(phenotype_kwargs=phenotype)
        vertices.append(body["rest_vertices"].numpy() @ R_ROOT_SOURCE.T)
        heads.append(body["rest_bone_heads"].numpy() @ R_ROOT_SOURCE.T)
    return _summarise(
        np.concatenate(vertices),
        np.concatenate(heads),
        list(model.bone_labels),
        model.faces.numpy(),
        dense_weights(model),
        components,
    )


def dense_weights(model) -> Float[ndarray, "v b"]:
    """Skinning weights of a source model over all of its bones."""
    index = model.vertex_bone_indices.numpy()
    dense = np.zeros((len(index), len(model.bone_labels)))
    np.add.at(dense, (np.arange(len(index))[:, None], index), model.vertex_bone_weights.numpy())
    return dense


def _summarise(vertices, heads, bones, faces, bone_weights, components) -> SourceBody:
    tree = links()
    weights = bone_weights @ bone_link_matrix(bones, tree)
    weights /= weights.sum(axis=1, keepdims=True)
    points = joint_points(heads, bones, tree)
    origin = points["pelvis"].copy()
    vertices = vertices - origin[:, None]
    points = {name: p - origin for name, p in points.items()}
    landmarks = {
        f"{side}_{name}": heads[:, bones.index(bone)] - origin
        for side in "lr"
        for name, bone in (
            ("index", f"finger2-1.{side.upper()}"),
            ("middle", f"finger3-1.{side.upper()}"),
            ("little", f"finger5-1.{side.upper()}"),
        )
    }
    names = list(points)
    stacked = np.stack([points[name] for name in names], axis=1)
    flat = np.concatenate([vertices, stacked], axis=1).reshape(len(vertices), -1)
    mean = flat.mean(axis=0)
    _, s, vt = np.linalg.svd(flat - mean, full_matrices=False)
    sign = np.sign(vt[:, 2 : 3 * vertices.shape[1] : 3].sum(axis=1))
    basis = (vt * (s * np.where(sign == 0, 1, sign) / np.sqrt(len(flat) - 1))[:, None])[:components]
    basis = basis.reshape(components, -1, 3)
    n = vertices.shape[1]
    mean = mean.reshape(-1, 3)
    return SourceBody(
        vertices=mean[:n],
        faces=faces,
        weights=weights,
        points={name: mean[n + i] for i, name in enumerate(names)},
        vertices_basis=basis[:, :n],
        points_basis={name: basis[:, n + i] for i, name in enumerate(names)},
        explained=(s**2 / (s**2).sum())[:components],
        landmarks={name: p.mean(axis=0) for name, p in landmarks.items()},
    )


def joint_points(
    heads: Float[ndarray, "n b 3"], bones: list[str], tree: tuple[Link, ...]
) -> dict[str, Float[ndarray, "n 3"]]:
    """Link origins, hands and toes of every person, all linear in the source body.

    Args:
        heads: Where the source's bones start, shape (N, B, 3) [m].
        bones: Names of the source's bones.
        tree: Links of the human.

    Returns:
        Name of the link or of one of `EXTRA_POINTS` -> positions (N, 3), axes as given [m].
    """

    def bone(name: str):
        return heads[:, bones.index(name)]

    points = {}
    for link in tree:
        tag = {1: ".L", -1: ".R", 0: ""}[link.side]
        stem = link.segment.name
        if stem == "pelvis":
            points[link.name] = 0.5 * (bone("upperleg01.L") + bone("upperleg01.R"))
        elif stem == "forearm_distal":
            points[link.name] = 0.5 * (bone("lowerarm01" + tag) + bone("wrist" + tag))
        else:
            points[link.name] = bone(_ORIGIN_BONE[stem] + tag)
    for side in "lr":
        tag = "." + side.upper()
        points[f"{side}_hand_center"] = 0.5 * (bone("wrist" + tag) + bone("finger3-1" + tag))
        points[f"{side}_toe_base"] = bone("toe2-1" + tag)
    return points

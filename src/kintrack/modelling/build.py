# SPDX-License-Identifier: Apache-2.0
"""`kintrack model build`: writes `human.urdf` and `skin/` from the source body."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.errors import ModelError
from kintrack.modelling.frames import bind_rotations
from kintrack.modelling.segments import segment_bodies
from kintrack.modelling.skeleton import links
from kintrack.modelling.source import EXTRA_POINTS, SourceBody, load_average_adult
from kintrack.modelling.surface import remesh, smooth_weights, strongest_four, transfer
from kintrack.modelling.urdf import human_urdf

EXTRA_PARENTS = {"head_center": "head", "hand_center": "hand", "toe_base": "foot"}


@dataclass(frozen=True)
class ModelBuildConfig:
    """What `kintrack model build` makes."""

    tracking_vertices: int = 3000
    """Wanted vertices of the tracking skin, 500 to 10,000."""
    people: int = 2000
    """People drawn from the adult population, at least 50."""
    shape_coefficients: int = 10
    """Principal shape coefficients kept, 1 to 30."""
    seed: int = 0
    """Seed of the draw."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            tracking_vertices=(500, 10_000),
            people=(50, 100_000),
            shape_coefficients=(1, 30),
        )


def build_model(folder: Path, config: ModelBuildConfig, progress=print) -> None:
    """Build the human into `folder`: `human.urdf`, `skin/*.npz`, `skin/visual/*.stl`.

    Args:
        folder: Where to write; made if missing.
        config: Sizes and seed.
        progress: Called with one line per step.

    Raises:
        ModelError: if the extra `model` is not installed.
    """
    try:
        import anny  # noqa: F401
        import pymeshlab  # noqa: F401
        import trimesh  # noqa: F401
    except ImportError as error:
        raise ModelError(f"{error.name!r} is missing: pip install 'kintrack[model]'") from error
    progress(f"drawing {config.people} adults")
    source = load_average_adult(config.people, config.shape_coefficients, config.seed)
    rotations = bind_rotations(source.points, source.landmarks)
    Ts_root_link = {}
    for link in links():
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = rotations[link.name], source.points[link.name]
        Ts_root_link[link.name] = T
    skin = folder / "skin"
    (skin / "visual").mkdir(parents=True, exist_ok=True)
    progress("remeshing the tracking skin")
    vertices, faces = remesh(*_outer(source), config.tracking_vertices)
    corners, bary = transfer(source.vertices, source.faces, vertices)
    weights = smooth_weights(np.einsum("tc,tcl->tl", bary, source.weights[corners]), faces, 2)
    basis = np.einsum("tc,ktcd->ktd", bary, source.vertices_basis[:, corners])
    _save_skin(skin / "tracking.npz", vertices, faces, weights, basis)
    points, points_basis = dict(source.points), dict(source.points_basis)
    centre = head_centre(vertices, faces, weights)
    points["head_center"], points_basis["head_center"] = centre @ vertices, centre @ basis
    _save_skin(
        skin / "display.npz", source.vertices, source.faces, source.weights, source.vertices_basis
    )
    progress("measuring segments")
    bodies = segment_bodies(vertices, faces, weights, Ts_root_link)
    visuals = _save_visuals(skin / "visual", source, Ts_root_link)
    extra = {
        name: _in_link(_extra_parent(name), points[name], Ts_root_link)
        for name in ("head_center", *EXTRA_POINTS)
    }
    _save_rig(skin / "rig.npz", source, points_basis, Ts_root_link, extra)
    (folder / "human.urdf").write_text(human_urdf(Ts_root_link, extra, bodies, visuals))
    progress(f"{len(vertices)} + {len(source.vertices)} vertices in {folder}")


def head_centre(
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    weights: Float[ndarray, "v l"],
) -> Float[ndarray, " v"]:
    """Share of each vertex of the tracking skin in the area centroid of the head's surface."""
    head = weights[:, [link.name for link in links()].index("head")] > 0.5
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6
    per_vertex = np.bincount(faces.ravel(), np.repeat(area, 3), minlength=len(vertices)) * head
    return per_vertex / per_vertex.sum()


def _extra_parent(name: str) -> str:
    side = name[:2] if name[:2] in ("l_", "r_") else ""
    return side + EXTRA_PARENTS[name.removeprefix(side)]


def _in_link(link: str, point: ndarray, Ts_root_link) -> tuple[str, ndarray]:
    T = Ts_root_link[link]
    return link, T[:3, :3].T @ (point - T[:3, 3])


def _outer(source: SourceBody) -> tuple[ndarray, ndarray, tuple[ndarray, ...]]:
    """The largest connected piece (no eyes, no tongue) and the vertices of its two hands."""
    import trimesh

    body = trimesh.Trimesh(source.vertices, source.faces, process=False)
    piece = trimesh.graph.connected_component_labels(body.face_adjacency)
    kept = source.faces[piece == np.bincount(piece).argmax()]
    used, renumbered = np.unique(kept, return_inverse=True)
    names = [link.name for link in links()]
    hands = tuple(
        np.flatnonzero(source.weights[used, names.index(hand)] > 0.9)
        for hand in ("l_hand", "r_hand")
    )
    return source.vertices[used], renumbered.reshape(kept.shape), hands


def _save_skin(path: Path, vertices, faces, weights, basis) -> None:
    index, strongest = strongest_four(weights)
    label_of_link = np.array([link.label for link in links()], dtype=np.uint8)
    share = np.stack([weights[:, label_of_link == y].sum(axis=1) for y in range(7)], axis=1)
    np.savez_compressed(
        path,
        vertices_m=vertices.astype(np.float32),
        faces=faces.astype(np.int32),
        weight_links=index,
        weights=strongest.astype(np.float32),
        labels=share.argmax(axis=1).astype(np.uint8),
        shape_basis_m=basis.astype(np.float16),
    )


def _save_rig(path: Path, source: SourceBody, points_basis, Ts_root_link, extra) -> None:
    names = [link.name for link in links()]
    np.savez_compressed(
        path,
        link_names=np.array(names),
        link_labels=np.array([link.label for link in links()], dtype=np.uint8),
        Ts_root_link_bind=np.stack([Ts_root_link[name] for name in names]),
        origins_basis_m=np.stack([points_basis[name] for name in names], axis=1),
        extra_names=np.array(list(extra)),
        extra_basis_m=np.stack([points_basis[name] for name in extra], axis=1),
        explained_variance=source.explained,
    )


def _save_visuals(folder: Path, source: SourceBody, Ts_root_link) -> dict[str, str]:
    """One rigid piece of the display skin per link, in the link's frame, as binary STL."""
    import trimesh

    owner = source.weights.argmax(axis=1)
    face_owner = np.sort(owner[source.faces], axis=1)[:, 1]
    files = {}
    for i, link in enumerate(links()):
        T = Ts_root_link[link.name]
        piece = trimesh.Trimesh(
            (source.vertices - T[:3, 3]) @ T[:3, :3], source.faces[face_owner == i], process=False
        )
        piece.remove_unreferenced_vertices()
        piece.export(folder / f"{link.name}.stl", file_type="stl")
        files[link.name] = f"skin/visual/{link.name}.stl"
    return files

# SPDX-License-Identifier: Apache-2.0
"""From the source body's surface to a tracking skin: closed, even, hands and feet kept simple."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray
from scipy import ndimage
from scipy.spatial import Delaunay

VOXEL_M = 0.005
"""Edge of the voxels that close gaps [m]."""
CLOSING_M = 0.012
"""Radius of the morphological closing: fills the gaps between fingers and toes, the mouth and the
ears, and leaves armpits and the gap between the legs open [m]."""


def remesh(
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    mittens: tuple[Int[ndarray, " m"], ...],
    target_vertices: int,
) -> tuple[Float[ndarray, "t 3"], Int[ndarray, "g 3"]]:
    """A closed, evenly sampled mesh of about `target_vertices` around the same body.

    Each hand becomes the convex hull of its fingers. Voxels inside the body are closed
    morphologically, the surface is extracted by marching cubes, remeshed isotropically and laid
    back onto the body wherever that is within 8 mm.

    Args:
        vertices: Source vertices [m].
        faces: Source triangles.
        mittens: Vertex indices of each hand.
        target_vertices: Wanted number of vertices.

    Returns:
        Vertices [m] and triangles.
    """
    import pymeshlab
    import trimesh
    from skimage import measure

    body = trimesh.Trimesh(vertices, faces, process=False)
    inside, origin = _voxels(body)
    for hand in mittens:
        _fill_hull(inside, origin, vertices[hand])
    radius = int(round(CLOSING_M / VOXEL_M))
    inside = ndimage.distance_transform_edt(~inside) <= radius
    inside = ndimage.distance_transform_edt(inside) > radius
    inside = ndimage.binary_fill_holes(inside)
    density = ndimage.gaussian_filter(inside.astype(np.float32), 1.0)
    points, triangles, _, _ = measure.marching_cubes(density, 0.5)
    dense = trimesh.Trimesh(points * VOXEL_M + origin, triangles[:, ::-1], process=True)
    dense = max(dense.split(only_watertight=True), key=lambda part: part.volume)
    edge = np.sqrt(dense.area / (2 * target_vertices) * 4 / np.sqrt(3))
    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(dense.vertices, dense.faces))
    work.meshing_isotropic_explicit_remeshing(
        iterations=12, adaptive=False, targetlen=pymeshlab.PureValue(float(edge))
    )
    even = trimesh.Trimesh(
        work.current_mesh().vertex_matrix(), work.current_mesh().face_matrix(), process=True
    )
    closest, distance, _ = trimesh.proximity.closest_point(body, even.vertices)
    near = distance < 0.008
    even.vertices = np.where(near[:, None], closest, even.vertices)
    if even.volume < 0:
        even.invert()
    return np.asarray(even.vertices), np.asarray(even.faces)


def _voxels(body) -> tuple[ndarray, ndarray]:
    """Occupancy of a regular grid around the body and the grid's first centre [m]."""
    margin = CLOSING_M + 3 * VOXEL_M
    origin = body.bounds[0] - margin
    shape = np.ceil((body.bounds[1] - body.bounds[0] + 2 * margin) / VOXEL_M).astype(int)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape), indexing="ij"), axis=-1)
    inside = np.zeros(shape, dtype=bool)
    for i in range(shape[0]):
        inside[i] = body.contains(origin + grid[i].reshape(-1, 3) * VOXEL_M).reshape(shape[1:])
    return inside, origin


def _fill_hull(inside: ndarray, origin: ndarray, points: ndarray) -> None:
    """Mark the cells within the convex hull of some points."""
    lo = np.floor((points.min(axis=0) - origin) / VOXEL_M).astype(int)
    hi = np.ceil((points.max(axis=0) - origin) / VOXEL_M).astype(int) + 1
    cells = np.stack(np.meshgrid(*map(np.arange, lo, hi), indexing="ij"), axis=-1)
    block = tuple(map(slice, lo, hi))
    inside[block] |= Delaunay(points).find_simplex(origin + cells * VOXEL_M) >= 0


def transfer(
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    points: Float[ndarray, "t 3"],
) -> tuple[Int[ndarray, "t 3"], Float[ndarray, "t 3"]]:
    """Corners and barycentric weights of the closest place on a mesh to each point.

    Returns:
        Vertex indices (T, 3) and weights (T, 3) whose rows sum to 1.
    """
    import trimesh

    body = trimesh.Trimesh(vertices, faces, process=False)
    closest, _, triangle = trimesh.proximity.closest_point(body, points)
    corners = faces[triangle]
    weights = trimesh.triangles.points_to_barycentric(vertices[corners], closest)
    weights = np.clip(np.nan_to_num(weights, nan=1 / 3), 0, 1)
    return corners, weights / weights.sum(axis=1, keepdims=True)


def smooth_weights(
    weights: Float[ndarray, "v l"], faces: Int[ndarray, "f 3"], rounds: int
) -> Float[ndarray, "v l"]:
    """Average each vertex's weights with its neighbours', `rounds` times."""
    from scipy import sparse

    n = len(weights)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    ones = np.ones(len(edges))
    ring = sparse.coo_matrix((ones, (edges[:, 0], edges[:, 1])), shape=(n, n))
    ring = (ring + ring.T).sign()
    mean = sparse.diags(1 / np.maximum(np.asarray(ring.sum(axis=1)).ravel(), 1)) @ ring
    for _ in range(rounds):
        weights = 0.5 * weights + 0.5 * (mean @ weights)
    return weights


def strongest_four(
    weights: Float[ndarray, "v l"],
) -> tuple[Int[ndarray, "v 4"], Float[ndarray, "v 4"]]:
    """The four largest weights of each row, scaled to sum to 1, and their columns."""
    index = np.argsort(-weights, axis=1, kind="stable")[:, :4]
    top = np.take_along_axis(weights, index, axis=1).astype(np.float32)
    top = np.where(top < 1e-3, 0, top)
    return index.astype(np.uint8), top / top.sum(axis=1, keepdims=True)

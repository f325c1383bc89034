# SPDX-License-Identifier: Apache-2.0
"""Rays against triangles with embree [WWBJE14], and depth in double precision.

embree finds the triangle in single precision; depth comes from that triangle's plane in double
precision. Closed meshes let no rays through, but for those exactly at a vertex, one in sixty.

[WWBJE14] Wald, Woop, Benthin, Johnson, Ernst, Embree: A Kernel Framework for Efficient CPU Ray
    Tracing, ACM Transactions on Graphics 33(4), 2014.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int
from numba import njit
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from synthesis.extras import needed

TILE_PX = 8
"""Side of the squares in which triangles are looked for [px]."""
NEAR_M = 0.02
"""A triangle that comes nearer than this to the camera's plane may be anywhere in the image [m]."""
SAME_M = 1e-3
"""Depths in single and double precision that differ by more are of a needle seen from its edge."""


@dataclass(frozen=True)
class Rays:
    """A ray a pixel from one point, scaled so that its parameter is depth along the camera's z."""

    origin: Float[ndarray, " 3"]
    """Where they start, world frame [m]."""
    directions: Float[ndarray, "n 3"]
    """World frame; z of the camera frame is 1."""


@dataclass(frozen=True)
class Hits:
    """What M of the rays meet."""

    ray: Int[ndarray, " m"]
    """Which ray, ascending."""
    face: Int[ndarray, " m"]
    """Nearest triangle."""
    weights: Float[ndarray, "m 3"]
    """Barycentric coordinates in it."""
    depth_m: Float[ndarray, " m"]
    """Depth along the camera's z [m]."""
    normal: Float[ndarray, "m 3"]
    """Unit normal of the triangle's plane, towards the camera."""
    cosine: Float[ndarray, " m"]
    """Of the angle between ray and normal, 0..1."""

    def chosen(self, keep: Bool[ndarray, " m"]) -> Hits:
        """Some of them."""
        return Hits(*(getattr(self, field.name)[keep] for field in fields(self)))


class Caster:
    """Triangles that rays can meet."""

    def __init__(self, vertices_world: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"]) -> None:
        """Build the tree.

        Args:
            vertices_world: Vertices [m].
            faces: Triangles.

        Raises:
            SceneError: if a vertex is not finite.
        """
        mesh_construction = needed("embreex.mesh_construction")
        rtcore_scene = needed("embreex.rtcore_scene")
        if not np.isfinite(vertices_world).all():
            broken = np.flatnonzero(~np.isfinite(vertices_world).all(axis=1))
            raise SceneError(
                f"vertex {broken[0]} is {vertices_world[broken[0]].tolist()}; {len(broken)} of "
                f"{len(vertices_world)} vertices are not finite"
            )
        self.vertices = np.ascontiguousarray(vertices_world, dtype=float)
        self.faces = np.ascontiguousarray(faces, dtype=np.int32)
        self.box = self.vertices.min(axis=0), self.vertices.max(axis=0)
        self._scene = rtcore_scene.EmbreeScene(robust=True)
        mesh_construction.TriangleMesh(self._scene, self.vertices.astype(np.float32), self.faces)

    def cast(self, rays: Rays, chosen: Int[ndarray, " n"] | None = None) -> Hits:
        """The nearest triangle along each ray.

        Args:
            rays: The rays.
            chosen: Which of them to cast, ascending; all if None.
        """
        directions = rays.directions if chosen is None else rays.directions[chosen]
        origins = np.tile(rays.origin.astype(np.float32), (len(directions), 1))
        found = self._scene.run(origins, directions.astype(np.float32), output=1)
        row = np.flatnonzero(found["primID"] >= 0)
        ray = row if chosen is None else chosen[row]
        found = tuple(found[name] for name in ("primID", "u", "v", "tfar"))
        arrays = (self.vertices, self.faces, row, *found, rays.origin, directions)
        return Hits(ray, *_planes(*arrays))

    def occluded(
        self, starts: Float[ndarray, "n 3"], steps: Float[ndarray, "n 3"]
    ) -> Bool[ndarray, " n"]:
        """Whether anything lies between start and start + step, shape (N,)."""
        starts, steps = np.asarray(starts, np.float32), np.asarray(steps, np.float32)
        reach = np.ones(len(starts), dtype=np.float32)
        return np.asarray(self._scene.run(starts, steps, reach, query="OCCLUDED") >= 0)


def camera_rays(camera: PinholeCamera, T_world_camera: Float[ndarray, "4 4"]) -> Rays:
    """A ray through every pixel's centre, row after row."""
    R = T_world_camera[:3, :3]
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    columns, rows = x[:, None] * R[:, 0], y[:, None] * R[:, 1] + R[:, 2]
    return Rays(T_world_camera[:3, 3].copy(), (rows[:, None] + columns).reshape(-1, 3))


def pixels_near(
    vertices_camera: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"], camera: PinholeCamera
) -> Int[ndarray, " n"]:
    """Pixels that may see a mesh: those of all tiles that a triangle's bounding box touches.

    Args:
        vertices_camera: Vertices, camera frame [m].
        faces: Triangles.
        camera: The camera.

    Returns:
        Pixel numbers, row after row, ascending.
    """
    tiles = np.zeros((-(-camera.height // TILE_PX), -(-camera.width // TILE_PX)), dtype=np.bool_)
    if _mark(vertices_camera, faces, camera.fx, camera.fy, camera.cx, camera.cy, tiles):
        return np.arange(camera.width * camera.height)
    pixels = np.repeat(np.repeat(tiles, TILE_PX, axis=0), TILE_PX, axis=1)
    return np.flatnonzero(pixels[: camera.height, : camera.width])


@njit(cache=True)
def _planes(vertices, faces, row, face, u, v, tfar, origin, directions):
    """Triangle, weights, depth, unit normal and cosine where rays meet their triangles' planes."""
    count = row.shape[0]
    met = np.empty(count, dtype=np.int64)
    weights, normal = np.empty((count, 3)), np.empty((count, 3))
    depth, cosine = np.empty(count), np.empty(count)
    for n in range(count):
        r = row[n]
        met[n] = face[r]
        f, d = faces[face[r]], directions[r]
        a, b, c = vertices[f[0]], vertices[f[1]], vertices[f[2]]
        e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        g0, g1, g2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        x, y, z = e1 * g2 - e2 * g1, e2 * g0 - e0 * g2, e0 * g1 - e1 * g0
        size = np.sqrt(x * x + y * y + z * z)
        slope = x * d[0] + y * d[1] + z * d[2]
        length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        depth[n] = tfar[r]
        if abs(slope) > 1e-9 * size * length and size > 0.0:
            exact = x * (a[0] - origin[0]) + y * (a[1] - origin[1]) + z * (a[2] - origin[2])
            exact /= slope
            if abs(exact - tfar[r]) < SAME_M:
                depth[n] = exact
        scale = -1.0 / size if slope > 0.0 else 1.0 / max(size, 1e-30)
        normal[n, 0], normal[n, 1], normal[n, 2] = x * scale, y * scale, z * scale
        cosine[n] = min(1.0, abs(slope) / max(size * length, 1e-30))
        weights[n, 0], weights[n, 1], weights[n, 2] = 1.0 - u[r] - v[r], u[r], v[r]
    return met, weights, depth, normal, cosine


@njit(cache=True)
def _mark(v, faces, fx, fy, cx, cy, tiles):
    """Mark the tiles of every triangle; True if one reaches the camera's plane."""
    height, width = tiles.shape
    for f in range(faces.shape[0]):
        nearest, farthest = np.inf, -np.inf
        left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
        for k in range(3):
            p = v[faces[f, k]]
            nearest, farthest = min(nearest, p[2]), max(farthest, p[2])
            if p[2] >= NEAR_M:
                x, y = fx * p[0] / p[2] + cx, fy * p[1] / p[2] + cy
                left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
        if farthest <= 0.0:
            continue
        if nearest < NEAR_M:
            return True
        i0 = int(max(np.floor((top - 1.0) / TILE_PX), 0.0))
        i1 = int(min(np.floor((bottom + 1.0) / TILE_PX), height - 1.0))
        j0 = int(max(np.floor((left - 1.0) / TILE_PX), 0.0))
        j1 = int(min(np.floor((right + 1.0) / TILE_PX), width - 1.0))
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                tiles[i, j] = True
    return False

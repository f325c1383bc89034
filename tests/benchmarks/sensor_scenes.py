# SPDX-License-Identifier: Apache-2.0
"""Plain rooms to point a sensor model at: boxes, slats and a person of capsules."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.geometry import invert_rigid, transform_points
from kintrack.raster import rasterise
from synthesis.render.view import View
from synthesis.sensors.sensor import Sensor, rays

_CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip

Part = tuple[Float[ndarray, "v 3"], Int[ndarray, "f 3"], float]
"""Vertices, world frame [m]; triangles; infrared albedo."""


def box(centre: tuple[float, ...], size: tuple[float, ...], albedo: float) -> Part:
    """A box along the axes [m]."""
    return _CUBE * size + centre, _CUBE_FACES, albedo


def ellipsoid(centre: tuple[float, ...], radii: tuple[float, ...], albedo: float) -> Part:
    """An ellipsoid along the axes [m]."""
    rings, n = 24, 36
    polar, turn = np.pi * np.arange(rings + 1) / rings, 2 * np.pi * np.arange(n) / n
    points = np.stack(
        [
            np.outer(np.sin(polar), np.cos(turn)),
            np.outer(np.sin(polar), np.sin(turn)),
            np.outer(np.cos(polar), np.ones(n)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(rings), np.arange(n), indexing="ij")
    a, b, c, d = (i * n + j, i * n + (j + 1) % n, (i + 1) * n + j, (i + 1) * n + (j + 1) % n)
    faces = np.concatenate([np.stack([a, c, b], -1), np.stack([b, c, d], -1)]).reshape(-1, 3)
    return points * radii + centre, faces, albedo


def person(x_m: float, y_m: float, albedo: float = 0.35) -> list[Part]:
    """Someone standing, arms a little off, out of ellipsoids."""
    shapes = [
        ((0, 0, 1.62), (0.10, 0.085, 0.13), 0.5),
        ((0, 0, 1.62 + 0.06), (0.105, 0.09, 0.09), 0.1),
        ((0, 0, 1.2), (0.13, 0.20, 0.34), albedo),
        ((0, 0, 0.95), (0.13, 0.18, 0.2), 0.25),
    ]
    for side in (-1, 1):
        shapes += [
            ((0.0, 0.27 * side, 1.15), (0.055, 0.06, 0.33), albedo),
            ((0.06, 0.31 * side, 0.83), (0.05, 0.045, 0.12), 0.5),
            ((0, 0.1 * side, 0.5), (0.085, 0.085, 0.5), 0.25),
            ((0.06, 0.1 * side, 0.04), (0.14, 0.05, 0.05), 0.1),
        ]
    return [ellipsoid((x + x_m, y + y_m, z), radii, a) for (x, y, z), radii, a in shapes]


def kitchen() -> list[Part]:
    """Floor, two walls with a dark skirting, a table and a chair with slats."""
    parts = [
        box((0, 0, -0.05), (8, 8, 0.1), 0.4),
        box((-2.0, 0, 1.5), (0.1, 8, 3), 0.7),
        box((0, -2.2, 1.5), (8, 0.1, 3), 0.6),
        box((-1.94, 0, 0.05), (0.02, 8, 0.1), 0.01),
        box((-1.8, 0.5, 1.45), (0.3, 1.2, 0.7), 0.6),
        box((-0.3, 0.5, 0.73), (0.8, 1.4, 0.04), 0.5),
        box((-0.3, 0.9, 0.95), (0.08, 0.08, 0.1), 0.6),
    ]
    for x in (-0.65, 0.05):
        for y in (-0.15, 1.15):
            parts.append(box((x, y, 0.36), (0.06, 0.06, 0.72), 0.4))
    for z in (0.6, 0.68, 0.76, 0.84, 0.92):
        parts.append(box((-1.0, -0.75, z), (0.03, 0.4, 0.035), 0.4))
    for y in (-0.97, -0.53):
        parts.append(box((-1.0, y, 0.5), (0.03, 0.04, 1.0), 0.4))
        parts.append(box((-0.6, y, 0.22), (0.04, 0.04, 0.44), 0.4))
    parts.append(box((-0.8, -0.75, 0.45), (0.42, 0.46, 0.04), 0.4))
    return parts


def wall_view(sensor: Sensor, depth_m: float, tilt_rad: float = 0.0, albedo: float = 0.7) -> View:
    """An endless wall that crosses the camera's axis, turned about the vertical."""
    camera = rays(sensor.camera, sensor.supersampling)
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy)[:, None] / camera.fy
    facing = np.cos(tilt_rad) + x * np.sin(tilt_rad) + 0.0 * y
    there = facing > 1e-3
    depth = np.where(there, depth_m * np.cos(tilt_rad) / np.where(there, facing, 1.0), 0.0)
    angle = np.arccos(np.clip(facing / np.sqrt(1.0 + x**2 + y**2), 0.0, 1.0))
    return View(
        camera,
        depth,
        np.where(there, angle, 0.0),
        np.where(there, albedo, 0.0),
        np.zeros(depth.shape, dtype=np.uint8),
    )


def view_of(parts: list[Part], sensor: Sensor, T_world_camera: Float[ndarray, "4 4"]) -> View:
    """What the rays of a sensor meet."""
    camera = rays(sensor.camera, sensor.supersampling)
    starts = np.cumsum([0] + [len(v) for v, _, _ in parts])
    world = np.vstack([v for v, _, _ in parts])
    faces = np.vstack([f + s for (_, f, _), s in zip(parts, starts, strict=False)])
    albedo = np.concatenate([np.full(len(f), a) for _, f, a in parts])
    faces, albedo, world = _split(world, faces, albedo)
    points = transform_points(invert_rigid(T_world_camera), world)
    depth, face = rasterise(points, faces, camera)
    hit = face >= 0
    depth = np.where(hit, depth, 0.0)
    a, b, c = np.moveaxis(points[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    ray = camera.back_project(depth)
    ray /= np.maximum(np.linalg.norm(ray, axis=-1, keepdims=True), 1e-12)
    cosine = np.abs(np.einsum("hwi,hwi->hw", ray, normal[face]))
    return View(
        camera,
        depth,
        np.where(hit, np.arccos(np.clip(cosine, 0.0, 1.0)), 0.0),
        np.where(hit, albedo[face], 0.0),
        np.zeros(depth.shape, dtype=np.uint8),
    )


def looking(eye: tuple[float, ...], target: tuple[float, ...]) -> Float[ndarray, "4 4"]:
    """T_world_camera of a camera at `eye` that looks at `target`, upright [m]."""
    forward = np.subtract(target, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    T_world_camera = np.eye(4)
    T_world_camera[:3, :3] = np.column_stack([right, np.cross(forward, right), forward])
    T_world_camera[:3, 3] = eye
    return T_world_camera


def _split(
    vertices: Float[ndarray, "v 3"], faces: Int[ndarray, "f 3"], albedo: Float[ndarray, " f"]
) -> tuple[Int[ndarray, "g 3"], Float[ndarray, " g"], Float[ndarray, "w 3"]]:
    """Triangles cut in four until no side is longer than a metre: none is lost at the camera."""
    for _ in range(5):
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]
        long = np.max(sides, axis=0) > 1.0
        if not long.any():
            break
        a, b, c = a[long], b[long], c[long]
        new = np.stack([a, b, c, (a + b) / 2, (b + c) / 2, (c + a) / 2], axis=1)
        at = len(vertices) + 6 * np.arange(len(new))[:, None, None]
        pattern = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
        vertices = np.vstack([vertices, new.reshape(-1, 3)])
        faces = np.vstack([faces[~long], (at + pattern).reshape(-1, 3)])
        albedo = np.concatenate([albedo[~long], np.repeat(albedo[long], 4)])
    return faces, albedo, vertices

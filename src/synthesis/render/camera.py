# SPDX-License-Identifier: Apache-2.0
"""What a depth camera would see if it made no errors.

A scene is rendered with `SUPERSAMPLING` samples a pixel along each axis. A sensor
(`synthesis.sensors`) misreads the samples, and the image takes the sample at each pixel's centre,
so nothing is averaged across an edge. The Kinect v1 does the same: it matches at 640 x 480 and
hands out every second value at 320 x 240.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.geometry import (
    T_LEVEL_WORLD_CAMERA,
    PinholeCamera,
    invert_rigid,
    transform_points,
)
from kintrack.raster import rasterise

SUPERSAMPLING = 2


@dataclass(frozen=True)
class View:
    """What the samples of a camera see, without noise."""

    camera: PinholeCamera
    """Camera of the image."""
    samples: PinholeCamera
    """Camera of the samples; `samples.scaled(SUPERSAMPLING)` is `camera`."""
    sample_depth_m: Float[ndarray, "h2 w2"]
    """Depth along z [m], 0 = nothing there."""
    sample_face: Int[ndarray, "h2 w2"]
    """Triangle seen, -1 = none."""
    sample_angle_rad: Float[ndarray, "h2 w2"]
    """Angle between the ray and the triangle's normal, 0..pi/2; 0 where there is none."""

    @property
    def depth_m(self) -> Float[ndarray, "h w"]:
        """Depth at the pixels' centres [m], 0 = nothing there."""
        return self.sample_depth_m[::SUPERSAMPLING, ::SUPERSAMPLING]

    def labels(
        self, faces: Int[ndarray, "f 3"], vertex_labels: UInt8[ndarray, " v"]
    ) -> UInt8[ndarray, "h w"]:
        """Part label at the pixels' centres: what most corners of the triangle say, 0 = none."""
        face = self.sample_face[::SUPERSAMPLING, ::SUPERSAMPLING]
        of_face = np.sort(vertex_labels[faces], axis=1)[:, 1]
        return np.where(face >= 0, of_face[face], 0).astype(np.uint8)


def level_camera(distance_m: float, height_m: float) -> Float[ndarray, "4 4"]:
    """T_world_camera of a level camera on the x axis that looks back at the origin.

    Args:
        distance_m: From the origin, along x [m].
        height_m: Above the floor z = 0 [m].
    """
    T_world_placed = np.diag([-1.0, -1.0, 1.0, 1.0])
    T_world_placed[:3, 3] = [distance_m, 0.0, height_m]
    return T_world_placed @ T_LEVEL_WORLD_CAMERA


def look(
    vertices_world: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    camera: PinholeCamera,
    T_world_camera: Float[ndarray, "4 4"],
) -> View:
    """Render a mesh.

    Args:
        vertices_world: Vertices [m], shape (V, 3).
        faces: Triangles, shape (F, 3).
        camera: Camera of the image.
        T_world_camera: Its pose.

    Returns:
        The noiseless view.
    """
    k = SUPERSAMPLING
    samples = PinholeCamera(
        k * camera.width,
        k * camera.height,
        k * camera.fx,
        k * camera.fy,
        k * camera.cx,
        k * camera.cy,
    )
    vertices = transform_points(invert_rigid(T_world_camera), vertices_world)
    depth, face = rasterise(vertices, faces, samples)
    depth = np.where(face >= 0, depth, 0.0)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    ray = samples.back_project(depth)
    scale = np.linalg.norm(ray, axis=-1) * np.linalg.norm(normal, axis=-1)[face]
    cosine = np.abs(np.einsum("hwi,hwi->hw", ray, normal[face])) / np.maximum(scale, 1e-12)
    angle = np.where(face >= 0, np.arccos(np.clip(cosine, 0.0, 1.0)), 0.0)
    return View(camera, samples, depth, face, angle)

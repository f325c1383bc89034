# SPDX-License-Identifier: Apache-2.0
"""A scene that cameras can look at: what stands still, what moves, and light."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from synthesis.mesh import Mesh
from synthesis.render.cast import Caster, Hits, Rays, camera_rays, pixels_near
from synthesis.render.contact import FloorMap, darken
from synthesis.render.layer import Layer, as_view, nothing
from synthesis.render.lights import Lights
from synthesis.render.part import Part
from synthesis.render.shade import albedo, light, surface
from synthesis.render.shadow import cast_shadows
from synthesis.render.view import View

HAZE = 0.5
"""Radiance where nothing is, as a share of the diffuse light from above."""


class Stage:
    """Rays into a scene.

    As long as camera and pose stay, what stands still is met and lit once, and only the pixels that
    may see what moves are cast again; the images are the same as those of a fresh stage.
    """

    def __init__(self, fixed: Mesh | None, moving: Mesh | None, lights: Lights) -> None:
        """Set the stage.

        Args:
            fixed: What stands still, world frame; None for nothing.
            moving: What moves; its vertices are given anew to every view. None for nothing.
            lights: Lamps.

        Raises:
            SceneError: if a vertex of `fixed` is not finite.
        """
        self.lights = lights
        self._moving = None if moving is None else Part(moving)
        self._fixed = None if fixed is None else Part(fixed)
        self._standing: tuple[Caster, ...] = ()
        if fixed is not None:
            self._standing = (Caster(fixed.vertices, fixed.faces),)
        self._floor: FloorMap | None = None
        self._last: tuple[PinholeCamera, ndarray, bool, Rays, Layer] | None = None

    def view(
        self,
        vertices_world: Float[ndarray, "v 3"] | None,
        camera: PinholeCamera,
        T_world_camera: Float[ndarray, "4 4"],
        color: bool = True,
    ) -> View:
        """What a camera sees.

        Args:
            vertices_world: Where the vertices of what moves are now [m]; those of the mesh if None.
            camera: Camera whose every pixel is a ray.
            T_world_camera: Its pose.
            color: Whether colour is wanted.

        Returns:
            The view.

        Raises:
            SceneError: if the vertices are not as many as the mesh has, or one is not finite.
        """
        rays, layer = self._background(camera, T_world_camera, color)
        if self._moving is not None:
            mesh = self._moving.mesh
            vertices = mesh.vertices if vertices_world is None else np.asarray(vertices_world)
            if vertices.shape != mesh.vertices.shape:
                raise SceneError(
                    f"{vertices.shape} is the shape of the moving vertices; "
                    f"{mesh.vertices.shape} is that of the mesh"
                )
            caster = Caster(vertices, mesh.faces)
            points_camera = transform_points(invert_rigid(T_world_camera), caster.vertices)
            hits = caster.cast(rays, pixels_near(points_camera, mesh.faces, camera))
            hits = hits.chosen(hits.depth_m < layer.depth_m[hits.ray])
            layer = layer.copy()
            if color:
                darken(layer.diffuse, layer.place, layer.normal, self._moving.floor_map(caster))
            self._put(layer, self._moving, caster, hits, rays, color)
            if color:
                for standing in self._standing:
                    self._shade(layer, standing, hits.ray, camera.width)
                self._shade(layer, caster, np.arange(len(layer.clear)), camera.width)
        return as_view(layer, camera, color)

    def _background(
        self, camera: PinholeCamera, T_world_camera: Float[ndarray, "4 4"], color: bool
    ) -> tuple[Rays, Layer]:
        """Rays, and what they meet of what stands still."""
        if self._last is not None:
            camera_then, T_then, color_then, rays, layer = self._last
            if camera == camera_then and np.array_equal(T_then, T_world_camera):
                if color_then or not color:
                    return rays, layer
        rays = camera_rays(camera, T_world_camera)
        layer = nothing(len(rays.directions), HAZE * np.asarray(self.lights.sky), color)
        if self._fixed is not None:
            (caster,) = self._standing
            hits = caster.cast(rays)
            self._put(layer, self._fixed, caster, hits, rays, color)
            if color:
                if self._floor is None:
                    self._floor = self._fixed.floor_map(caster)
                darken(layer.diffuse, layer.place, layer.normal, self._floor)
                self._shade(layer, caster, hits.ray, camera.width)
        self._last = camera, np.array(T_world_camera), color, rays, layer
        return rays, layer

    def _put(
        self, layer: Layer, part: Part, caster: Caster, hits: Hits, rays: Rays, color: bool
    ) -> None:
        """Write what rays meet into a layer, lit as if nothing cast shadows."""
        at = hits.ray if len(hits.ray) < len(layer.depth_m) else slice(None)
        layer.depth_m[at] = hits.depth_m
        layer.angle_rad[at] = np.arccos(hits.cosine)
        layer.infrared[at] = part.infrared[hits.face]
        layer.labels[at] = part.labels[hits.face]
        if color:
            surfaces = surface(caster, part.smoothing, part.normals(caster), hits)
            gloss = part.gloss[hits.face]
            radiance = light(self.lights, surfaces, albedo(part.mesh, hits), gloss, rays.origin)
            layer.normal[at], layer.place[at] = surfaces
            layer.diffuse[at], layer.key[at], layer.clear[at] = radiance

    def _shade(self, layer: Layer, caster: Caster, pixels: ndarray, width: int) -> None:
        """Let triangles cast shadows on pixels."""
        if self.lights.key is not None:
            cast_shadows(self.lights.key, caster, layer.place, layer.clear, pixels, width)

# SPDX-License-Identifier: Apache-2.0
"""Radiance of surfaces: Lambert and Blinn's gloss under lamps and a hemisphere of diffuse light.

Curved surfaces are lit by normals that vary between the vertices, and their shadow rays start on
the rounded surface that these normals mean [Han21], so the triangles' edges cast no shadows.

[Han21] Hanika, Hacking the Shadow Terminator, Ray Tracing Gems II, ch. 4, 2021.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

from synthesis.mesh import Material, Mesh
from synthesis.render.cast import Caster, Hits
from synthesis.render.lights import Lamp, Lights
from synthesis.render.normals import Smoothing

LEAST_COSINE = 0.2
"""A corner whose normal is farther than this from the triangle's takes the triangle's."""
NEAREST_M = 0.3
"""Lamps do not get brighter nearer than this [m]."""
SHADE = 0.7
"""Share of its light that a lamp does not send straight up."""
SHININESS = 40.0
"""Blinn's exponent."""
OFFSET = 1e-3
"""How far above the surface shadow rays start, as a share of depth."""


class Surface(NamedTuple):
    """Where M rays end."""

    normal: Float[ndarray, "m 3"]
    """Smooth unit normal, towards the camera."""
    start: Float[ndarray, "m 3"]
    """Where shadow rays start, world frame [m]."""


class Radiance(NamedTuple):
    """Light that M rays bring back, linear red green blue."""

    diffuse: Float[ndarray, "m 3"]
    """From everywhere but the key lamp."""
    key: Float[ndarray, "m 3"]
    """From the key lamp where nothing shades it."""
    clear: UInt8[ndarray, " m"]
    """1 where it is not black."""


def surface(
    caster: Caster, shared: Smoothing, normals: Float[ndarray, "g 3"], hits: Hits
) -> Surface:
    """Smooth normals and starts of shadow rays.

    Args:
        caster: The triangles.
        shared: Which of their corners share a normal.
        normals: Unit normals of these groups.
        hits: What rays met.
    """
    meshes = (caster.vertices, caster.faces, normals, shared.groups)
    return Surface(*_surface(*meshes, hits.face, hits.weights, hits.normal, hits.depth_m))


def albedo(mesh: Mesh, hits: Hits) -> Float[ndarray, "m 3"]:
    """Linear reflectance where rays end, shape (M, 3)."""
    coords = _interpolate(mesh.coords, mesh.faces, hits.face, hits.weights)
    material = mesh.face_material[hits.face]
    out = np.zeros((len(coords), 3))
    for n in np.flatnonzero(np.bincount(material, minlength=len(mesh.materials))):
        of_material = np.flatnonzero(material == n)
        out[of_material] = mesh.materials[n].pattern(coords[of_material])
    return out


def light(
    lights: Lights,
    surfaces: Surface,
    albedos: Float[ndarray, "m 3"],
    gloss: Float[ndarray, " m"],
    origin: Float[ndarray, " 3"],
) -> Radiance:
    """Light towards the camera.

    Args:
        lights: What shines.
        surfaces: Where.
        albedos: Linear reflectance.
        gloss: Share that is reflected as by a mirror.
        origin: Where the camera is, world frame [m].
    """
    lamps = (*(() if lights.key is None else (lights.key,)), *lights.fill)
    table = np.array([_row(lamp) for lamp in lamps]).reshape(-1, 7)
    sky, ground = np.asarray(lights.sky, dtype=float), np.asarray(lights.ground, dtype=float)
    args = (*surfaces, albedos, gloss, origin, sky, ground, table, lights.key is not None)
    return Radiance(*_light(*args))


def infrared(materials: tuple[Material, ...]) -> Float[ndarray, " k"]:
    """Diffuse reflectance of materials for the sensor's own light, 0..1."""
    return np.array([m.infrared * (1.0 - m.gloss) for m in materials])


def _row(lamp: Lamp) -> list[float]:
    return [*lamp.position, *(np.asarray(lamp.color) * lamp.at_m**2), lamp.radius_m]


@njit(cache=True)
def _surface(vertices, faces, normals, groups, face, weights, flat, depth):
    count = face.shape[0]
    smooth = np.empty((count, 3), dtype=np.float32)
    start = np.empty((count, 3), dtype=np.float32)
    for n in range(count):
        f = face[n]
        g0, g1, g2 = flat[n, 0], flat[n, 1], flat[n, 2]
        p0, p1, p2 = 0.0, 0.0, 0.0
        for k in range(3):
            v, w = faces[f, k], weights[n, k]
            p0, p1, p2 = p0 + w * vertices[v, 0], p1 + w * vertices[v, 1], p2 + w * vertices[v, 2]
        s0, s1, s2 = 0.0, 0.0, 0.0
        r0, r1, r2 = p0, p1, p2
        for k in range(3):
            v, w, g = faces[f, k], weights[n, k], groups[f, k]
            m0, m1, m2 = normals[g, 0], normals[g, 1], normals[g, 2]
            agree = m0 * g0 + m1 * g1 + m2 * g2
            if agree < 0.0:
                m0, m1, m2 = -m0, -m1, -m2
            if abs(agree) < LEAST_COSINE:
                m0, m1, m2 = g0, g1, g2
            s0, s1, s2 = s0 + w * m0, s1 + w * m1, s2 + w * m2
            d0, d1, d2 = p0 - vertices[v, 0], p1 - vertices[v, 1], p2 - vertices[v, 2]
            lift = -w * min(d0 * m0 + d1 * m1 + d2 * m2, 0.0)
            r0, r1, r2 = r0 + lift * m0, r1 + lift * m1, r2 + lift * m2
        size, gap = np.sqrt(s0 * s0 + s1 * s1 + s2 * s2), OFFSET * depth[n]
        smooth[n, 0], smooth[n, 1], smooth[n, 2] = s0 / size, s1 / size, s2 / size
        start[n, 0], start[n, 1], start[n, 2] = r0 + gap * g0, r1 + gap * g1, r2 + gap * g2
    return smooth, start


@njit(cache=True)
def _interpolate(values, faces, face, weights):
    out = np.empty((face.shape[0], 3))
    for n in range(face.shape[0]):
        a, b, c = faces[face[n], 0], faces[face[n], 1], faces[face[n], 2]
        for k in range(3):
            out[n, k] = (
                weights[n, 0] * values[a, k]
                + weights[n, 1] * values[b, k]
                + weights[n, 2] * values[c, k]
            )
    return out


@njit(cache=True)
def _light(normal, place, albedo, gloss, origin, sky, ground, lamps, has_key):
    count = normal.shape[0]
    diffuse = np.empty((count, 3), dtype=np.float32)
    key = np.zeros((count, 3), dtype=np.float32)
    clear = np.zeros(count, dtype=np.uint8)
    for n in range(count):
        nx, ny, nz = normal[n]
        px, py, pz = place[n]
        vx, vy, vz = origin[0] - px, origin[1] - py, origin[2] - pz
        size = np.sqrt(vx * vx + vy * vy + vz * vz)
        vx, vy, vz = vx / size, vy / size, vz / size
        up = 0.5 + 0.5 * nz
        mirror_up = 0.5 + 0.5 * (2.0 * (nx * vx + ny * vy + nz * vz) * nz - vz)
        matte = 1.0 - gloss[n]
        for c in range(3):
            around = ground[c] + (sky[c] - ground[c]) * up
            mirrored = ground[c] + (sky[c] - ground[c]) * mirror_up
            diffuse[n, c] = matte * albedo[n, c] * around + gloss[n] * mirrored
        for k in range(lamps.shape[0]):
            lx, ly, lz = lamps[k, 0] - px, lamps[k, 1] - py, lamps[k, 2] - pz
            square = lx * lx + ly * ly + lz * lz
            far = np.sqrt(square)
            lx, ly, lz = lx / far, ly / far, lz / far
            facing = nx * lx + ny * ly + nz * lz
            if facing <= 0.0:
                continue
            shine = 0.0
            if gloss[n] > 0.0:
                hx, hy, hz = lx + vx, ly + vy, lz + vz
                half = (nx * hx + ny * hy + nz * hz) / np.sqrt(hx * hx + hy * hy + hz * hz)
                shine = gloss[n] * (SHININESS + 8.0) / 8.0 * max(half, 0.0) ** SHININESS
            amount = facing * (1.0 - SHADE * max(-lz, 0.0)) / max(square, NEAREST_M * NEAREST_M)
            for c in range(3):
                value = (matte * albedo[n, c] + shine) * lamps[k, 3 + c] * amount
                if k == 0 and has_key:
                    key[n, c] = value
                    clear[n] |= value > 0.0
                else:
                    diffuse[n, c] += value
    return diffuse, key, clear

# SPDX-License-Identifier: Apache-2.0
"""Shapes whose depth is known in closed form."""

import numpy as np

from kintrack.geometry import PinholeCamera
from synthesis.albedo import Plain
from synthesis.mesh import Material, mesh_of
from synthesis.render.lights import Lamp, Lights

CAMERA = PinholeCamera(128, 96, 120.0, 120.0, 64.0, 48.0)
PAPER = Material(Plain((1.0, 1.0, 1.0)), infrared=0.8)
DAY = Lights(sky=np.full(3, 0.4), ground=np.full(3, 0.2))


def lamp(position, strength=1.0, radius_m=0.0):
    """Light that comes from one lamp alone; `strength` holds a metre away."""
    color = strength * np.ones(3)
    return Lights(np.zeros(3), np.zeros(3), Lamp(np.array(position, float), color, 1.0, radius_m))


def floor(half_m=4.0, z=0.0, material=PAPER, labels=None):
    """A square that looks up."""
    h = half_m
    corners = np.array([[-h, -h, z], [h, -h, z], [h, h, z], [-h, h, z]])
    return mesh_of(corners, np.array([[0, 1, 2], [0, 2, 3]]), material, labels=labels)


def box(low, high, material=PAPER, label=0):
    """A box between two corners."""
    pick = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    corners = np.where(pick, high, low).astype(float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])]
    return mesh_of(corners, np.array(faces), material, labels=np.full(8, label, np.uint8))


def sphere(center, radius_m, rows=64, material=PAPER, label=0):
    """A sphere of latitudes and longitudes."""
    a, b = np.meshgrid(np.linspace(0, np.pi, rows + 1), np.arange(2 * rows) * np.pi / rows)
    points = np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], axis=-1)
    n = np.arange(points[..., 0].size).reshape(points.shape[:2])
    p, q = n, np.roll(n, -1, axis=0)
    quads = np.stack([p[:, :-1], p[:, 1:], q[:, 1:], q[:, :-1]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    vertices = np.array(center) + radius_m * points.reshape(-1, 3)
    return mesh_of(vertices, faces, material, labels=np.full(len(vertices), label, np.uint8))

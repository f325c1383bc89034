# SPDX-License-Identifier: Apache-2.0
"""A thing on the floor between camera and person."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from kintrack.raster import rasterise
from kintrack.skin import skinned_vertices
from synthesis.mesh import Mesh
from synthesis.motions.legs import yaw_matrix
from synthesis.motions.motion import Motion
from synthesis.objects.thing import Thing
from synthesis.occlusion.silhouette import Silhouette, hidden_share
from synthesis.people.person import Person

GAP_M = (0.2, 0.9)
"""Least and largest gap between the thing and where the person moves [m]."""
ASIDE_M = 0.35
"""Standard deviation of its place across the line of sight [m]."""
SHARE = (0.12, 0.6)
"""Least and largest share of the person that it hides."""
NEAR_CAMERA_M = 0.4
"""How near to the camera it may come [m]."""
SIZE = (0.85, 1.2)
"""Smallest and largest scale."""
STEP = 8
"""Every how many pixels the hidden share is measured."""
LOOKS = 5
"""Frames in which it is measured."""
ATTEMPTS = 60


def barrier(
    person: Person,
    motion: Motion,
    camera: PinholeCamera,
    T_world_camera: Float[ndarray, "4 4"],
    things: Mapping[str, Callable[[np.random.Generator], Thing]],
    rng: np.random.Generator,
) -> Mesh | None:
    """Draw things and places until one hides a fair share of the person.

    Args:
        person: Who.
        motion: What she does; floor at z = 0.
        camera: The camera.
        T_world_camera: Its pose.
        things: Kinds to choose from.
        rng: Draws.

    Returns:
        The thing in the world frame; None if no place was found, as for a person who comes so near
        that nothing fits before her.
    """
    T_camera_world = invert_rigid(T_world_camera)
    small = camera.scaled(STEP)
    frames = np.linspace(0, len(motion.q) - 1, LOOKS).astype(int)
    skins = [
        skinned_vertices(run_kinematics(person.body, motion.q[n]), person.skin) for n in frames
    ]
    seen = [
        rasterise(transform_points(T_camera_world, skin), person.skin.faces, small)[0]
        for skin in skins
    ]
    persons = [Silhouette(np.isfinite(depth), depth) for depth in seen if np.isfinite(depth).any()]
    floor = np.concatenate(skins)[::20, :2]
    eye = T_world_camera[:2, 3]
    towards = floor.mean(axis=0) - eye
    towards /= np.linalg.norm(towards)
    across = np.array([-towards[1], towards[0]])
    front = float(((floor - eye) @ towards).min())
    for _ in range(ATTEMPTS if persons else 0):
        kind = str(rng.choice(list(things)))
        T = np.eye(4)
        T[:3, :3] = rng.uniform(*SIZE) * yaw_matrix(rng.uniform(-np.pi, np.pi))
        mesh = things[kind](rng).mesh.moved(T)
        depth = mesh.vertices[:, :2] @ towards
        far = front - rng.uniform(*GAP_M)
        T = np.eye(4)
        T[:2, 3] = eye + (far - depth.max()) * towards + rng.normal(0.0, ASIDE_M) * across
        mesh = mesh.moved(T)
        points = transform_points(T_camera_world, mesh.vertices)
        if points[:, 2].min() < NEAR_CAMERA_M:
            continue
        other = rasterise(points, mesh.faces, small)[0]
        other = np.where(np.isfinite(other), other, 0.0)
        if SHARE[0] <= np.mean([hidden_share(p, other) for p in persons]) <= SHARE[1]:
            return mesh
    return None

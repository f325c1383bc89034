# SPDX-License-Identifier: Apache-2.0
"""A random furnished room around a person who is filmed."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.random import Generator

from kintrack.errors import SceneError
from synthesis.mesh import Mesh, join
from synthesis.objects.bars import pose
from synthesis.objects.catalogue import training_things
from synthesis.objects.furnishing import furnish
from synthesis.objects.litter import floor_clutter
from synthesis.objects.plan import Plan, thinned
from synthesis.objects.thing import Thing
from synthesis.objects.walls import hangings, shell

MOST_FACES = 60_000
"""Triangles of a room at most."""
HEIGHT_M = (2.55, 3.1)
"""Of walls [m]; lamps hang below."""


def room(
    rng: Generator,
    keep_clear: Float[ndarray, "n 2"],
    camera_position: Float[ndarray, " 3"],
    view: Float[ndarray, "4 4"],
    things: Mapping[str, Callable[[Generator], Thing]] | None = None,
) -> Mesh:
    """Draw a room that leaves the person free and in sight.

    It has a floor, two to four walls 0.5 to 4 m behind and around (the others far away), doors,
    windows and pictures, and is between nearly empty and cluttered. Nothing comes nearer than
    `plan.CLEAR_M` to the person or `plan.CAMERA_CLEAR_M` to the camera; what stands between the
    two is lower than the lines of sight to the knees.

    Args:
        rng: Draws all of it.
        keep_clear: Places that the person, and what she sits on, takes up during the motion [m].
        camera_position: Of the camera, world [m].
        view: T_world_camera.
        things: Kinds of things to furnish with; those of training sets if None.

    Returns:
        One mesh in the world frame, at most `MOST_FACES` triangles.

    Raises:
        SceneError: if there is no place to keep clear, or one is not finite.
    """
    keep_clear = np.asarray(keep_clear, dtype=float).reshape(-1, 2)
    if len(keep_clear) == 0 or not np.isfinite(keep_clear).all():
        raise SceneError(f"{len(keep_clear)} places to keep clear: finite ones are needed")
    things = training_things() if things is None else things
    T_world_room = _frame(rng, keep_clear, np.asarray(camera_position, dtype=float), view)
    T_room_world = np.linalg.inv(T_world_room)
    person = thinned(keep_clear) @ T_room_world[:2, :2].T + T_room_world[:2, 3]
    camera = T_room_world[:3, :3] @ camera_position + T_room_world[:3, 3]
    plan = _plan(rng, person, camera)
    walls = {"back": True} | {name: bool(rng.random() < 0.7) for name in ("left", "right")}
    walls["front"] = bool(rng.random() < 0.5)
    if sum(walls.values()) < 2:
        walls[str(rng.choice(["left", "right"]))] = True
    height, clutter = rng.uniform(*HEIGHT_M), rng.uniform(0, 1) ** 1.3
    parts = shell(rng, plan, walls, height, ceiling=bool(rng.random() < 0.9))
    parts += hangings(rng, plan, walls, height)
    parts += floor_clutter(rng, plan, clutter)
    left = MOST_FACES - sum(len(mesh.faces) for mesh in parts)
    parts += furnish(rng, plan, things, walls, clutter, left)
    return join(parts).moved(T_world_room)


def _frame(rng: Generator, keep_clear: ndarray, camera: ndarray, view: ndarray) -> ndarray:
    """T_world_room: origin below the person's middle, x about along the view."""
    ahead = np.asarray(view, dtype=float)[:2, 2]
    if np.linalg.norm(ahead) < 0.3:
        ahead = keep_clear.mean(axis=0) - camera[:2]
    yaw = np.arctan2(ahead[1], ahead[0])
    askew = rng.uniform(-0.8, 0.8) if rng.random() < 0.3 else rng.normal(0, 0.12)
    return pose((*keep_clear.mean(axis=0), 0.0), float(yaw + askew))


def _plan(rng: Generator, person: ndarray, camera: ndarray) -> Plan:
    both = np.concatenate([person, camera[None, :2]])
    behind, left, right = 0.5 + 3.5 * rng.uniform(0, 1, 3) ** [1.5, 1.0, 1.0]
    low = np.array([both[:, 0].min() - rng.uniform(0.6, 2.0), both[:, 1].min() - right])
    high = np.array([person[:, 0].max() + behind, both[:, 1].max() + left])
    high[0] = max(high[0], camera[0] + 0.6)
    return Plan(person, camera, low, high)

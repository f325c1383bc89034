# SPDX-License-Identifier: Apache-2.0
"""Frames that hands and held things are placed in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation, Slerp

from kintrack.errors import SceneError
from synthesis.motions.curves import smooth
from synthesis.motions.holding import frame_path
from synthesis.motions.motion import RATE_HZ, Motion
from synthesis.objects.thing import Thing
from synthesis.people.person import Person


def upright_chest(
    person: Person, motion: Motion, smooth_s: float = 0.12
) -> Float[ndarray, "n 4 4"]:
    """Frames at the chest's origin, z up, x where the chest looks, smoothed; shape (N, 4, 4)."""
    chest = frame_path(person, motion, "chest")
    yaw = np.unwrap(np.arctan2(-chest[:, 0, 1], chest[:, 1, 1]))
    return along_z(smooth(chest[:, :3, 3], RATE_HZ, smooth_s), smooth(yaw, RATE_HZ, smooth_s))


def along_z(
    places: Float[ndarray, "n 3"], yaw_rad: Float[ndarray, " n"]
) -> Float[ndarray, "n 4 4"]:
    """Upright frames from origins and headings, shape (N, 4, 4)."""
    T = np.tile(np.eye(4), (len(places), 1, 1))
    T[:, :3, :3] = Rotation.from_euler("z", yaw_rad[:, None]).as_matrix()
    T[:, :3, 3] = places
    return T


def pose(x: ArrayLike, z: ArrayLike, at: ArrayLike) -> Float[ndarray, "4 4"]:
    """A frame at a place whose x points along x (3,), its z as near to z (3,) as it can; (4, 4)."""
    ahead, up = np.asarray(x, dtype=float), np.asarray(z, dtype=float)
    ahead = ahead / np.linalg.norm(ahead)
    left = np.cross(up, ahead)
    left /= np.linalg.norm(left)
    T = np.eye(4)
    T[:3, :3] = np.stack([ahead, left, np.cross(ahead, left)], axis=1)
    T[:3, 3] = at
    return T


def mix(
    a: Float[ndarray, "n 4 4"], b: Float[ndarray, "n 4 4"], share: Float[ndarray, " n"]
) -> Float[ndarray, "n 4 4"]:
    """Poses between a (share 0) and b (share 1): straight places, shortest turns."""
    out = np.tile(np.eye(4), (len(share), 1, 1))
    turn = Rotation.from_matrix(np.swapaxes(a[:, :3, :3], 1, 2) @ b[:, :3, :3]).as_rotvec()
    out[:, :3, :3] = a[:, :3, :3] @ Rotation.from_rotvec(share[:, None] * turn).as_matrix()
    out[:, :3, 3] = a[:, :3, 3] + share[:, None] * (b[:, :3, 3] - a[:, :3, 3])
    return out


def through(
    knots: list[tuple[float, Float[ndarray, "4 4"]]], times_s: Float[ndarray, " n"]
) -> Float[ndarray, "n 4 4"]:
    """Poses through a few of them, resting at each, shape (N, 4, 4)."""
    t = np.array([time_s for time_s, _ in knots])
    if len(knots) == 1:
        return np.tile(knots[0][1], (len(times_s), 1, 1))
    k = np.clip(np.searchsorted(t, times_s, side="right") - 1, 0, len(t) - 2)
    u = np.clip((times_s - t[k]) / (t[k + 1] - t[k]), 0.0, 1.0)
    eased = k + u * u * u * (10.0 + u * (6.0 * u - 15.0))
    Ts = np.stack([T for _, T in knots])
    out = np.tile(np.eye(4), (len(times_s), 1, 1))
    out[:, :3, :3] = Slerp(np.arange(len(t)), Rotation.from_matrix(Ts[:, :3, :3]))(
        eased
    ).as_matrix()
    low = np.minimum(eased.astype(int), len(t) - 2)
    w = (eased - low)[:, None]
    out[:, :3, 3] = (1.0 - w) * Ts[low, :3, 3] + w * Ts[low + 1, :3, 3]
    return out


def place_of(thing: Thing, *names: str) -> Float[ndarray, "4 4"]:
    """The first place that a thing has of several.

    Raises:
        SceneError: if it has none of them.
    """
    for name in names:
        if name in thing.places:
            return np.asarray(thing.places[name], dtype=float)
    have = ", ".join(sorted(thing.places)) or "none"
    raise SceneError(f"{thing.name}: no place {' or '.join(names)}; it has {have}")


def draw_thing(things: Mapping, name: str, rng: np.random.Generator) -> Thing:
    """Draw a thing of a kind.

    Raises:
        SceneError: if there is no such kind.
    """
    if name not in things:
        raise SceneError(f"no thing called {name!r}; there are {', '.join(sorted(things))}")
    return things[name](rng)


def middle(thing: Thing) -> Float[ndarray, " 3"]:
    """Middle of a thing's extent, own frame [m]."""
    return 0.5 * (thing.mesh.vertices.min(axis=0) + thing.mesh.vertices.max(axis=0))


def extent(thing: Thing) -> Float[ndarray, " 3"]:
    """Size of a thing along its own axes [m]."""
    return np.ptp(thing.mesh.vertices, axis=0)

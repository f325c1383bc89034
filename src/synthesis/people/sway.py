# SPDX-License-Identifier: Apache-2.0
"""Cloth that lags behind the body and hangs from it.

Every loose vertex is a damped spring to the place s(t) where skinning puts it, lowered by what it
hangs. Its damping acts against the velocity of s, so cloth that is carried along evenly does not
trail. One implicit Euler step (unconditionally stable):

v' = (v + h w^2 (s + g - p) + 2 h z w ds/dt) / (1 + h^2 w^2 + 2 h z w),  p' = p + h v'

In bind pose cloth hangs as it was cut. As links turn by R, it is drawn along d = z_down - R z_down:
sideways and outwards by a share of its room, inwards up to its gap, so that a sleeve or a skirt
lies down on a raised limb and hangs below it. The displacement p - s is kept within the vertex's
room, and along the inward normal within the gap between the cloth and what is under it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.skin import Skin

HANG = 0.5
"""Share of its room by which cloth hangs."""
DAMPING = 0.35
"""Ratio to critical damping."""
SLOW_HZ, FAST_HZ = 1.6, 5.0
"""Natural frequency of very loose and of tight cloth [Hz]."""
LOOSE_M = 0.02
"""Room at which cloth has come most of the way from fast to slow [m]."""
FLOOR_M = 0.002
"""Cloth above this height does not sway below it [m]."""
REST_S = 1e3
"""A step so long that cloth comes to rest [s]."""
STILL_M = 0.001
"""Cloth with less room does not move [m]."""


@dataclass(frozen=True)
class Cloth:
    """The vertices of a figure that sway."""

    vertex: Int[ndarray, " n"]
    """Which."""
    links: Int[ndarray, "n 4"]
    """Links that turn each vertex's directions."""
    weights: Float[ndarray, "n 4"]
    """Their weights."""
    normals_link: Float[ndarray, "n 4 3"]
    """Outward normal in the links' frames."""
    downs_link: Float[ndarray, "n 4 3"]
    """Down as it was in bind pose, in the links' frames."""
    room_m: Float[ndarray, " n"]
    """Longest displacement outwards and sideways [m]."""
    gap_m: Float[ndarray, " n"]
    """Longest displacement inwards [m]."""
    omega: Float[ndarray, " n"]
    """Natural frequency [rad/s]."""


@dataclass
class Swing:
    """Where the cloth is at one moment; changed by every step."""

    places: Float[ndarray, "n 3"]
    """Loose vertices, world frame [m]."""
    velocities: Float[ndarray, "n 3"]
    """Their velocities [m/s]."""
    carried: Float[ndarray, "n 3"]
    """Where skinning had put them [m]."""


def cloth_of(
    skin: Skin,
    Ts_root_link: Float[ndarray, "l 4 4"],
    normals: Float[ndarray, "v 3"],
    room_m: Float[ndarray, " v"],
    gap_m: Float[ndarray, " v"],
) -> Cloth:
    """The vertices with room, and how slowly they swing.

    Args:
        skin: Surface bound to the links.
        Ts_root_link: Links in bind pose.
        normals: Outward normals in bind pose.
        room_m: Room of each vertex outwards and sideways [m].
        gap_m: Room inwards [m].
    """
    vertex = np.flatnonzero(np.maximum(room_m, gap_m) > STILL_M)
    room, gap = room_m[vertex], gap_m[vertex]
    hertz = SLOW_HZ + (FAST_HZ - SLOW_HZ) * np.exp(-room / LOOSE_M)
    links = skin.links[vertex]
    R = Ts_root_link[links][:, :, :3, :3]
    return Cloth(
        vertex,
        links,
        skin.weights[vertex],
        np.ascontiguousarray(np.einsum("nbij,ni->nbj", R, normals[vertex])),
        np.ascontiguousarray(-R[:, :, 2]),
        room,
        gap,
        2.0 * np.pi * hertz,
    )


def hang(cloth: Cloth, Ts_world_link: ndarray, carried: Float[ndarray, "n 3"]) -> Swing:
    """Cloth at rest on a body that does not move."""
    swing = Swing(carried.copy(), np.zeros_like(carried), carried.copy())
    _advance(
        swing.places, swing.velocities, swing.carried, carried, cloth.omega, cloth.room_m,
        cloth.gap_m, cloth.links, cloth.weights, cloth.normals_link, cloth.downs_link,
        Ts_world_link, REST_S,
    )  # fmt: skip
    swing.velocities[:] = 0.0
    return swing


def swing_on(
    swing: Swing, cloth: Cloth, Ts_world_link: ndarray, carried: Float[ndarray, "n 3"], dt_s: float
) -> None:
    """One frame of swinging.

    Args:
        swing: State of the cloth; changed.
        cloth: Its properties.
        Ts_world_link: Pose of every link.
        carried: Where skinning puts the vertices now [m].
        dt_s: Time since the last frame [s].
    """
    _advance(
        swing.places, swing.velocities, swing.carried, carried, cloth.omega, cloth.room_m,
        cloth.gap_m, cloth.links, cloth.weights, cloth.normals_link, cloth.downs_link,
        Ts_world_link, dt_s,
    )  # fmt: skip
    swing.carried[:] = carried


@njit(cache=True)
def _advance(p, v, before, now, omega, room, gap, links, weights, normals, downs, Ts, h):
    n, d, u = np.empty(3), np.empty(3), np.empty(3)
    for i in range(p.shape[0]):
        w = omega[i]
        n[:], d[:] = 0.0, 0.0
        d[2] = -1.0
        for m in range(4):
            share = weights[i, m]
            if share == 0.0:
                continue
            T, x, y = Ts[links[i, m]], normals[i, m], downs[i, m]
            for k in range(3):
                n[k] += share * (T[k, 0] * x[0] + T[k, 1] * x[1] + T[k, 2] * x[2])
                d[k] -= share * (T[k, 0] * y[0] + T[k, 1] * y[1] + T[k, 2] * y[2])
        length = max(np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1e-9)
        along = 0.0
        for k in range(3):
            n[k] /= length
            along += d[k] * n[k]
        sink = (gap[i] if along < 0.0 else HANG * room[i]) * along
        for k in range(3):
            d[k] = HANG * room[i] * (d[k] - along * n[k])
        a, b = h * w * w, 2.0 * h * DAMPING * w
        for k in range(3):
            carried = (now[i, k] - before[i, k]) / h
            pull = now[i, k] + d[k] + sink * n[k] - p[i, k]
            v[i, k] = (v[i, k] + a * pull + b * carried) / (1.0 + a * h + b)
            u[k] = p[i, k] + h * v[i, k] - now[i, k]
        depth = u[0] * n[0] + u[1] * n[1] + u[2] * n[2]
        kept = min(max(depth, -gap[i]), room[i])
        slide = 0.0
        for k in range(3):
            u[k] -= depth * n[k]
            slide += u[k] * u[k]
        short = min(1.0, room[i] / max(np.sqrt(slide), 1e-12))
        speed = v[i, 0] * n[0] + v[i, 1] * n[1] + v[i, 2] * n[2]
        speed -= ((now[i, 0] - before[i, 0]) * n[0] + (now[i, 1] - before[i, 1]) * n[1]
                  + (now[i, 2] - before[i, 2]) * n[2]) / h  # fmt: skip
        stopped = speed if (kept - depth) * speed < 0.0 else 0.0
        for k in range(3):
            v[i, k] -= stopped * n[k]
            p[i, k] = now[i, k] + short * u[k] + kept * n[k]
        p[i, 2] = max(p[i, 2], min(now[i, 2], FLOOR_M))

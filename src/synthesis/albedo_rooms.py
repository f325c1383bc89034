# SPDX-License-Identifier: Apache-2.0
"""Kinds of albedo pattern that rooms are made of: wood, boards, tiles and stone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.albedo import Rgb, mixed
from synthesis.noise import cells, noise, rough


@dataclass(frozen=True)
class Wood:
    """Grain along one axis."""

    light: Rgb
    """Early wood."""
    dark: Rgb
    """Late wood."""
    ring_m: float = 0.012
    """Distance between rings [m]."""
    axis: int = 0
    """Along the grain."""
    seed: int = 0
    """Of the grain."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        stretch = np.ones(3)
        stretch[self.axis] = 0.08
        drawn = coords * stretch
        across = np.delete(drawn, self.axis, axis=1) + np.array([0.13, 0.31])
        radius = np.linalg.norm(across, axis=1) + 0.03 * rough(drawn / 0.12, self.seed)
        ring = (radius / self.ring_m) % 1.0
        fibre = noise(drawn / 0.003, self.seed + 5)
        return mixed(self.light, self.dark, 0.8 * ring**2 + 0.12 * fibre)


@dataclass(frozen=True)
class Planks:
    """Floor boards of wood, each of its own shade, with dark joints."""

    wood: Wood
    """Of the boards; its axis is their length."""
    width_m: float = 0.14
    """Width of a board [m]."""
    length_m: float = 1.6
    """Length of a board [m]."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        along, across = self.wood.axis, 1 - min(self.wood.axis, 1)
        row = np.floor(coords[:, across] / self.width_m)
        shift = cells(np.stack([row, 0 * row, 0 * row], axis=1) + 0.5, self.wood.seed)
        place = coords[:, along] / self.length_m + shift
        board = np.stack([row, np.floor(place), 0 * row], axis=1) + 0.5
        shade = 0.8 + 0.35 * cells(board, self.wood.seed + 1)
        moved = coords + 3.0 * cells(board, self.wood.seed + 2)[:, None]
        u, v = coords[:, across] / self.width_m % 1.0, place % 1.0
        joint = (u < 0.002 / self.width_m) | (v < 0.002 / self.length_m)
        return np.clip(self.wood(moved) * (shade * np.where(joint, 0.35, 1.0))[:, None], 0.0, 1.0)


@dataclass(frozen=True)
class Tiles:
    """Square tiles with joints; each has its own shade. Made in space, for walls and floors."""

    color: Rgb
    """Tiles."""
    joint: Rgb
    """Joints."""
    size_m: float = 0.3
    """Edge of a tile [m]."""
    joint_m: float = 0.004
    """Width of a joint [m]."""
    spread: float = 0.08
    """How much the shades of tiles differ."""
    seed: int = 0
    """Of the shades."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        place = coords / self.size_m + 0.2371
        edge = np.minimum(place % 1.0, 1.0 - place % 1.0).min(axis=1)
        shade = 1.0 + self.spread * (2.0 * cells(place, self.seed) - 1.0)
        shade = shade + 0.04 * rough(coords / 0.06, self.seed)
        tile = np.clip(np.array(self.color) * shade[:, None], 0.0, 1.0)
        return np.where((edge < 0.5 * self.joint_m / self.size_m)[:, None], self.joint, tile)


@dataclass(frozen=True)
class Marble:
    """Stone with veins; with weak veins it is plaster."""

    color: Rgb
    """Stone."""
    vein: Rgb
    """Veins."""
    size_m: float = 0.4
    """Distance between veins [m]."""
    strength: float = 0.7
    """How far the veins take the vein's colour, 0..1."""
    seed: int = 0
    """Of the veins."""

    def __call__(self, coords: Float[ndarray, "n 3"]) -> Float[ndarray, "n 3"]:
        """Colours at the coordinates."""
        place = coords / self.size_m
        warped = place + 0.6 * rough(place, self.seed + 1)[:, None]
        vein = np.exp(-((6.0 * rough(warped, self.seed)) ** 2))
        return mixed(self.color, self.vein, self.strength * vein + 0.05 * noise(coords / 0.02))

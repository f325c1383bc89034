# SPDX-License-Identifier: Apache-2.0
"""Where in a room things may stand: seen from above."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

CLEAR_M = 0.35
"""Free space around where the person moves [m]."""
CAMERA_CLEAR_M = 0.6
"""Free space around the camera [m]."""
BESIDE_SIGHT_M = 0.15
"""How far from the lines of sight a thing counts as off them [m]."""
KNEE_M = 0.45
"""What is above this shall stay in sight [m]."""
GAP_M = 0.03
"""Between two things [m]."""


@dataclass(frozen=True)
class Rect:
    """A rectangle on the floor."""

    middle: Float[ndarray, " 2"]
    """Its middle [m]."""
    size: Float[ndarray, " 2"]
    """Lengths along its own axes [m]."""
    yaw: float = 0.0
    """Its turn [rad]."""

    def axes(self) -> Float[ndarray, "2 2"]:
        """Its own axes, one a row."""
        c, s = np.cos(self.yaw), np.sin(self.yaw)
        return np.array([[c, s], [-s, c]])

    def corners(self) -> Float[ndarray, "4 2"]:
        """Its corners [m]."""
        signs = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) / 2
        return self.middle + (signs * self.size) @ self.axes()

    def distance(self, points: Float[ndarray, "n 2"]) -> Float[ndarray, " n"]:
        """Distance of points from it [m], 0 inside, shape (N,)."""
        beyond = np.abs((points - self.middle) @ self.axes().T) - np.asarray(self.size) / 2
        return np.linalg.norm(np.maximum(beyond, 0.0), axis=1)

    def meets(self, other: Rect, gap: float = GAP_M) -> bool:
        """Whether two rectangles come nearer than a gap along every axis of both [m]."""
        ours, theirs = self.corners(), other.corners()
        for axis in np.concatenate([self.axes(), other.axes()]):
            a, b = ours @ axis, theirs @ axis
            if a.max() + gap < b.min() or b.max() + gap < a.min():
                return False
        return True


@dataclass
class Plan:
    """A room's floor in the room's own frame, x away from the camera, and what stands on it."""

    keep_clear: Float[ndarray, "n 2"]
    """Where the person will be [m]."""
    camera: Float[ndarray, " 3"]
    """Where the camera is [m]."""
    low: Float[ndarray, " 2"]
    """Least x and y of the floor between the walls [m]."""
    high: Float[ndarray, " 2"]
    """Largest x and y [m]."""
    taken: list[Rect] = field(default_factory=list)
    """What stands already."""

    def __post_init__(self) -> None:
        """Draw the lines of sight to the person's knees."""
        way = np.linspace(0.0, 1.0, 40)[:, None, None]
        knees = np.column_stack([self.keep_clear, np.full(len(self.keep_clear), KNEE_M)])
        self.sight = ((1 - way) * self.camera + way * knees).reshape(-1, 3)

    def free(self, rect: Rect, height_m: float) -> bool:
        """Whether a thing of that height may stand there.

        It must be between the walls, off what stands, away from person and camera, and either off
        the lines of sight or below all of them.
        """
        corners = rect.corners()
        if (corners < self.low).any() or (corners > self.high).any():
            return False
        if rect.distance(self.keep_clear).min() < CLEAR_M:
            return False
        if rect.distance(self.camera[None, :2])[0] < CAMERA_CLEAR_M:
            return False
        if any(rect.meets(other) for other in self.taken):
            return False
        return not (self._under_sight(rect) & (self.sight[:, 2] < height_m + 0.02)).any()

    def _under_sight(self, rect: Rect) -> Bool[ndarray, " k"]:
        return rect.distance(self.sight[:, :2]) < BESIDE_SIGHT_M


def thinned(points: Float[ndarray, "n 2"], cell_m: float = 0.05) -> Float[ndarray, "k 2"]:
    """One point for each cell of a grid that holds any [m]."""
    return np.asarray(np.unique(np.round(points / cell_m), axis=0) * cell_m)

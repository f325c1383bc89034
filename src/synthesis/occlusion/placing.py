# SPDX-License-Identifier: Apache-2.0
"""Where a thing must stand to hide a chosen share of the person [Wan19, section on occlusions].

The thing's farthest point lies a chosen distance in front of the person's nearest place, slightly
to the left or right; turn, tilt and place are drawn, and the scale follows from the share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial.transform import Rotation

from kintrack.bounds import check_bounds
from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from kintrack.raster import rasterise
from synthesis.mesh import Mesh
from synthesis.occlusion.silhouette import Silhouette, hidden_share, nearest_m

SIDES = ("left", "right", "any")
ASIDE = (0.05, 0.40)
"""How far beside the person's middle the thing stands, share of her width."""
HEIGHT = (0.30, 0.85)
"""Where the thing's middle is, share of the person's height from the top."""
TILT_DEG = 6.0
"""Standard deviation of roll and pitch [deg]."""
SCALE = (0.25, 2.5)
"""Smallest and largest scale of the thing."""
NEAREST_M = 0.35
"""How near to the camera the thing may come [m]."""
TOLERANCE = 0.03
"""How far the hidden share may lie from the wanted one."""
ATTEMPTS = 40
BISECTIONS = 12


@dataclass(frozen=True)
class PlacingConfig:
    """Where the thing stands."""

    distance_m: float = 0.45
    """From its farthest point to the person's nearest place [m], 0.05 to 2."""
    share: float = 0.33
    """Share of the person that it hides, mean over frames, 0.05 to 0.8."""
    side: str = "any"
    """Image side to which it stands: left, right or any."""

    def __post_init__(self) -> None:
        check_bounds(self, distance_m=(0.05, 2.0), share=(0.05, 0.8))
        if self.side not in SIDES:
            raise SceneError(f"side = {self.side!r}; allowed: {', '.join(SIDES)}")


@dataclass(frozen=True)
class Placing:
    """Where a thing stands."""

    T_camera_thing: Float[ndarray, "4 4"]
    """Pose and scale."""
    scale: float
    """Scale in it."""
    share: float
    """Share of the person that it hides, mean over the given frames."""


def place(
    mesh: Mesh,
    camera: PinholeCamera,
    T_world_camera: Float[ndarray, "4 4"],
    persons: Sequence[Silhouette],
    config: PlacingConfig,
    rng: np.random.Generator,
    name: str = "thing",
) -> Placing:
    """Draw places until one hides the wanted share.

    Args:
        mesh: The thing, own frame, z up.
        camera: Camera of the silhouettes.
        T_world_camera: Its pose; tells what is upright.
        persons: The person in some frames.
        config: What is wanted.
        rng: Draws turn, tilt and place.
        name: The thing's name for errors.

    Returns:
        The first place within `TOLERANCE` of the share.

    Raises:
        SceneError: if nobody is in the image, or no place hides that much.
    """
    far_m = nearest_m(persons) - config.distance_m
    if far_m < NEAREST_M + 0.1:
        raise SceneError(
            f"the person comes as near as {far_m + config.distance_m:.2f} m: no room for a thing "
            f"{config.distance_m} m before her and {NEAREST_M} m from the camera"
        )
    best = 0.0
    for _ in range(ATTEMPTS):
        placing = _attempt(mesh, camera, T_world_camera[:3, :3].T, persons, config, far_m, rng)
        if abs(placing.share - config.share) <= TOLERANCE:
            return placing
        best = max(best, placing.share)
    raise SceneError(
        f"{name} cannot hide {config.share:.2f} of the person at {config.distance_m} m: the most "
        f"in {ATTEMPTS} places was {best:.2f}; ask for less or take another object"
    )


def _attempt(mesh, camera, R_camera_world, persons, config, far_m, rng) -> Placing:
    rows, columns = np.nonzero(np.any([person.mask for person in persons], axis=0))
    side = {"left": -1.0, "right": 1.0, "any": rng.choice([-1.0, 1.0])}[config.side]
    aside, height = side * rng.uniform(*ASIDE), rng.uniform(*HEIGHT)
    width = np.median([np.ptp(np.nonzero(person.mask)[1]) for person in persons])
    pixel = np.array(
        [np.median(columns) + aside * width, rows.min() + height * np.ptp(rows)], dtype=float
    )
    yaw, tilt = rng.uniform(-180.0, 180.0), rng.normal(0.0, TILT_DEG, 2)
    R_world_thing = Rotation.from_euler("xyz", [*tilt, yaw], degrees=True).as_matrix()
    R = R_camera_world @ R_world_thing
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    turned = (mesh.vertices - 0.5 * (low + high)) @ R.T
    largest = min(SCALE[1], (far_m - NEAREST_M) / np.ptp(turned[:, 2]))

    def at(scale: float) -> tuple[float, float, ndarray]:
        z = far_m - scale * turned[:, 2].max()
        centre = np.array(
            [(pixel[0] - camera.cx) / camera.fx * z, (pixel[1] - camera.cy) / camera.fy * z, z]
        )
        depth, _ = rasterise(scale * turned + centre, mesh.faces, camera)
        depth = np.where(np.isfinite(depth), depth, 0.0)
        return scale, float(np.mean([hidden_share(person, depth) for person in persons])), centre

    few, many = SCALE[0], largest
    best = at(many) if many > few else at(few)
    if best[1] > config.share:
        for _ in range(BISECTIONS):
            middle = at(0.5 * (few + many))
            if abs(middle[1] - config.share) < abs(best[1] - config.share):
                best = middle
            few, many = (middle[0], many) if middle[1] < config.share else (few, middle[0])
    scale, share, centre = best
    T = np.eye(4)
    T[:3, :3] = scale * R
    T[:3, 3] = centre - scale * R @ (0.5 * (low + high))
    return Placing(T, scale, share)

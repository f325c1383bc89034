# SPDX-License-Identifier: Apache-2.0
"""The surface of one person from frame to frame.

Two surfaces are read out of one memory. The one that is shown follows what is seen. The one that
the pose is fitted to is held back towards the template: a fold that is taken for certain ties the
pose to the error that it had when the fold was first seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.body import BodyState
from kintrack.deformation.evidence import evidence_of
from kintrack.deformation.memory import remembered
from kintrack.deformation.relief import Relief, relief_of
from kintrack.deformation.smoothing import smoothed
from kintrack.deformation_config import DeformationConfig
from kintrack.geometry import transform_points
from kintrack.human import Human
from kintrack.skin import Skin, skinned_vertices

FIRST_S, LONGEST_S = 1.0 / 30.0, 0.2
"""For how long the first frame stands, and any other at most [s]."""


@dataclass(frozen=True)
class Surface:
    """The skin of a person with what was learnt about its offsets."""

    relief: Relief
    """Skin and directions."""
    offsets_m: Float[ndarray, " v"]
    """Offset of every vertex along its normal [m]."""
    pose_offsets_m: Float[ndarray, " v"]
    """The same in the surface that the pose is fitted to [m]."""
    pose_skin: Skin
    """The skin with `pose_offsets_m`."""
    H: Float[ndarray, "f 6"]
    """What was seen, matrices (`kintrack.deformation.memory`)."""
    g: Float[ndarray, "f 3"]
    """What was seen, right-hand sides [m]."""
    learnt_s: float = 0.0
    """For how long something was learnt [s]."""
    timestamp_s: float = math.nan
    """The last frame [s]."""

    def shown(self, human: Human) -> Human:
        """The human in the surface that is shown."""
        return replace(human, skin=self.relief.raised(self.offsets_m))

    def fitted(self, human: Human) -> Human:
        """The human in the surface that the pose is fitted to."""
        return replace(human, skin=self.pose_skin)

    def forgotten(self) -> Surface:
        """The same skin, of which nothing was seen yet."""
        return _plain(self.relief)


def met(surface: Surface | None, human: Human, config: DeformationConfig) -> Surface | None:
    """The surface of somebody who was just found.

    Args:
        surface: The last one.
        human: Who was found; in the last surface if it is the same person.
        config: Whether there is a surface, and whether it is forgotten.
    """
    if not config.enabled:
        return None
    if surface is not None and human.skin is surface.pose_skin:
        return surface.forgotten() if config.reset_when_lost else surface
    return _plain(relief_of(human.body, human.skin))


def _plain(relief: Relief) -> Surface:
    v, f = len(relief.skin.labels), len(relief.skin.faces)
    return Surface(
        relief, np.zeros(v), np.zeros(v), relief.skin, np.zeros((f, 6)), np.zeros((f, 3))
    )


def followed(
    surface: Surface,
    state: BodyState,
    observation: Observation,
    T_camera_world: Float[ndarray, "4 4"],
    timestamp_s: float,
    config: DeformationConfig,
) -> Surface:
    """The surface after one more frame.

    Args:
        surface: The surface before.
        state: The fitted pose.
        observation: What was observed.
        T_camera_world: Inverse of the camera pose.
        timestamp_s: When [s].
        config: All weights.

    Returns:
        The new surface; the same once it is frozen.
    """
    if surface.learnt_s >= config.freeze_after_s:
        return surface
    relief, skin = surface.relief, surface.relief.skin
    vertices = skinned_vertices(state, relief.raised(surface.offsets_m))
    evidence = evidence_of(
        skin,
        transform_points(T_camera_world, vertices),
        relief.directions_world(state) @ T_camera_world[:3, :3].T,
        observation,
        config,
    )
    passed_s = timestamp_s - surface.timestamp_s
    passed_s = min(max(passed_s, 0.0), LONGEST_S) if math.isfinite(passed_s) else FIRST_S
    kept = math.exp(-passed_s / config.memory_s)
    H, g = remembered(surface.H, surface.g, evidence, skin.faces, surface.offsets_m, kept)

    def settled(offsets_m: ndarray, smooth: float, hold: float) -> ndarray:
        offsets_m = smoothed(offsets_m, H, g, skin.faces, smooth, hold, config.iterations)
        return np.clip(offsets_m, -config.inward_m, config.outward_m)

    pose_offsets_m = settled(surface.pose_offsets_m, config.pose_smooth, config.pose_hold)
    return Surface(
        relief,
        settled(surface.offsets_m, config.smooth, config.hold),
        pose_offsets_m,
        relief.raised(pose_offsets_m),
        H,
        g,
        surface.learnt_s + passed_s,
        timestamp_s,
    )

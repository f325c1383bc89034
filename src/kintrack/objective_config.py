# SPDX-License-Identifier: Apache-2.0
"""Every number of what a pose minimises, with its unit: data term, pulls, prior, motion."""

from __future__ import annotations

from dataclasses import dataclass

from kintrack.bounds import check_bounds


@dataclass(frozen=True)
class SurfaceConfig:
    """The data term."""

    point_weight: float = 0.2
    """Weight of point-to-point against point-to-plane."""
    scale_floor_m: float = 0.008
    """Least robust scale of the residuals [m]."""
    scale_ceiling_m: float = 0.03
    """Largest robust scale of the residuals [m]."""
    silhouette_weight: float = 3.0
    """Weight of skin outside the silhouette against a surface pair."""
    correlation: float = 8.0
    """How many neighbouring pairs carry the information of one independent pair."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            point_weight=(0.0, 10.0),
            scale_floor_m=(1e-4, 0.1),
            scale_ceiling_m=(1e-3, 1.0),
            silhouette_weight=(0.0, 100.0),
            correlation=(1.0, 1e4),
        )


@dataclass(frozen=True)
class PullConfig:
    """How rough places of the parts pull while tracking."""

    sigma_m: float = 0.1
    """Standard deviation of a joint about its part's place, beyond the free distance [m]."""
    free_m: float = 0.18
    """A joint this near to its part's place is not pulled [m]."""

    def __post_init__(self) -> None:
        check_bounds(self, sigma_m=(1e-3, 1e6), free_m=(0.0, 10.0))


@dataclass(frozen=True)
class PriorConfig:
    """What is known before a frame is seen."""

    limb_rad: float = 0.4
    """Standard deviation of arm and leg hinges about the resting pose [rad]."""
    trunk_rad: float = 0.15
    """Standard deviation of spine, neck, head and clavicle hinges about zero [rad]."""
    twist_rad: float = 0.5
    """Standard deviation of forearm, wrist and ankle hinges about zero [rad]."""
    floor_rad: float = 0.1
    """Standard deviation of every hinge of a leg, besides that of the posture it takes [rad]."""
    unseen_s: float = 2.0
    """Time in which a limb that is not found, though nothing hides it, relaxes towards rest [s]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            floor_rad=(0.001, 10),
            limb_rad=(0.01, 10),
            trunk_rad=(0.01, 10),
            twist_rad=(0.01, 10),
            unseen_s=(0.01, 1e4),
        )


@dataclass(frozen=True)
class MotionConfig:
    """Constant-velocity prediction."""

    root_m_s: float = 1.5
    """Standard deviation of the root's unpredicted speed [m/s]."""
    root_rad_s: float = 3.0
    """Standard deviation of the root's unpredicted angular speed [rad/s]."""
    limb_rad_s: float = 8.0
    """Standard deviation of unpredicted hinge speed in arms and legs [rad/s]."""
    trunk_rad_s: float = 2.5
    """Standard deviation of unpredicted hinge speed in trunk, neck and clavicles [rad/s]."""
    damping: float = 0.7
    """Share of the last velocity that is carried on."""
    hidden_s: float = 1.0
    """Time in which a hidden limb may have gone anywhere [s]."""
    habit_s: float = 1.0
    """Time over which the posture is averaged to which a hidden limb returns [s]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            root_m_s=(1e-3, 100),
            root_rad_s=(1e-3, 100),
            limb_rad_s=(1e-3, 200),
            trunk_rad_s=(1e-3, 200),
            damping=(0, 1),
            hidden_s=(1e-3, 1e4),
            habit_s=(1e-3, 1e4),
        )

# SPDX-License-Identifier: Apache-2.0
"""Every number of the floor and of the feet on it, with its unit."""

from __future__ import annotations

from dataclasses import dataclass

from kintrack.bounds import check_bounds


@dataclass(frozen=True)
class ContactConfig:
    """How the floor holds a sole."""

    below_m: float = 0.02
    """Standard deviation of a sole below the floor [m]."""
    above_m: float = 0.06
    """And of one that stands, above it, where it may step [m]."""
    far_m: float = 0.12
    """A sole further off is drawn no harder than at this distance [m]."""

    def __post_init__(self) -> None:
        check_bounds(self, below_m=(1e-3, 1e6), above_m=(1e-3, 1e6), far_m=(1e-3, 10.0))


@dataclass(frozen=True)
class FloorConfig:
    """Where the floor is; only in labelled rooms."""

    every_s: float = 0.5
    """Time between looks at the floor [s]."""
    kept_s: float = 3.0
    """A floor that is not found again is forgotten after this time [s]."""
    tilt_deg: float = 25.0
    """How far the camera's pitch and roll may differ from what is stated [deg]."""
    stands_m: float = 0.15
    """The lower foot must be this near to a plane for it to be the floor [m]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            every_s=(0.0, 1e4),
            kept_s=(0.0, 1e6),
            tilt_deg=(0.0, 60.0),
            stands_m=(0.0, 10.0),
        )

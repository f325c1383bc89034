# SPDX-License-Identifier: Apache-2.0
"""Every number of the deformable surface, with its unit."""

from __future__ import annotations

from dataclasses import dataclass

from kintrack.bounds import check_bounds
from kintrack.errors import ConfigError

BOUNDS: dict[str, tuple[float, float]] = {
    "freeze_after_s": (0.0, 1e8),
    "memory_s": (0.01, 1e4),
    "smooth": (0.0, 1e3),
    "hold": (1e-3, 1e3),
    "pose_smooth": (0.0, 1e3),
    "pose_hold": (1e-3, 1e3),
    "gate_m": (0.005, 0.2),
    "scale_floor_m": (1e-4, 0.1),
    "scale_ceiling_m": (1e-3, 0.1),
    "beyond_px": (0, 20),
    "inward_m": (0.0, 0.1),
    "outward_m": (0.0, 0.2),
    "iterations": (1, 500),
}
"""What is allowed."""


@dataclass(frozen=True)
class DeformationConfig:
    """How the skin follows clothes and folds."""

    enabled: bool = False
    """Let the skin follow the observed surface."""
    freeze_after_s: float = 1e8
    """After learning for so long the surface stays as it is; 0 for never learning [s]."""
    reset_when_lost: bool = False
    """Forget the surface when the person is lost; otherwise whoever is found is taken for her."""
    memory_s: float = 2.0
    """Time over which what a triangle was seen to do is averaged; it only passes while the
    triangle is seen [s]."""
    smooth: float = 0.03
    """Weight of the squared difference of two neighbours against one pixel's squared residual."""
    hold: float = 0.05
    """Weight of a vertex's squared offset against one pixel's squared residual."""
    pose_smooth: float = 0.1
    """As `smooth`, in the surface that the pose is fitted to."""
    pose_hold: float = 3.0
    """As `hold`, in the surface that the pose is fitted to."""
    gate_m: float = 0.04
    """A pixel further from the surface along its normal says nothing [m]."""
    scale_floor_m: float = 0.006
    """Least robust scale of the residuals [m]."""
    scale_ceiling_m: float = 0.012
    """Largest robust scale of the residuals [m]."""
    beyond_px: int = 3
    """A pixel so near beside the skin's outline still counts, as seen beside its rim [px]."""
    inward_m: float = 0.03
    """Most that the surface goes in: flesh under a tight hem, and errors of the shape [m]."""
    outward_m: float = 0.06
    """Most that it comes out: loose clothes over the mean thickness; what hangs further off is
    another surface than the skin's [m]."""
    iterations: int = 15
    """Steps of conjugate gradients a frame and surface."""

    def __post_init__(self) -> None:
        for name in ("enabled", "reset_when_lost"):
            if not isinstance(getattr(self, name), bool):
                raise ConfigError(
                    f"DeformationConfig.{name} = {getattr(self, name)!r}: True or False is needed"
                )
        check_bounds(self, **BOUNDS)

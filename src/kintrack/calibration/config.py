# SPDX-License-Identifier: Apache-2.0
"""Every number of getting to know a person; the command line is derived from these classes."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

from kintrack.bounds import check_bounds
from kintrack.calibration.errors import CalibrationError
from kintrack.config import TrackerConfig
from kintrack.floor_config import ContactConfig

BodyKind = Literal["template", "calibrated", "deformable"]
"""template: the average adult in average clothes, stature and build sized at the start; calibrated:
the person's own body and clothes; deformable: the same, and the skin follows cloth and folds."""


@dataclass(frozen=True)
class BundleConfig:
    """How a shape is fitted."""

    rounds: int = 24
    """Associations at most."""
    first_gate_m: float = 0.15
    """Largest distance between a point and its vertex in the first round [m]."""
    last_gate_m: float = 0.08
    """The same in the last round [m]."""
    point_weight: float = 0.01
    """Weight of point-to-point against point-to-plane: little, for it holds lengths back."""
    silhouette_weight: float = 0.5
    """Weight of skin outside the silhouette against a surface pair; a sensor that loses rims makes
    people small where this is large."""
    noise_m: float = 0.005
    """Standard deviation of depth and association, folds left out [m]."""
    outside: float = 1.5
    """How much wider residuals may be where the surface lies outside the skin than within."""
    pixel_pairs: int = 2000
    """About how many observed pixels look for their vertex. They outnumber the vertices that look
    for a pixel, which find none beyond the end of what was seen and make the person small."""
    correlation: float = 48.0
    """How many pairs carry the information of one independent pair; folds stay from frame to frame,
    so more than while tracking."""
    inflation: float = 7.0
    """Variance over what the pairs say where residuals are the usual ones: clothes are not as even
    as they are modelled, and the same in every frame."""
    usual_rms_m: float = 0.008
    """Residual of people whose clothes fit the model; beyond it the variance grows with the fourth
    power [m]. Both are set so that training people scatter as stated (`docs/shape.md`)."""
    damping: float = 1e-3
    """Levenberg damping, relative to the diagonal."""
    tolerance: float = 0.01
    """Stop when no coefficient moves by more of its standard deviation."""
    contact: ContactConfig = field(default_factory=lambda: ContactConfig(0.015, 0.02))
    """How the lower foot stands on the floor, where there is one."""


@dataclass(frozen=True)
class CalibrationConfig:
    """How a person is calibrated."""

    frames: int = 12
    """Frames used at most."""
    pool: int = 36
    """Frames kept to choose from while a recording passes."""
    shape_sigma: float = 1.2
    """Standard deviation of each coefficient between people; 1 is the population's own."""
    shape_limit: float = 4.0
    """Largest coefficient."""
    stated_sigma_m: float = 0.01
    """How well a stated height is known [m]."""
    bundle: BundleConfig = field(default_factory=BundleConfig)
    """The fit."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            frames=(1, 100),
            pool=(1, 1000),
            shape_sigma=(0.1, 10),
            shape_limit=(0.5, 5),
            stated_sigma_m=(1e-3, 0.2),
        )
        if self.pool < self.frames:
            raise CalibrationError(f"pool = {self.pool}: at least frames = {self.frames} is needed")


@dataclass(frozen=True)
class MeetingConfig:
    """When a person is asked who she is."""

    first_s: float = 1.0
    """Time tracked before the first attempt [s]."""
    growth: float = 2.0
    """After an attempt in doubt, the next comes once so many times as long was tracked."""
    attempts: int = 5
    """Attempts at most."""
    calibration: CalibrationConfig = field(default_factory=CalibrationConfig)
    """How she is calibrated."""

    def __post_init__(self) -> None:
        check_bounds(self, first_s=(0.1, 600), growth=(1.1, 10), attempts=(1, 100))


@dataclass(frozen=True)
class BodyConfig:
    """Which body is tracked with."""

    kind: BodyKind = "calibrated"
    """See `BodyKind`."""
    height_m: float | None = None
    """The person's height without shoes, if it is known [m]."""
    meeting: MeetingConfig = field(default_factory=MeetingConfig)
    """How she is calibrated on the way."""

    def applied(self, config: TrackerConfig) -> TrackerConfig:
        """The tracker's configuration for this kind of body."""
        if self.kind != "deformable":
            return config
        return replace(config, deformation=replace(config.deformation, enabled=True))

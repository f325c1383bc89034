# SPDX-License-Identifier: Apache-2.0
"""Every number of the tracker, with its unit; the command line is derived from these classes."""

from __future__ import annotations

from dataclasses import dataclass, field

from kintrack.bounds import check_bounds
from kintrack.deformation_config import DeformationConfig
from kintrack.errors import ConfigError
from kintrack.floor_config import ContactConfig, FloorConfig
from kintrack.objective_config import (
    MotionConfig,
    PriorConfig,
    PullConfig,
    SurfaceConfig,
)
from kintrack.rival_config import RivalConfig


@dataclass(frozen=True)
class AssociationConfig:
    """How observed points and skin vertices find each other."""

    max_width_px: int = 320
    """Wider depth images are thinned to at most this width before anything else [px]."""
    gate_m: float = 0.05
    """Largest distance between a vertex and the point it takes [m]."""
    first_gate_m: float = 0.4
    """Largest distance between a point and the vertex it takes in a frame's first round [m]."""
    last_gate_m: float = 0.10
    """The same in the last round [m]."""
    silhouette_tolerance_m: float = 0.015
    """How far outside the silhouette a vertex may project [m]."""
    silhouette_gate_m: float = 0.4
    """Vertices further outside than this are left alone [m]."""
    start_gate_m: float = 0.35
    """Largest distance in the first rounds of a start [m]."""
    facing: float = 0.15
    """Least cosine between a vertex normal and the ray to the camera."""
    self_occlusion_m: float = 0.03
    """A vertex further than this behind the body's own depth buffer is hidden [m]."""
    pixel_pairs: int = 700
    """About how many observed pixels look for their vertex."""
    background_share: float = 0.1
    """With readings that no label calls hers on fewer of the pixels than this, the background was
    taken out and an empty pixel is free space; with more, it is the sensor's failure and says
    nothing."""
    region_margin_m: float = 0.35
    """Observed points further than this from the predicted body's box are ignored [m]."""
    part_m: float = 0.08
    """Skin pairs with a pixel of another part as if that were further away by this, squares added;
    never with background. 10 for the hard gate of the paper [m]."""
    doubt_m: float = 0.06
    """A pixel of which a network is not sure takes the second label if the skin of that is expected
    this near to it; 0 for never [m]."""
    side_m: float = 0.08
    """A limb's pixel goes to the other side's limb if that is nearer by about this [m]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            max_width_px=(64, 4096),
            gate_m=(0.01, 1.0),
            first_gate_m=(0.01, 2.0),
            last_gate_m=(0.01, 2.0),
            silhouette_tolerance_m=(0.0, 1.0),
            silhouette_gate_m=(0.0, 5.0),
            start_gate_m=(0.01, 2.0),
            facing=(0.0, 1.0),
            self_occlusion_m=(0.0, 1.0),
            pixel_pairs=(0, 20_000),
            background_share=(0.0, 1.0),
            region_margin_m=(0.05, 5.0),
            part_m=(0.0, 10.0),
            doubt_m=(0.0, 1.0),
            side_m=(0.0, 10.0),
        )


@dataclass(frozen=True)
class OcclusionConfig:
    """What counts as hidden by something else; only where the image is labelled."""

    nearer_m: float = 0.04
    """A reading so much nearer than the skin hides it [m]."""
    behind_m: float = 0.05
    """A reading so much further away than the skin says that the skin is not there [m]."""
    open_share: float = 0.08
    """A hinge is hidden if less than this share of the skin that it moves is open to the camera."""

    def __post_init__(self) -> None:
        check_bounds(self, nearer_m=(0.0, 1.0), behind_m=(0.0, 1.0), open_share=(0.0, 1.0))


@dataclass(frozen=True)
class ConfidenceConfig:
    """What the solver's own covariance does not know; calibrated on training recordings."""

    shared_m: float = 0.035
    """Standard deviation of the error that all pairs of a link share: clothes, template [m]."""
    floor_m: float = 0.025
    """Standard deviation of a joint centre within a body that fits perfectly [m]."""
    unseen: float = 2.0
    """How many times as far off a joint is of which nothing is seen."""

    def __post_init__(self) -> None:
        check_bounds(self, shared_m=(0.0, 1.0), floor_m=(0.0, 1.0), unseen=(1.0, 100.0))


SOLVER_METHODS = ("gauss-newton", "ipopt")
"""What can solve for a pose."""


@dataclass(frozen=True)
class SolverConfig:
    """How a pose is found once pixels and skin are paired."""

    method: str = "gauss-newton"
    """gauss-newton, damped and fast, or ipopt, an interior point with hard joint limits."""
    rounds: int = 5
    """Associations per frame at most."""
    steps: int = 1
    """Accepted steps per association at most."""
    damping: float = 1e-3
    """First Levenberg damping, relative to the diagonal."""
    tolerance_m: float = 0.001
    """Stop when no reported joint moves further than this in a round [m]."""

    def __post_init__(self) -> None:
        check_bounds(self, rounds=(1, 100), steps=(1, 100), damping=(0, 1e6), tolerance_m=(0, 1))
        if self.method not in SOLVER_METHODS:
            raise ConfigError(
                f"SolverConfig.method = {self.method!r}: {', '.join(SOLVER_METHODS)} are possible"
            )


@dataclass(frozen=True)
class StartConfig:
    """The first start: one roughly upright person, no clutter."""

    min_height_m: float = 0.7
    """Smallest blob that can be a person [m]."""
    max_height_m: float = 2.3
    """Tallest blob that can be a person [m]."""
    max_distance_m: float = 6.0
    """Blobs further away are ignored [m]."""
    rounds: int = 14
    """Associations per guess."""
    shape_coefficients: int = 3
    """Leading shape coefficients (stature, build, sex) sized at the start; 0 for none."""
    shape_limit: float = 2.5
    """Largest shape coefficient [standard deviations]."""
    retry_s: float = 0.5
    """After a person-sized blob could not be fitted, the next attempt comes this much later [s]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            min_height_m=(0.2, 2.5),
            max_height_m=(0.3, 4.0),
            max_distance_m=(0.3, 30.0),
            rounds=(1, 200),
            shape_coefficients=(0, 10),
            shape_limit=(0, 5),
            retry_s=(0, 60),
        )
        if self.min_height_m >= self.max_height_m:
            raise ConfigError(
                f"StartConfig.min_height_m = {self.min_height_m!r}: must be below "
                f"max_height_m = {self.max_height_m!r}"
            )


@dataclass(frozen=True)
class JudgeConfig:
    """When a fit counts as tracking."""

    max_rms_m: float = 0.03
    """Largest residual of a frame that is tracking [m]."""
    min_explained: float = 0.75
    """Least share of the observed region within `explained_m` of the skin."""
    min_supported: float = 0.45
    """Least share of the facing skin with an observed point within `explained_m`."""
    start_explained: float = 0.9
    """Least share of the person's blob within `explained_m` of the skin at a start."""
    explained_m: float = 0.06
    """Distance at which a point explains the skin and the reverse [m]."""
    patience: int = 3
    """Bad frames in a row before the track is lost."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            max_rms_m=(1e-3, 1),
            min_explained=(0, 1),
            min_supported=(0, 1),
            start_explained=(0, 1),
            explained_m=(1e-3, 1),
            patience=(1, 1000),
        )


@dataclass(frozen=True)
class TrackerConfig:
    """The whole tracker."""

    association: AssociationConfig = field(default_factory=AssociationConfig)
    """Pairs of points and vertices."""
    surface: SurfaceConfig = field(default_factory=SurfaceConfig)
    """Data term."""
    occlusion: OcclusionConfig = field(default_factory=OcclusionConfig)
    """Hidden limbs."""
    confidence: ConfidenceConfig = field(default_factory=ConfidenceConfig)
    """Covariances."""
    pull: PullConfig = field(default_factory=PullConfig)
    """Places of the parts."""
    floor: FloorConfig = field(default_factory=FloorConfig)
    """The floor."""
    contact: ContactConfig = field(default_factory=ContactConfig)
    """Feet on it: those that are not seen stand there, others are above."""
    prior: PriorConfig = field(default_factory=PriorConfig)
    """Pose prior."""
    motion: MotionConfig = field(default_factory=MotionConfig)
    """Prediction."""
    solver: SolverConfig = field(default_factory=SolverConfig)
    """Gauss-Newton."""
    start: StartConfig = field(default_factory=StartConfig)
    """First start."""
    judge: JudgeConfig = field(default_factory=JudgeConfig)
    """Status."""
    deformation: DeformationConfig = field(default_factory=DeformationConfig)
    """Surface of the clothes."""
    rival: RivalConfig = field(default_factory=RivalConfig)
    """Back or front."""

# SPDX-License-Identifier: Apache-2.0
"""Every number of what labels decide: who is a person, who is who, when tracking begins."""

from __future__ import annotations

from dataclasses import dataclass, field

from kintrack.bounds import check_bounds


@dataclass(frozen=True)
class Limits:
    """What a frame must satisfy; labels count only where there are some."""

    max_rms_m: float
    """Largest surface residual [m]."""
    min_explained: float
    """Least share of the person's points near the skin."""
    min_supported: float
    """Least share of the skin that should be seen and has a point near it."""
    min_labels: float
    """Least share of skin seen on the person whose label is the pixel's."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            max_rms_m=(1e-3, 1),
            min_explained=(0, 1),
            min_supported=(0, 1),
            min_labels=(0, 1),
        )


@dataclass(frozen=True)
class LifecycleConfig:
    """When tracking begins and ends."""

    begin: Limits = field(default_factory=lambda: Limits(0.025, 0.6, 0.45, 0.5))
    """What a first pose must satisfy."""
    stay: Limits = field(default_factory=lambda: Limits(0.03, 0.5, 0.25, 0.35))
    """What every further frame must satisfy."""
    patience: int = 6
    """Bad frames in a row that end a track."""
    young: int = 10
    """A track with fewer good frames than this is young."""
    young_patience: int = 3
    """Bad frames in a row that end a young track."""
    retry: int = 2
    """After a first pose was rejected, so many frames pass before the next is tried."""
    keen: int = 4
    """So many first poses are tried at this pace; then the frames between double every time."""
    most_retry: int = 16
    """At most so many frames pass, for what looks like a person and is none."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            patience=(1, 1000),
            young=(0, 1000),
            young_patience=(1, 1000),
            retry=(0, 1000),
            keen=(1, 1000),
            most_retry=(0, 1000),
        )

    def retry_after(self, rejected: int) -> int:
        """Frames to pass after so many first poses were rejected in a row."""
        doubled = self.retry * 2 ** min(max(rejected - self.keen, 0), 10)
        return min(doubled, max(self.most_retry, self.retry))


@dataclass(frozen=True)
class PeopleConfig:
    """What parts people and what joins them."""

    edge_m: float = 0.12
    """Depth step between neighbouring pixels that parts two pieces [m]."""
    link_m: float = 0.2
    """Pieces this near to each other are one person [m]."""
    aside_m: float = 0.35
    """Pieces above each other may be one person if no further aside than this [m]."""
    above_m: float = 0.9
    """And if the gap between them is no higher than this [m]."""
    least_piece_m2: float = 0.002
    """Smaller pieces are ignored [m^2]."""
    least_core: float = 0.12
    """Pieces of which a smaller share has labelled neighbours at its own depth are ignored."""
    least_person_m2: float = 0.04
    """People who show less are ignored [m^2]."""
    head_m2: float = 0.008
    """A piece that shows this much head has one [m^2]."""
    torso_m2: float = 0.05
    """A piece that shows this much trunk has one [m^2]."""
    heads_m: float = 0.35
    """Heads further apart than this are two [m]."""
    torsos_m: float = 0.6
    """Trunks whose middles are further apart than this are two [m]."""
    max_distance_m: float = 8.0
    """Pixels further away are ignored [m]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            edge_m=(0.01, 1),
            link_m=(0.01, 2),
            aside_m=(0, 2),
            above_m=(0, 2),
            least_piece_m2=(0, 1),
            least_core=(0, 1),
            least_person_m2=(0, 1),
            head_m2=(1e-4, 1),
            torso_m2=(1e-4, 1),
            heads_m=(0, 2),
            torsos_m=(0, 2),
            max_distance_m=(0.3, 30),
        )


@dataclass(frozen=True)
class WhereaboutsConfig:
    """How far people get while nobody sees them."""

    reach_m: float = 0.6
    """A place is known this well [m]."""
    walk_m_s: float = 1.2
    """How fast somebody who is not seen may move away from where he is expected [m/s]."""
    other_m_s: float = 2.0
    """The same for the others, who are seen more often [m/s]."""
    carry_s: float = 0.5
    """How long a speed is carried on [s]."""
    hold_s: float = 4.0
    """So long after a loss nobody who may be somebody else is taken [s]."""
    forget_s: float = 8.0
    """Others not seen for this long are forgotten [s]."""
    known_frames: int = 5
    """Whoever was seen in fewer frames is not known to be somebody else."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            reach_m=(0.05, 10),
            walk_m_s=(0, 20),
            other_m_s=(0, 20),
            carry_s=(0, 10),
            hold_s=(0, 1e4),
            forget_s=(0, 1e4),
            known_frames=(1, 1000),
        )


@dataclass(frozen=True)
class LabelledStartConfig:
    """A start from labels."""

    people: PeopleConfig = field(default_factory=PeopleConfig)
    """What parts people."""
    headings: int = 12
    """Headings tried, evenly over the circle."""
    fitted: int = 12
    """The best so many guesses are fitted: whoever is seen from the side may have the last one."""
    gate_m: float = 0.25
    """Largest distance in the first rounds of a fit [m]."""
    rounds: int = 5
    """Associations of each fit."""
    last_rounds: int = 6
    """Further associations of the best fit."""
    pitch_rad: float = 0.5
    """How far the pelvis may lean forward from where a guess has it [rad]."""
    roll_rad: float = 0.2
    """How far it may lean aside [rad]."""
    side_m: float = 0.06
    """How far a label's left or right is believed against the geometry [m]."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            headings=(4, 72),
            fitted=(1, 100),
            gate_m=(0.02, 2),
            rounds=(1, 100),
            last_rounds=(1, 100),
            pitch_rad=(0.01, 10),
            roll_rad=(0.01, 10),
            side_m=(0, 10),
        )


@dataclass(frozen=True)
class LabelledConfig:
    """What only a labelled image can be asked."""

    lifecycle: LifecycleConfig = field(default_factory=LifecycleConfig)
    """When tracking begins and ends."""
    start: LabelledStartConfig = field(default_factory=LabelledStartConfig)
    """Starts and who is a person."""
    whereabouts: WhereaboutsConfig = field(default_factory=WhereaboutsConfig)
    """Who is who."""

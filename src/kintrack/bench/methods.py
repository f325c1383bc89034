# SPDX-License-Identifier: Apache-2.0
"""What the bench compares: every way to get joints from a recording."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bench.cases import ALONE, CLEAN, GAPS, REAL, ROOM, SCENES, Case
from kintrack.bench.rgb import regress
from kintrack.calibration.config import BodyConfig
from kintrack.config import AssociationConfig, TrackerConfig
from kintrack.errors import ConfigError
from kintrack.fit import fit_sequence
from kintrack.geometry import camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.objective_config import PullConfig
from kintrack.segmenter import Segmenter
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.sequence.reference import REFERENCE_FILE, read_reference_joints
from segmentation.runtime import RuntimeConfig, load_segmenter
from segmentation.tracking import ImageSegmenter, TrueSegmenter

BEFORE_S = 1.0 / 30.0
"""How long before the recording a tracker that starts warm is started [s]."""
GEOMETRY, TRUE_LABELS, RGB, NETWORK = "geometry", "true_labels", "rgb", "network"
COLD, NO_TARGETS, CALIBRATED = "_cold", "_no_targets", "_calibrated"
HARD = "_hard_gates"
OFF = PullConfig(sigma_m=1e6)
"""A pull of no weight."""
HARD_GATES = AssociationConfig(part_m=10.0, doubt_m=0.0)
"""A vertex pairs with pixels of its own label alone, and the network's doubt is not asked."""
HARDEST = "30 cm"
"""Where rivals that start cold are compared."""


@dataclass(frozen=True)
class Method:
    """A way to get joints."""

    name: str
    """What it is called in the tables."""
    kind: str
    """`GEOMETRY`, `TRUE_LABELS`, `RGB` or `NETWORK`."""
    weights: Path | None = None
    """Of the network."""
    cold: bool = False
    """Whether it has to start by itself; the others are told the true joints of the clean first
    frame."""
    main: bool = False
    """Whether it is what this project does: the first network."""
    targets: bool = True
    """Whether rough places of the parts pull while tracking."""
    soft: bool = True
    """Whether a vertex may pair with pixels of other labels at a price, and doubtful pixels go to
    the second label; else gates are as hard as in [Wan19]."""
    calibrated: bool = False
    """Whether it gets to know the person, as `kintrack fit` does; the others track the average
    adult in the size of the first frame."""

    def runs_on(self, case: Case) -> bool:
        """Whether the bench asks it about a recording."""
        if not self.targets:
            warm = not self.cold and case.condition in (CLEAN, *GAPS)
            return case.group == ROOM and (warm or case.condition == HARDEST)
        if not self.soft:
            return case.group == ROOM and case.condition in (CLEAN, HARDEST)
        if self.calibrated:
            warm = case.group == ROOM and case.condition not in GAPS and not self.cold
            return warm or case.group == SCENES and self.cold and self.main
        if case.group == SCENES:
            return self.cold and self.kind != TRUE_LABELS
        if case.group == ALONE:
            return self.kind == GEOMETRY and not self.cold or self.main and not self.cold
        if case.group == REAL:
            # the geometric fit of the clean recording is what the others are compared with
            return not self.cold and (
                self.main and case.condition != CLEAN or self.kind == GEOMETRY
            )
        if case.condition in GAPS:
            return not self.cold and (self.main or self.kind == TRUE_LABELS)
        return not self.cold or self.main or case.condition == HARDEST


@dataclass(frozen=True)
class Task:
    """One recording for one method."""

    case: Case
    """The recording."""
    clean: Case
    """The same with nothing added."""
    result: Path
    """Result folder to write."""
    pixels: Path
    """Where joints found in colour images are kept."""
    mediapipe: Path | None = None
    """Python that has MediaPipe; this one if None."""


def methods_of(weights: Mapping[str, Path], chosen: Sequence[str] = ()) -> tuple[Method, ...]:
    """Every method, or those that are named.

    Args:
        weights: Name -> weights file, this project's own first.
        chosen: Names; all if empty.

    Raises:
        ConfigError: if a name is unknown, or weights are called as another method is.
    """
    own = next(iter(weights), None)
    warm = [Method(GEOMETRY, GEOMETRY), Method(TRUE_LABELS, TRUE_LABELS)]
    warm += [Method(name, NETWORK, path, main=name == own) for name, path in weights.items()]
    if own is not None:
        warm.append(Method(own + NO_TARGETS, NETWORK, weights[own], targets=False))
        warm += [replace(m, name=m.name + CALIBRATED, calibrated=True) for m in warm
                 if m.targets and (m.main or m.kind == TRUE_LABELS)]  # fmt: skip
    every = [m for one in warm for m in (one, replace(one, name=one.name + COLD, cold=True))]
    if own is not None:
        every.append(Method(own + HARD, NETWORK, weights[own], soft=False))
    every.append(Method(RGB, RGB))
    known = {method.name: method for method in every}
    if len(known) < len(every):
        raise ConfigError(f"weights {', '.join(weights)}: a name is that of another method")
    unknown = sorted(set(chosen) - set(known))
    if unknown:
        raise ConfigError(f"methods {', '.join(unknown)}: allowed are {', '.join(known)}")
    return tuple(method for name, method in known.items() if not chosen or name in chosen)


def run_method(method: Method, task: Task, on_frame: Callable[[], None]) -> None:
    """Write the result of a method on a recording.

    Args:
        method: What to run.
        task: On what.
        on_frame: Called after every frame.
    """
    sequence = open_sequence(task.case.sequence)
    if method.kind == RGB:
        regress(sequence, task.result, task.pixels, task.mediapipe, on_frame)
        return
    fit_sequence(
        sequence,
        task.result,
        _config(method),
        T_world_camera=camera_pose(task.case.pitch_deg),
        on_frame=lambda frame, found: on_frame(),
        begun=None if method.cold else _begun(task.clean),
        segmenter=_segmenter(method),
        body=BodyConfig("calibrated" if method.calibrated else "template"),
    )


def _config(method: Method) -> TrackerConfig:
    if not method.targets:
        return TrackerConfig(pull=OFF)
    return TrackerConfig() if method.soft else TrackerConfig(association=HARD_GATES)


def _begun(clean: Case) -> tuple[Frame, Float[ndarray, "j 3"]]:
    """The first frame before anything appeared, and the joints in it.

    In [Wan19] every tracker has the right pose to begin with, too. The person's size is estimated
    from that frame.
    """
    names, joints = read_reference_joints(clean.sequence / REFERENCE_FILE)
    first = open_sequence(clean.sequence).frame(0)
    known = np.full((len(JOINT_NAMES), 3), np.nan)
    for name, place in zip(names, joints[0], strict=True):
        known[JOINT_NAMES.index(name)] = place
    return replace(first, timestamp_s=first.timestamp_s - BEFORE_S), known


def _segmenter(method: Method) -> Segmenter | None:
    if method.kind == GEOMETRY:
        return None
    if method.kind == TRUE_LABELS:
        return TrueSegmenter()
    assert method.weights is not None
    return _network(method.weights)


@cache
def _network(weights: Path) -> Segmenter:
    """One per process; one thread, since there is a process per core."""
    return ImageSegmenter(load_segmenter(weights, RuntimeConfig(threads=1)))

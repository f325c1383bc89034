# SPDX-License-Identifier: Apache-2.0
"""What one recording says of one kind of body: joints, surface, height and limbs."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.association.observation import observe
from kintrack.association.visibility import visible_vertices
from kintrack.calibration.config import BodyConfig, BodyKind
from kintrack.calibration.measures import LIMBS, Length, measured
from kintrack.calibration.person import Person
from kintrack.config import TrackerConfig
from kintrack.fit import fit_sequence
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.human import load_human
from kintrack.joints import JOINT_NAMES
from kintrack.result import Track
from kintrack.result_writer import SUMMARY_FILE
from kintrack.segmenter import Segmenter
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.reference import read_reference_joints
from kintrack.skin import vertex_normals

SURFACE_EVERY = 4
"""Frames between two looks at the surface."""
SURFACE_CAP_M = 0.05
"""A point further from the skin counts as so far [m]."""


@dataclass
class Gauge:
    """A viewer that measures how far the shown skin is from what was observed of the person."""

    shown: dict[int, Float[ndarray, " n"]] = field(default_factory=dict)
    """Frame -> squared distances along the normal of the nearest seen vertex [m^2]."""

    def show(
        self,
        frame: Frame,
        vertices_camera: ndarray | None,
        joint_positions_camera: ndarray | None,
        status: str,
        text: str = "",
    ) -> None:
        """Measure the frame; one that is tracked again replaces what was there."""
        if frame.index % SURFACE_EVERY or vertices_camera is None or status != "tracking":
            self.shown.pop(frame.index, None)
            return
        a = TrackerConfig().association
        observed = observe(frame, a.max_width_px, a.background_share, frame.labels)
        faces = load_human().skin.faces
        normals = vertex_normals(vertices_camera, faces)
        visible = visible_vertices(
            vertices_camera, normals, faces, observed.camera, a.facing, a.self_occlusion_m
        )
        seen = np.flatnonzero(visible)
        points = observed.points_camera[observed.region]
        if not len(seen) or not len(points):
            return
        nearest = seen[cKDTree(vertices_camera[seen]).query(points)[1]]
        along = np.einsum("ij,ij->i", points - vertices_camera[nearest], normals[nearest])
        self.shown[frame.index] = np.minimum(along**2, SURFACE_CAP_M**2)

    def close(self) -> None:
        """Nothing is open."""

    @property
    def rms_m(self) -> float:
        """Root mean square over everything measured [m]."""
        squares = list(self.shown.values())
        return float(np.sqrt(np.concatenate(squares).mean())) if squares else float("nan")


@dataclass(frozen=True)
class Row:
    """One recording tracked with one kind of body."""

    name: str
    """The recording."""
    labels: str
    """What labelled the pixels."""
    body: str
    """Whose body."""
    used: str
    """What became of it: see `Acquaintance.told`."""
    joints_m: float
    """Mean joint error over tracked frames [m]; NaN without a truth."""
    tracked: float
    """Share of frames tracked, 0 to 1."""
    surface_m: float
    """Point-to-surface distance, root mean square [m]."""
    height: Length | None
    """Estimated height; None for a body that nobody estimated."""
    limbs: dict[str, Length]
    """Estimated limbs."""
    height_m: float = float("nan")
    """True height [m]."""
    limbs_m: dict[str, float] = field(default_factory=dict)
    """True limbs [m]."""

    @property
    def height_error_m(self) -> float:
        """Estimated minus true height [m]."""
        return float("nan") if self.height is None else self.height.value_m - self.height_m


def tracked(
    sequence: SequenceReader,
    folder: Path,
    body: BodyKind,
    segmenter: Segmenter | None,
    T_world_camera: ndarray = T_LEVEL_WORLD_CAMERA,
    person: Person | None = None,
    config: TrackerConfig | None = None,
) -> tuple[Track, float, dict]:
    """A recording fitted with one kind of body.

    Returns:
        Track, point-to-surface distance [m], and what the summary says of the body.
    """
    gauge = Gauge()
    track = fit_sequence(
        sequence,
        folder,
        config,
        viewer=gauge,
        T_world_camera=T_world_camera,
        segmenter=segmenter,
        person=person,
        body=BodyConfig(body),
    )
    summary = json.loads((folder / SUMMARY_FILE).read_text())
    return track, gauge.rms_m, summary["body"] | {"shape": summary["person"]["shape"]}


def lengths_of(body: dict) -> tuple[Length, dict[str, Length]]:
    """Height and limbs of the body that was tracked with; a sized template knows no doubt."""
    if "height_m" in body and body["used"] in ("calibrated", "given"):
        found = {name: Length(**length) for name, length in body["limbs_m"].items()}
        return Length(**body["height_m"]), found
    b = np.zeros(10)
    b[: len(body["shape"])] = body["shape"]
    return measured(b, np.zeros((10, 10)))


def joint_error_m(track: Track, recording: Path) -> float:
    """Mean distance to the reference joints over tracked frames [m]."""
    names, reference = read_reference_joints(recording / "reference_joints.csv")
    shared = [name for name in JOINT_NAMES if name in names]
    ours = track.joint_positions_camera_m[:, [JOINT_NAMES.index(name) for name in shared]]
    theirs = reference[: len(ours), [list(names).index(name) for name in shared]]
    good = track.status == "tracking"
    off = np.linalg.norm(ours[: len(theirs)] - theirs, axis=2)[good[: len(theirs)]]
    return float(np.nanmean(off)) if np.isfinite(off).any() else float("nan")


def true_lengths(recording: Path) -> tuple[float, dict[str, float]]:
    """Height and limbs of the person of a synthetic recording [m]."""
    from synthesis.people.population import load_population

    population = load_population()
    who = int(json.loads((recording / "take.json").read_text())["take"]["person"])
    _, points = population.body(who)
    found = {
        limb: float(
            np.mean([np.linalg.norm(points[f"{s}_{b}"] - points[f"{s}_{a}"]) for s in "lr"])
        )
        for limb, (a, b) in LIMBS.items()
    }
    return float(population.heights_m[who]), found

# SPDX-License-Identifier: Apache-2.0
"""The recordings that are judged, and what is known of each."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from kintrack.bench.cases import CLEAN, DISTANCES_M, OBJECTS
from kintrack.sequence.folder import open_folder

WITNESS_FILE = "reference_mediapipe.csv"
MASK_FOLDER = "mask"
REAL_SCENES = ("uva_turn", "bonn_tablet", "bonn_three", "sofa")
"""Real recordings of whole scenes, by their folders."""
TEST, COMPOSITES = "test", "utd_mhad"
"""Groups with true labels: held-out synthetic people; real people put into real scenes."""


@dataclass(frozen=True)
class Case:
    """One recording."""

    group: str
    """`TEST`, `COMPOSITES`, or the name of a real recording of a whole scene."""
    name: str
    """The recording."""
    condition: str
    """`clean`, or the distance of the object before the person."""
    sequence: Path
    """Its folder."""
    bare: Path | None = None
    """The labelled person alone, whose readings without label are nobody knows what; None where
    every label is known."""

    @property
    def key(self) -> str:
        """Relative path of its results."""
        return f"{self.group}/{self.condition.replace(' ', '_')}/{self.name}"

    def fingerprint(self) -> str:
        """Changes when the recording does: by text files, and by names and sizes of images."""
        digest = hashlib.sha256()
        for folder in filter(None, (self.sequence, self.bare)):
            for path in sorted(folder.glob("*.json")) + sorted(folder.glob("*.csv")):
                digest.update(path.read_bytes())
            digest.update((folder / "depth.txt").read_bytes())
            for path in sorted(folder.glob("*/*")):
                if path.suffix in (".png", ".jpg"):
                    digest.update(f"{path.relative_to(folder)} {path.stat().st_size}".encode())
        return digest.hexdigest()


def condition_of(distance_m: float | None) -> str:
    """Name of a distance."""
    return CLEAN if distance_m is None else OBJECTS[DISTANCES_M.index(distance_m)]


CONDITIONS = (CLEAN, *OBJECTS)


def real_scenes(data: Path) -> list[Case]:
    """The real recordings of whole scenes that lie in a folder."""
    return [
        Case(name, name, CLEAN, data / name)
        for name in REAL_SCENES
        if (data / name / "depth.txt").is_file()
    ]


def frames_in(case: Case) -> int:
    """Frames of a case."""
    return len(open_folder(case.sequence))

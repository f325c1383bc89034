# SPDX-License-Identifier: Apache-2.0
"""The recordings of the accuracy bench, and what is put into each."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from synthesis.dataset.record import TAKE_FILE
from synthesis.occlusion.occlude import FACTS_FILE

DISTANCES_M = (0.30, 0.45, 0.60)
"""From the object's farthest point to the person's nearest place [m], [Wan19]."""
SHARE = 1.0 / 3.0
"""Share of the person that the object hides."""
REDRAWS = 6
"""How often another object is drawn where one cannot hide that much."""
ALONE, ROOM, REAL, SCENES = "alone", "room", "real", "scenes"
GROUPS = (ALONE, ROOM, REAL, SCENES)
"""Synthetic people with nothing around them, the same in rooms, real people put into a real room,
real recordings of whole scenes."""
CLEAN, SCENE, HIDDEN, ABSENT = "clean", "scene", "hidden 2 s", "absent 2 s"
OBJECTS = tuple(f"{100 * distance_m:.0f} cm" for distance_m in DISTANCES_M)
CONDITIONS = (CLEAN, SCENE, *OBJECTS, HIDDEN, ABSENT)
"""Nothing added; a real room around the person; an object at a distance; nobody to be seen for a
while, behind a board or gone."""
GAPS = (HIDDEN, ABSENT)
FULL_SCENES = {"bonn_tablet": 0.0, "bonn_three": 0.0, "sofa": 25.0, "uva_turn": 0.0}
"""Real recording of a whole scene -> how far its camera looks down [deg]."""


@dataclass(frozen=True)
class Case:
    """One recording of the bench."""

    group: str
    """One of `GROUPS`."""
    name: str
    """The recording."""
    condition: str
    """One of `CONDITIONS`."""
    sequence: Path
    """Its folder."""
    pitch_deg: float = 0.0
    """How far its camera looks down [deg]."""

    @property
    def distance_m(self) -> float | None:
        """Distance of the object before the person [m]; None without one."""
        return dict(zip(OBJECTS, DISTANCES_M, strict=True)).get(self.condition)

    @property
    def key(self) -> str:
        """Relative path of its results."""
        return f"{self.group}/{self.condition.replace(' ', '_')}/{self.name}"

    def fingerprint(self) -> str:
        """Changes when the recording does: by text files, and by names and sizes of images."""
        digest = hashlib.sha256()
        for path in sorted(self.sequence.iterdir()):
            if path.suffix in (".csv", ".json", ".txt"):
                digest.update(path.read_bytes())
        for path in sorted(self.sequence.glob("*/*")):
            if path.suffix in (".png", ".jpg"):
                digest.update(f"{path.relative_to(self.sequence)} {path.stat().st_size}".encode())
        return digest.hexdigest()


def cases_of(
    group: str, recordings: Sequence[Path], folder: Path, conditions: Sequence[str]
) -> list[Case]:
    """Every recording in each condition.

    Args:
        group: What they are.
        recordings: Sequence folders of the clean ones.
        folder: Where the others lie or will lie.
        conditions: Out of `CONDITIONS`.
    """
    cases = []
    for path in recordings:
        pitch_deg = FULL_SCENES.get(path.name, 0.0) if group == SCENES else pitch_of(path)
        for condition in conditions:
            place = folder / group / condition.replace(" ", "_") / path.name
            where = path if condition == CLEAN else place
            cases.append(Case(group, path.name, condition, where, pitch_deg))
    return cases


def pitch_of(sequence: Path) -> float:
    """How far the camera of a synthetic recording looks down [deg]; 0 for any other."""
    path = sequence / TAKE_FILE
    if not path.is_file():
        return 0.0
    ahead = np.array(json.loads(path.read_text())["T_world_camera"])[:3, 2]
    return float(np.degrees(np.arcsin(-ahead[2])))


def thing_of(case: Case) -> str:
    """Name of the object in an occluded recording; empty where there is none."""
    path = case.sequence / FACTS_FILE
    return str(json.loads(path.read_text())["thing"]) if case.distance_m is not None else ""

# SPDX-License-Identifier: Apache-2.0
"""The recordings of the accuracy bench: each as it is, and with an object at three distances."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kintrack.errors import SceneError
from kintrack.geometry import camera_pose
from kintrack.sequence import open_sequence
from synthesis.dataset.record import TAKE_FILE
from synthesis.objects.catalogue import held_out_things
from synthesis.occlusion.occlude import FACTS_FILE, OccludeConfig, occlude
from synthesis.occlusion.placing import PlacingConfig

DISTANCES_M = (0.30, 0.45, 0.60)
"""From the object's farthest point to the person's nearest place [m], [Wan19]."""
SHARE = 1.0 / 3.0
"""Share of the person that the object hides."""
REDRAWS = 6
"""How often another object is drawn where one cannot hide that much."""


@dataclass(frozen=True)
class Case:
    """One recording of the bench."""

    group: str
    """`alone`, `room` (synthetic, exact truth) or `real`."""
    name: str
    """The recording."""
    distance_m: float | None
    """Distance of the object [m]; None without one."""
    sequence: Path
    """Its folder."""
    pitch_deg: float = 0.0
    """How far its camera looks down [deg]."""

    @property
    def condition(self) -> str:
        """`clean`, or the distance in centimetres."""
        return "clean" if self.distance_m is None else f"{100 * self.distance_m:.0f} cm"

    @property
    def key(self) -> str:
        """Relative path of its results."""
        return f"{self.group}/{self.condition.replace(' ', '_')}/{self.name}"


def cases_of(
    group: str, recordings: Sequence[Path], folder: Path, distances_m: Sequence[float] = DISTANCES_M
) -> list[Case]:
    """Every recording clean and at each distance.

    Args:
        group: What they are.
        recordings: Sequence folders.
        folder: Where the occluded ones lie or will lie.
        distances_m: Distances of the object [m].
    """
    cases = []
    for path in recordings:
        pitch_deg = pitch_of(path)
        cases.append(Case(group, path.name, None, path, pitch_deg))
        for distance_m in distances_m:
            place = folder / group / f"{100 * distance_m:.0f}_cm" / path.name
            cases.append(Case(group, path.name, distance_m, place, pitch_deg))
    return cases


def pitch_of(sequence: Path) -> float:
    """How far the camera of a synthetic recording looks down [deg]; 0 for any other."""
    path = sequence / TAKE_FILE
    if not path.is_file():
        return 0.0
    ahead = np.array(json.loads(path.read_text())["T_world_camera"])[:3, 2]
    return float(np.degrees(np.arcsin(-ahead[2])))


def make_occluded(
    case: Case, clean: Path, seed: int, on_frame: Callable[[int], None] = lambda n: None
) -> None:
    """Write an occluded recording unless it is there; held-out objects, drawn by name and seed.

    The same draws are made at every distance, so that only the distance differs.

    Args:
        case: The case, with a distance.
        clean: Folder of the recording without the object.
        seed: Draws object, place and noise.
        on_frame: Called with the number of frames done.

    Raises:
        SceneError: if no object hides that much of the person.
    """
    assert case.distance_m is not None
    facts = case.sequence / FACTS_FILE
    if facts.is_file():
        return
    sequence = open_sequence(clean)
    problem = SceneError(f"{case.name}: no object")
    for draw in range(REDRAWS):
        entropy = (seed, draw, *case.name.encode())
        rng = np.random.default_rng(entropy)
        things = held_out_things()
        thing = things[str(rng.choice(sorted(things)))](rng)
        config = OccludeConfig(PlacingConfig(case.distance_m, SHARE), seed=int(rng.integers(2**31)))
        shutil.rmtree(case.sequence, ignore_errors=True)
        try:
            occlude(
                sequence,
                case.sequence,
                thing,
                config=config,
                T_world_camera=camera_pose(case.pitch_deg),
                on_frame=on_frame,
            )
            return
        except SceneError as error:
            problem = error
    raise problem


def thing_of(case: Case) -> str:
    """Name of the object in an occluded recording; empty for a clean one."""
    path = case.sequence / FACTS_FILE
    return "" if case.distance_m is None else str(json.loads(path.read_text())["thing"])

# SPDX-License-Identifier: Apache-2.0
"""Which recordings the segmentation bench judges, and where they come from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from kintrack.bench.cases import CLEAN, DISTANCES_M
from kintrack.bench.segmentation.cases import COMPOSITES, TEST, Case, condition_of, real_scenes
from kintrack.bench.segmentation.config import SegmentationBenchConfig
from kintrack.bench.segmentation.making import Composite, Excerpt, make_all, spread
from kintrack.errors import DatasetError
from synthesis.dataset.build import MANIFEST, build_dataset, sequences
from synthesis.dataset.recipes import takes_of

Report = Callable[[str, int, int], None]
"""Called with what is going on, how much of it is done, and how much there is."""


@dataclass(frozen=True)
class Inputs:
    """Where recordings come from."""

    dataset: Path | None = None
    """Dataset of the recipe `paper`; its test part is made if there is none."""
    mocap: Path | None = None
    """Motion capture clips for that."""
    data: Path | None = None
    """Folder of the real recordings; synthetic people only if None."""


@dataclass
class Made:
    """The cases, and what could not be made."""

    cases: list[Case] = field(default_factory=list)
    """In the order of the tables."""
    left_out: dict[str, str] = field(default_factory=dict)
    """Case -> why."""


def make_cases(
    folder: Path, config: SegmentationBenchConfig, inputs: Inputs, on_progress: Report
) -> Made:
    """All cases; those that are missing are made.

    Raises:
        KintrackError: if a folder holds no recordings, or none of a group can be made.
    """
    sources: list[tuple[str, Path, int]] = [
        (TEST, path, config.frames) for path in _test_part(folder, config, inputs, on_progress)
    ]
    if inputs.data is not None:
        sources += [(COMPOSITES, path, config.real_frames) for path in _people(inputs.data, config)]
    excerpts = {
        (group, path): Excerpt(
            path, folder / "recordings" / group / "bare" / path.name, frames, group == TEST
        )
        for group, path, frames in sources
    }
    failed = make_all(
        list(excerpts.values()),
        config.workers,
        lambda done, total: on_progress("recordings", done, total),
    )
    scenes = None if inputs.data is None else inputs.data / "scenes" / "redkitchen"
    composites = {
        (group, path, distance_m): Composite(
            excerpt.folder,
            path,
            folder / "recordings" / group / condition_of(distance_m).replace(" ", "_") / path.name,
            distance_m,
            scenes if group == COMPOSITES else None,
            config.seed,
        )
        for (group, path), excerpt in excerpts.items()
        if excerpt.folder not in failed
        for distance_m in (None, *DISTANCES_M)
        if group == COMPOSITES or distance_m is not None
    }
    failed |= make_all(
        list(composites.values()),
        config.workers,
        lambda done, total: on_progress("objects and scenes", done, total),
    )
    made = Made(left_out={str(p.relative_to(folder)): why for p, why in failed.items()})
    for (group, path), excerpt in excerpts.items():
        if group == TEST and excerpt.folder not in failed:
            made.cases.append(Case(group, path.name, CLEAN, excerpt.folder))
    for (group, path, distance_m), composite in composites.items():
        if composite.folder not in failed:
            bare = composite.clean if group == COMPOSITES else None
            made.cases.append(
                Case(group, path.name, condition_of(distance_m), composite.folder, bare)
            )
    if inputs.data is not None:
        made.cases += real_scenes(inputs.data)
    if not any(case.group == TEST for case in made.cases):
        raise DatasetError(f"no test recording can be used: {made.left_out}")
    return made


def _test_part(folder, config, inputs, on_progress) -> list[Path]:
    """Recordings of held-out people and motions."""
    root = inputs.dataset
    if root is None:
        root = folder / "recordings" / "filmed"
        takes = [t for t in takes_of("paper", config.seed, inputs.mocap, config.length)
                 if t.part == TEST]  # fmt: skip
        total = sum(take.frames for take in takes)
        build_dataset(
            root,
            takes,
            {"recipe": "paper, test part", "seed": config.seed},
            inputs.mocap,
            config.workers,
            lambda progress: on_progress("filming", progress.frames, total),
        )
    found = [path for path in sequences(root) if path.parent.name == TEST]
    if not found:
        raise DatasetError(f"{root / MANIFEST} names no recording of a part `{TEST}`; needed: a "
                           "dataset made by kintrack dataset build --recipe paper")  # fmt: skip
    return found


def _people(data: Path, config: SegmentationBenchConfig) -> list[Path]:
    """Real recordings of people without background, evenly spread over those there are."""
    root = data / COMPOSITES
    found = sorted(path.parent for path in root.glob("*/depth.txt"))
    if not found:
        raise DatasetError(f"{root} holds no recording; needed: sequence folders of people "
                           "without background")  # fmt: skip
    if not list((data / "scenes" / "redkitchen").glob("*.depth.png")):
        raise DatasetError(f"{data / 'scenes' / 'redkitchen'} holds no NNNNNN.depth.png to put "
                           "people into")  # fmt: skip
    return [found[n] for n in spread(len(found), config.real_recordings)]

# SPDX-License-Identifier: Apache-2.0
"""The segmentation bench: recordings made, networks judged on them, runtimes compared and timed.

Whatever is made or judged is kept; a stopped bench goes on where it was, and new weights run
through the old recordings only.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from kintrack.bench.cases import CLEAN
from kintrack.bench.segmentation.cases import TEST, Case, frames_in
from kintrack.bench.segmentation.ceiling import ceiling
from kintrack.bench.segmentation.config import SegmentationBenchConfig
from kintrack.bench.segmentation.inputs import Inputs, Report, make_cases
from kintrack.bench.segmentation.judging import judge
from kintrack.bench.segmentation.making import spread
from kintrack.bench.segmentation.networks import Network, judging_digest, load_networks
from kintrack.bench.segmentation.runtimes import agreement, count, timing, variants
from kintrack.bench.segmentation.samples import Sample, samples
from kintrack.bench.segmentation.summary import Judged, summary, targets
from kintrack.files import make_result_folder, write_json
from kintrack.sequence.folder import open_folder
from kintrack.sequence.frame import Frame

RESULT_FILE = "segmentation.json"
TIMED_FRAMES = 8
"""Frames that timing goes round."""


@dataclass(frozen=True)
class Bench:
    """What the bench found."""

    content: dict[str, Any]
    """The content of `segmentation.json`."""
    networks: list[Network]
    """The networks, the one that ships first."""
    judged: list[Judged]
    """Every recording by every network."""


def run_segmentation(
    folder: Path,
    files: Mapping[str, Path],
    config: SegmentationBenchConfig,
    inputs: Inputs,
    on_progress: Report = lambda what, done, total: None,
) -> Bench:
    """Run the bench.

    Args:
        folder: Where recordings and results go.
        files: Name -> weights file; the first is the network that ships.
        config: How much is measured.
        inputs: Where recordings come from.
        on_progress: Shown how far it is.

    Returns:
        What it found; `segmentation.json` is written too.

    Raises:
        KintrackError: if weights or recordings cannot be used.
    """
    networks = load_networks(files, config.runtime)
    make_result_folder(folder)
    made = make_cases(folder, config, inputs, on_progress)
    judged = _judged(folder, made.cases, networks, on_progress)
    found = summary(judged)
    found["ceiling"] = ceiling([case for case in made.cases if case.group == TEST])
    found["runtimes"] = _runtimes(made.cases, networks, config, on_progress)
    content = {
        "config": asdict(config),
        "order": [network.name for network in networks],
        "load": os.getloadavg()[0],
        "networks": {network.name: _facts(network) for network in networks},
        **found,
        "left_out": made.left_out,
    }
    content["targets"] = targets(content)
    write_json(folder / RESULT_FILE, content)
    return Bench(content, networks, judged)


def _judged(
    folder: Path, cases: Sequence[Case], networks: Sequence[Network], on_progress: Report
) -> list[Judged]:
    digest = judging_digest()
    total, done, rows = sum(map(frames_in, cases)), 0, []
    for case in cases:
        before = done

        def count_frame() -> None:
            nonlocal done
            done += 1
            on_progress("judging", done, total)

        found = judge(case, networks, folder / "judged", digest, count_frame)
        rows += [Judged(case, name, modality, plain) for (name, modality), plain in found.items()]
        done = before + frames_in(case)
        on_progress("judging", done, total)
    return rows


def _runtimes(
    cases: Sequence[Case],
    networks: Sequence[Network],
    config: SegmentationBenchConfig,
    on_progress: Report,
) -> dict[str, Any]:
    """Counts, times and agreement of every network on every runtime that works here."""
    chosen, frames = _some(cases, config.agreement_frames)
    found: dict[str, Any] = {}
    done, total = 0, len(networks) * len(chosen)

    def count_frame() -> None:
        nonlocal done
        done += 1
        on_progress("comparing runtimes", done, total)

    for network in networks:
        working, obstacles = variants(network.weights)
        agreed = agreement(working, chosen, count_frame)
        found[network.name] = {
            "missing": obstacles,
            "reference": working[0].name if working else None,
            "works": {
                variant.name: {
                    "agreement": agreed[variant.name],
                    "timing": timing(variant, frames, config.timing_s),
                }
                for variant in working
            },
        }
    return found


def _some(cases: Sequence[Case], most: int) -> tuple[list[Sample], list[Frame]]:
    """Samples and frames, evenly spread over the synthetic recordings with objects."""
    occluded = [c for c in cases if c.group == TEST and c.condition != CLEAN]
    each = max(1, round(most / len(occluded))) if occluded else 0
    chosen: list[Sample] = []
    frames: list[Frame] = []
    for case in occluded:
        found = list(samples(case, spread(frames_in(case), each)))
        chosen += found
        frames += [open_folder(case.sequence).frame(sample.index) for sample in found[:1]]
    return chosen[:most], frames[:TIMED_FRAMES]


def _facts(network: Network) -> dict[str, Any]:
    """What a network is."""
    return {
        "sha256": network.digest,
        "bytes": network.path.stat().st_size,
        "runtime": network.segmenter.runtime,
        "inserted_objects": network.saw_objects,
        **count(network.weights),
        "training": dict(network.weights.training),
    }

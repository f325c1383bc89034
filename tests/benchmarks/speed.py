# SPDX-License-Identifier: Apache-2.0
"""Time and memory of the tracker in one process, as it runs for a user: docs/results.md, JSON.

Needs a quiet machine. Files are read between the timed frames, as in use.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import baseline
import numba
import numpy as np
import report
from baseline import Metric, target_table
from command import OUT, parser, refuse_quick_baseline, run, settle
from rich.progress import track
from stages import STAGES, Doubled, Timing, median_p95, time_tracker

import kintrack
from kintrack.files import make_result_folder, write_json
from kintrack.sequence import SequenceReader, open_sequence
from kintrack.tracker import Tracker
from segmentation.tracking import image_segmenter

GROUP = "speed"
DEMO = Path(kintrack.__file__).parent / "demo"
STANDING, FAST, SCENE = "utd_mhad/a16_s1_t1", "utd_mhad/a22_s1_t1", "bonn_tablet"
"""An arm curl, a jog, and a whole room."""
TURNING = "uva_turn"
"""The other recording that the labelled tracker is timed on."""
ROOM, LABELLED = "whole room", ", labelled"
FRAME_MS, LABELLED_MS, MEMORY_MIB = 25.0, 40.0, 1024.0
"""Targets: a frame at 320 x 240 without labels, one at 640 x 480 with the network that labels it,
and the whole process without a network."""


class Workload(NamedTuple):
    """What is timed."""

    name: str
    """For the tables."""
    sequence: SequenceReader
    """The recording."""
    doubled: bool = False
    """Whether its pixels are doubled."""
    labelled: bool = False
    """Whether the network that ships labels it."""


@dataclass(frozen=True)
class Measured:
    """What one run of this benchmark found."""

    timings: list[Timing]
    """One per recording; the first ones at 320 x 240."""
    memory_mib: dict[str, float]
    """Largest resident memory so far, after each recording [MiB]."""
    load_s: float
    """Loading the human and making a tracker [s]."""
    first_s: float
    """First frame of the process, with loading or making compiled code [s]."""
    threads: int
    """Threads of the process at the end."""


def main() -> int:
    """Measure, write."""
    arguments = _arguments()
    refuse_quick_baseline(arguments)
    limit = arguments.frames or (8 if arguments.quick else None)
    measured = _measure(arguments.data, arguments.quick, 1 if arguments.quick else 3, limit)
    metrics = _metrics(measured)
    print(target_table(metrics))
    print(_stage_table(measured.timings))
    if not arguments.quick:
        _write(measured, metrics)
    return settle(arguments, GROUP, metrics)


def _arguments() -> argparse.Namespace:
    made = parser(__doc__)
    made.add_argument("--frames", type=int, help="frames of each recording; all if not given")
    return made.parse_args()


def _measure(data: Path, quick: bool, passes: int, limit: int | None) -> Measured:
    workloads = _workloads(data, quick)
    began = time.perf_counter()
    tracker = Tracker()
    loaded = time.perf_counter()
    tracker.step(workloads[0].sequence.frame(0))
    first_s = time.perf_counter() - loaded
    # the second frame runs the code that only a frame after the start runs
    tracker.step(workloads[0].sequence.frame(1))
    timings, memory_mib = [], {}
    for work in track(workloads, "timing", disable=not sys.stdout.isatty()):
        recording = Doubled(work.sequence) if work.doubled else work.sequence
        # in a room most frames are starts, which take long
        times = 1 if work.name == ROOM or work.labelled else passes
        segmenter = image_segmenter() if work.labelled else None
        timings.append(time_tracker(work.name, recording, times, limit, segmenter))
        memory_mib[work.name] = peak_memory_mib()
    return Measured(timings, memory_mib, loaded - began, first_s, _threads())


def _workloads(data: Path, quick: bool) -> list[Workload]:
    """The recordings that there are; the demo where data is absent. Labelled ones come last."""
    demo = open_sequence(DEMO)
    if quick:
        return [Workload("demo", demo), Workload("demo" + LABELLED, demo, labelled=True)]
    found = [("standing", data / STANDING), ("fast", data / FAST)]
    small = [Workload(name, open_sequence(path)) for name, path in found if path.is_dir()]
    large = [Workload("demo, pixels doubled", demo, doubled=True)]
    if (data / SCENE).is_dir():
        large.append(Workload(ROOM, open_sequence(data / SCENE)))
    labelled = [
        Workload(name + LABELLED, open_sequence(data / name), labelled=True)
        for name in (SCENE, TURNING)
        if (data / name).is_dir()
    ]
    own = labelled or [Workload("demo" + LABELLED, demo, labelled=True)]
    return [*(small or [Workload("demo", demo)]), *large, *own]


def peak_memory_mib() -> float:
    """Largest resident memory of this process so far [MiB]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 2**20 if sys.platform == "darwin" else peak / 2**10


def _threads() -> int:
    """Threads of this process; 0 where the system does not say."""
    try:
        return len(os.listdir("/proc/self/task"))
    except OSError:
        return 0


def _metrics(measured: Measured) -> list[Metric]:
    metrics = []
    for t in measured.timings:
        target = None if "doubled" in t.name or t.name == ROOM else FRAME_MS
        target = LABELLED_MS if t.name.endswith(LABELLED) else target
        for statistic, value in zip(("median", "p95"), median_p95(t.frames_ms), strict=True):
            key = f"{t.name}_{statistic}".replace(", ", "_").replace(" ", "_")
            says = f"{t.name}: whole frame, {statistic}"
            metrics.append(Metric(key, says, value, "ms", "lower", 0.25 * value, target))
    bare = [t for t in measured.timings if not t.name.endswith(LABELLED)]
    starts = np.concatenate([t.starts_ms for t in bare if t.name != ROOM])
    start_ms = median_p95(starts)[0]
    peak = max(measured.memory_mib[t.name] for t in bare)
    return [
        *metrics,
        Metric("start", "start, median", start_ms, "ms", "lower", 0.25 * start_ms),
        Metric("memory", "peak memory", peak, "MiB", "lower", 50.0, MEMORY_MIB),
    ]


def _stage_table(timings: Sequence[Timing]) -> str:
    def cell(values: np.ndarray) -> str:
        median, p95 = median_p95(values)
        return "-" if np.isnan(median) else f"{median:.1f} / {p95:.1f}"

    rows = [[stage, *(cell(t.stages_ms[stage]) for t in timings)] for stage in STAGES]
    rows.append(["**whole frame**", *(f"**{cell(t.frames_ms)}**" for t in timings)])
    rows.append(["start, apart", *(cell(t.starts_ms) for t in timings)])
    rows.append(["frames timed", *(str(len(t.frames_ms)) for t in timings)])
    rows.append(["starts", *(str(len(t.starts_ms)) for t in timings)])
    rows.append(["processor / wall time", *(f"{t.cores_used:.2f}" for t in timings)])
    return report.table(["median / p95, ms", *(t.name for t in timings)], rows)


def _write(measured: Measured, metrics: Sequence[Metric]) -> None:
    facts = report.conditions(
        data="; ".join(
            f"{t.name}: {', '.join(f'{n} {status}' for status, n in t.statuses.items())}"
            for t in measured.timings
        ),
        seeds="none, nothing is drawn at random",
    )
    facts["threads"] = (
        f"{measured.threads} in the process, numba {numba.get_num_threads()}, OMP_NUM_THREADS "
        f"{os.environ.get('OMP_NUM_THREADS', 'not set')}"
    )
    path = make_result_folder(OUT) / f"{GROUP}.json"
    write_json(path, _content(measured, metrics) | {"conditions": facts})
    report.rewrite_section(report.RESULTS, "speed", _section(measured, metrics, facts))
    for written in (path, report.RESULTS):
        print(f"written: {written.relative_to(report.ROOT)}")


def _section(measured: Measured, metrics: Sequence[Metric], facts: dict[str, str]) -> str:
    memory = ", ".join(f"{mib:.0f} MiB after {name}" for name, mib in measured.memory_mib.items())
    return "\n\n".join(
        [
            "## Speed and memory",
            "One process, default configuration; reading files is left out, and the time of a "
            "start stands apart. Standing and fast: UTD-MHAD at 320 x 240; the others: 640 x 480. "
            "Labelled: the network that ships labels every frame (in `observe`), from a cold "
            "start; the others are the geometric tracker. Rivals run beside a frame's stages and "
            "slow them; `rival` is the wait for them at its end.",
            target_table(metrics),
            "### Stages",
            "A stage's time in a frame is the sum over the frame's rounds.",
            _stage_table(measured.timings),
            f"Loading the human takes {measured.load_s:.2f} s, the first frame of a process "
            f"{measured.first_s:.1f} s (a start, and compiled code read from its cache or made). "
            f"Peak memory: {memory}.",
            "### Conditions",
            report.bullets(facts),
        ]
    )


def _content(measured: Measured, metrics: Sequence[Metric]) -> dict[str, Any]:
    return {
        "metrics": baseline.as_dict(metrics),
        "recordings": {
            t.name: {
                "frame_ms": median_p95(t.frames_ms),
                "start_ms": median_p95(t.starts_ms),
                "stages_ms": {stage: median_p95(ms) for stage, ms in t.stages_ms.items()},
                "statuses": t.statuses,
                "cores_used": t.cores_used,
            }
            for t in measured.timings
        },
        "memory_mib": measured.memory_mib,
        "load_s": measured.load_s,
        "first_s": measured.first_s,
        "threads": measured.threads,
    }


if __name__ == "__main__":
    run(main)

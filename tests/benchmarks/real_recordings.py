# SPDX-License-Identifier: Apache-2.0
"""Fit every real recording, then score the results: docs/results.md, a figure, a JSON file.

The fits go to out/real_recordings/ and are kept: a second run only scores, unless code, model or
configuration of the tracker changed.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import baseline
import report
from command import OUT, parser, refuse_quick_baseline, run, settle
from fitting import Job, fit_all
from real_cases import what_goes_wrong
from real_figure import write_figure
from real_metrics import metrics
from real_tables import section
from scenes import SCENES, SceneScore, score_scene
from scoring import JOINT_KINDS, RecordingScore, pool, score_recording

from kintrack.errors import SequenceError
from kintrack.files import make_result_folder, write_json

QUICK = ("a01_s1_t1", "a13_s2_t1", "a22_s3_t1", "a24_s4_t1", "a27_s5_t1")
"""One recording of each person."""

GROUP = "real_recordings"


def main() -> int:
    """Fit, score, write."""
    arguments = _arguments()
    refuse_quick_baseline(arguments)
    recordings = _recordings(arguments.data, arguments.quick)
    scenes = [] if arguments.quick else [arguments.data / name for name in SCENES]
    folder = OUT / GROUP
    jobs = [
        Job(path, folder / path.name, SCENES.get(path.name, 0.0), arguments.labels)
        for path in [*recordings, *scenes]
    ]
    errors = fit_all(jobs, arguments.jobs, arguments.fresh)
    for path, error in errors.items():
        print(f"{path.name} broke off: {error}")
    scores = [score_recording(folder / path.name, path) for path in recordings]
    scene_scores = [score_scene(folder / p.name, p, errors.get(p)) for p in scenes]
    measured = metrics(scores)
    print(baseline.target_table(measured))
    if not arguments.quick:
        _write(scores, scene_scores)
    return settle(arguments, GROUP, measured)


def _arguments() -> argparse.Namespace:
    made = parser(__doc__)
    made.add_argument("--jobs", type=int, default=2, help="recordings fitted at once")
    made.add_argument("--labels", choices=["network", "none"], default="network")
    made.add_argument("--fresh", action="store_true", help="fit again what is finished")
    arguments = made.parse_args()
    if arguments.jobs < 1:
        made.error(f"--jobs {arguments.jobs}: at least 1 is needed")
    return arguments


def _recordings(data: Path, quick: bool) -> list[Path]:
    root = data / "utd_mhad"
    found = sorted(path for path in root.glob("a??_s?_t?") if path.is_dir())
    if quick:
        found = [path for path in found if path.name in QUICK]
    if not found:
        raise SequenceError(f"{root}: no recordings aAA_sS_tT there; give their folder with --data")
    return found


def _write(scores: Sequence[RecordingScore], scenes: Sequence[SceneScore]) -> None:
    facts = report.conditions(
        data=f"{len(scores)} recordings of UTD-MHAD (Chen, Jafari, Kehtarnavaz, ICIP 2015)"
        + (f"; {', '.join(s.name for s in scenes)}" if scenes else ""),
        seeds="none, nothing is drawn at random",
    )
    path = make_result_folder(OUT) / f"{GROUP}.json"
    write_json(path, _content(scores, scenes) | {"conditions": facts})
    picture = report.RESULTS.parent / "real_recordings.png"
    make_result_folder(picture.parent)
    write_figure(scores, picture)
    text = section(scores, scenes, report.bullets(facts))
    report.rewrite_section(report.RESULTS, "real-recordings", text)
    for written in (path, picture, report.RESULTS):
        print(f"written: {written.relative_to(report.ROOT)}")


def _content(scores: Sequence[RecordingScore], scenes: Sequence[SceneScore]) -> dict[str, Any]:
    return {
        "metrics": baseline.as_dict(metrics(scores)),
        "overall": asdict(pool(scores)),
        "joints": {kind: asdict(pool(scores, kind)) for kind in JOINT_KINDS},
        "recordings": {
            s.name: asdict(pool([s])) | {"what_goes_wrong": what_goes_wrong(s)} for s in scores
        },
        "scenes": [asdict(s) for s in scenes],
    }


if __name__ == "__main__":
    run(main)

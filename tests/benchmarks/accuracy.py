# SPDX-License-Identifier: Apache-2.0
"""Joint errors of every method behind held-out objects: docs/results.md, figures, a JSON file.

Runs `kintrack bench accuracy` in out/accuracy/, where a stopped run goes on.

    python tests/benchmarks/accuracy.py --weights fast_fcn=FILE unet=FILE fast_fcn_no_objects=FILE
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import report
from command import OUT, parser, run

from kintrack.bench import tables
from kintrack.bench.accuracy import run_accuracy
from kintrack.bench.figure import write_pictures
from kintrack.bench.panels import write_methods
from kintrack.bench.recordings import AccuracyConfig, Sources
from kintrack.bench.segmentation.config import named_weights
from kintrack.bench.targets import targets_grid
from kintrack.commands.bench import print_accuracy
from kintrack.commands.console import StepProgress, console
from segmentation.weights import SHIPPED

QUICK = {"recordings": 1, "frames": 90, "real_recordings": 1}
"""One recording of each group."""
PICTURES = {
    "accuracy.png": "accuracy.png",
    "joints.png": "accuracy_joints.png",
    "waits.png": "waits.png",
    "methods.png": "methods.png",
}
"""Pictures of the bench -> their names in docs/."""


def main() -> int:
    """Run, print, write."""
    made = parser(__doc__)
    made.add_argument(
        "--weights",
        nargs="+",
        default=[f"{SHIPPED.stem}={SHIPPED}"],
        metavar="NAME=FILE",
        help="networks to compare, the one that ships first",
    )
    made.add_argument("--methods", nargs="+", default=[], help="some of the methods; all if none")
    made.add_argument("--mediapipe", type=Path, help="Python that has MediaPipe, if not this one")
    arguments = made.parse_args()
    folder = OUT / ("accuracy_quick" if arguments.quick else "accuracy")
    config = AccuracyConfig(
        mediapipe=arguments.mediapipe,
        methods=tuple(arguments.methods),
        **(QUICK if arguments.quick else {}),
    )
    sources = Sources(arguments.data / "mocap", arguments.data)
    with StepProgress() as progress:
        bench = run_accuracy(folder, named_weights(arguments.weights), config, sources, progress)
    pictures = [*write_pictures(bench.content, folder), write_methods(bench)]
    print_accuracy(bench.content)
    if arguments.quick:
        return 0
    for path in pictures:
        if path is not None:
            shutil.copyfile(path, report.RESULTS.with_name(PICTURES[path.name]))
    report.rewrite_section(report.RESULTS, "accuracy", section(bench.content))
    console.print(f"written: {report.RESULTS.relative_to(report.ROOT)}")
    return 0


def section(content: dict[str, Any]) -> str:
    """Markdown of the section."""
    facts = report.conditions(
        data="8 recordings of held-out people, motions and things, 100 frames each, alone and in "
        "rooms (`bench` recipe); 10 of the 65 recordings of UTD-MHAD, put into 7-Scenes' "
        "redkitchen; bonn_tablet, bonn_three, sofa, uva_turn",
        seeds=str(content["seed"]),
    )
    grids = [targets_grid(content), *tables.all_grids(content)]
    shown = "\n\n".join(f"### {grid.title}\n\n{grid.markdown()}" for grid in grids if grid.rows)
    left_out = "\n".join(f"- {key}: {why}" for key, why in content["left_out"].items()) or "- none"
    return f"""## Objects before the person, rooms, starts and losses: every method

Held-out objects (desk chairs, lamps) hide a third of the person; their farthest point lies 30, 45
or 60 cm before her nearest place. Every tracker is started at the true joints of the clean first
frame (real people: at the Kinect's), but for those that start cold, which get nothing. Networks go
by the names of their weights; *true labels* are the ceiling of any network; *geometry alone* knows
nothing of what is person and what is object. *RGB regression* is MediaPipe Pose 0.10.14 on the
colour image, each landmark lifted by the depth around its pixel and pushed inward by a fixed
thickness; a landmark of visibility up to 0.5 or without depth is a missing joint. *Calibrated* is
what `kintrack fit` does by itself: the person's shape and clothes are estimated in the first
second; the others track the average adult in the size of the first frame, so that they differ by
labels alone. *Hard gates* pair a vertex with pixels of its own label only and never take a second
label, as [Wan19] does; everything else weighs another part's pixels less (`association/window.py`).
*Targets off* takes away the pull at rough places of parts, which acts while tracking; a start does
not need them, for it searches postures and headings (`start/`).

Means are over joints with a pose; joints without one count as beyond every threshold, so a method
that gives up has a good mean and a poor curve. Limbs are shoulders, elbows, wrists, hips, knees and
ankles, which RGB regression finds itself; its trunk is interpolated. A person counts as found in
the first frame with status `tracking` in which the joints in view are within 20 cm on average. In
the full scenes the witness is MediaPipe in the image: agreement, not error; in `bonn_three` it
jumps between people, so that no tracker can agree with it throughout.

![Accuracy over threshold.](accuracy.png)

![The same frames as each method understood them; which frames was settled beforehand.](methods.png)

![Mean error of every joint.](accuracy_joints.png)

![How soon the person is found, and found again; in brackets, the recordings.](waits.png)

{shown}

### Left out

{left_out}

### Conditions

{report.bullets(facts)}
"""


if __name__ == "__main__":
    run(main)

# SPDX-License-Identifier: Apache-2.0
"""Cold starts of held-out people at any heading: docs/results.md and a JSON file in out/.

A tracker gets the ten frames of a recording that breaks into the middle of what somebody does
(`start_scenes.py`), and nothing else. It has locked if the joints in view are on average within
20 cm of the truth in the tenth. Recordings are made where they are missing, and stay.

    python tests/benchmarks/starts.py --weights fast_fcn=FILE
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import baseline
import report
from baseline import Metric, target_table
from command import OUT, parser, run
from start_scenes import FRAMES, make
from start_scoring import HEADER, Outcome, outcome_of, rows, share

from kintrack.bench.segmentation.config import named_weights
from kintrack.commands.console import StepProgress, console
from kintrack.files import make_result_folder, write_json
from kintrack.segmenter import Segmenter
from segmentation.tracking import TrueSegmenter, image_segmenter
from segmentation.weights import SHIPPED

TRUE = "true labels"
QUICK = 20
"""Starts of a quick run."""
LOCKED_PERCENT = 99.0
"""Target."""


def main() -> int:
    """Make, run, print, write."""
    made = parser(__doc__)
    made.add_argument("--count", type=int, default=500, help="starts")
    made.add_argument("--seed", type=int, default=0, help="draws the recordings")
    made.add_argument(
        "--people", choices=("held_out", "training"), default="held_out",
        help="whose starts; those of training people are for development and go nowhere",
    )  # fmt: skip
    made.add_argument(
        "--weights", nargs="+", default=[f"{SHIPPED.stem}={SHIPPED}"], metavar="NAME=FILE",
        help="networks to compare, the one that ships first",
    )  # fmt: skip
    arguments = made.parse_args()
    count = QUICK if arguments.quick else arguments.count
    held_out = arguments.people == "held_out"
    segmenters: dict[str, Segmenter] = {
        name: image_segmenter(path) for name, path in named_weights(arguments.weights).items()
    }
    segmenters[TRUE] = TrueSegmenter()
    with StepProgress() as progress:
        folders = []
        for n in range(count):
            folders.append(make(OUT / "starts", arguments.seed, n, held_out))
            progress("filming", n + 1, count)
        outcomes: dict[str, list[Outcome]] = {}
        for name, segmenter in segmenters.items():
            outcome_of(folders[0], segmenter)  # compiles
            outcomes[name] = []
            for folder in folders:
                outcomes[name].append(outcome_of(folder, segmenter))
                progress(f"starts, {name}", len(outcomes[name]), count)
    metrics = metrics_of(outcomes)
    table = report.table(HEADER, [row for name in outcomes for row in rows(name, outcomes[name])])
    console.print(f"{target_table(metrics)}\n\n{table}", highlight=False, markup=False)
    facts = report.conditions(
        data=f"{count} recordings of {FRAMES} frames, {arguments.people.replace('_', '-')} people",
        seeds=str(arguments.seed),
    )
    make_result_folder(OUT)
    name = f"starts_{arguments.people}{'_quick' if arguments.quick else ''}.json"
    starts = {name: [asdict(o) for o in found] for name, found in outcomes.items()}
    content = {"metrics": baseline.as_dict(metrics), "conditions": facts, "starts": starts}
    write_json(OUT / name, content)
    if held_out and not arguments.quick:
        report.rewrite_section(report.RESULTS, "starts", section(metrics, table, facts))
        console.print(f"written: {report.RESULTS.relative_to(report.ROOT)}")
    return 0


def metrics_of(outcomes: Mapping[str, Sequence[Outcome]]) -> list[Metric]:
    """Locked starts of every source of labels; the target is the shipped network's."""
    out = []
    for n, (name, found) in enumerate(outcomes.items()):
        locked = 100 * share(o.locked for o in found)
        key, target = f"locked_{name.replace(' ', '_')}", None if n else LOCKED_PERCENT
        says = f"{name}: locked within {FRAMES} frames"
        out.append(Metric(key, says, locked, "%", "higher", 1.0, target))
    return out


def section(metrics: Sequence[Metric], table: str, facts: Mapping[str, str]) -> str:
    """Markdown of the section."""
    return f"""## Cold starts at any heading

People in furnished rooms, filmed by the Kinect v2's model from the middle of a motion on: a third
sit, a third stand behind something, a quarter leave the image in part, and all of them face
anywhere. A tracker that knows nothing gets {FRAMES} frames; a start is locked if in the last of
them the joints that are neither hidden nor outside the image are on average within 20 cm of the
truth [Wan19, 6]. *All joints* asks the same of hidden ones, too, *each joint in view* that none of
those in view is further away. *Back to front* is a heading off by more than 120 degrees: whoever
begins to be tracked is followed both ways for 3 to 20 frames, so that some are still undecided.

{target_table(metrics)}

{table}

### Conditions

{report.bullets(facts)}
"""


if __name__ == "__main__":
    run(main)

# SPDX-License-Identifier: Apache-2.0
"""The part segmentation and its rivals: docs/results.md, the model card, two figures, a JSON file.

Runs `kintrack bench segmentation` in out/segmentation/, where a stopped run goes on.

    python tests/benchmarks/part_segmentation.py --weights fast_fcn=FILE unet=FILE ...
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import report
from command import OUT, parser, run

from kintrack.bench.segmentation import card, tables
from kintrack.bench.segmentation.config import SegmentationBenchConfig, named_weights
from kintrack.bench.segmentation.figure import write_pictures
from kintrack.bench.segmentation.inputs import Inputs
from kintrack.bench.segmentation.run import run_segmentation
from kintrack.commands.bench import print_grids
from kintrack.commands.console import StepProgress, console

CARD = report.RESULTS.with_name("model_card.md")
CURVES, CURVES_COPY = "curves.png", "model_card_curves.png"
QUICK = SegmentationBenchConfig(
    frames=6, real_recordings=2, real_frames=4, agreement_frames=6, timing_s=0.5
)
PACKAGES = ("torch", "openvino")


def main() -> int:
    """Run, print, write."""
    made = parser(__doc__)
    made.add_argument(
        "--weights", nargs="+", required=True, metavar="NAME=FILE", help="the one that ships first"
    )
    made.add_argument("--dataset", type=Path, default=None, help="of the recipe `paper`")
    arguments = made.parse_args()
    folder = OUT / ("segmentation_quick" if arguments.quick else "segmentation")
    config = QUICK if arguments.quick else SegmentationBenchConfig()
    data = arguments.data
    files = named_weights(arguments.weights)
    with StepProgress() as progress:
        bench = run_segmentation(
            folder, files, config, Inputs(arguments.dataset, data / "mocap", data), progress
        )
    pictures = write_pictures(bench.content, bench.networks, bench.judged, folder)
    print_grids(bench.content)
    if arguments.quick:
        return 0
    for path in pictures:
        shutil.copyfile(path, report.RESULTS.with_name(path.name))
    report.rewrite_section(report.RESULTS, "segmentation", section(bench.content))
    write_card(bench.content, next(iter(files.values())))
    console.print(f"written: {report.RESULTS.relative_to(report.ROOT)}, "
                  f"{CARD.relative_to(report.ROOT)}")  # fmt: skip
    return 0


def write_card(content: dict[str, Any], weights: Path, path: Path = CARD) -> None:
    """Write the generated part of the model card; what is written by hand stays.

    Args:
        content: Of `segmentation.json`.
        weights: The file that ships; the curves of its training lie beside it, if anywhere.
        path: The card.
    """
    curves = weights.with_name(CURVES)
    copy = path.with_name(CURVES_COPY)
    if curves.is_file():
        shutil.copyfile(curves, copy)
    body = card.card(content, copy.name if copy.is_file() else None)
    is_new = not path.is_file()
    if is_new:
        path.write_text(card.HEAD, encoding="utf-8")
    report.rewrite_section(path, "model-card", body)
    if is_new:
        with path.open("a", encoding="utf-8") as file:
            file.write(card.TAIL)


def section(content: dict[str, Any]) -> str:
    """Markdown of the section."""
    facts = report.conditions(data=_data(content), seeds=str(content["config"]["seed"]))
    facts["versions"] += "".join(f", {name} {_version(name)}" for name in PACKAGES)
    facts["AMX"] = "yes" if _has_amx() else "no"
    facts["load when it began"] = f"{content['load']:.1f}"
    left_out = "\n".join(f"- {key}: {why}" for key, why in content["left_out"].items())
    missing = {
        f"{runtime}: {why}" for found in content["runtimes"].values()
        for runtime, why in found["missing"].items()
    }  # fmt: skip
    return f"""## Part segmentation

{_grid(tables.aims(content))}

Unless a table says otherwise, labels are judged at the network's size, 128 x 106; a pixel without a reading is background in the
truth, as the networks are taught. Non-background IoU: pixels with the right part, over those that
are person in truth or by label. Unless a row says otherwise the labels come from the runtime that a
user gets ({_used(content)}).

![scores over distance; frames of held-out people](segmentation.png)

{_grid(tables.counts(content))}

### Runtimes

Time of one frame of 512 x 424 with colour. Pixels that differ and the change of the IoU are against
the first runtime of the network, over {content["config"]["agreement_frames"]} frames with objects.

{tables.times(content).markdown()}

Not here: {"; ".join(sorted(missing)) or "-"}.

### Held-out people, motions and objects

The test part of the set of [Wan19], as it is and with a held-out object (desk chair, lamp) that
hides a third of the person; its farthest point lies 30, 45 or 60 cm before her nearest place.

{_grid(tables.accuracy(content))}

{_grid(tables.parts(content))}

The truth of a cell is the label of the reading that the network is shown there. A second look is judged
by the label in the middle of a cell, and its own cells lie askew to those: parts a few cells wide lose by
that. A tracker uses labels of the depth image's pixels, every other one of 512 x 424. At those:

{_grid(tables.of_pixels(content))}

### Real recordings

UTD-MHAD's people stand in views of redkitchen, alone and with held-out objects as above. Their
labels come from the geometric tracker's fit of the clean recording, both ways, and only from frames
in which the drop rule trusts it. Readings of a person, or of the stool she sits on, that the fit
does not explain count nowhere; "unknown as background" counts them as background.

{_grid(tables.composites(content))}

{_grid(tables.ablation(content))}

{_grid(tables.mask(content))}

Visible (above 0.8) joints of MediaPipe, an independent witness and not truth, against the label of
the pixel they fall into. Their own part: elbow and wrist the arm of their side; knee, ankle and
foot the leg; shoulder the arm or the torso and hip the leg or the torso, since the two meet there.
"Or 1 pixel beside" allows any of the eight neighbours. A pixel without depth is background by
definition; the columns "where depth reads" leave such joints out. The last row is what true labels
and true joints that nothing hides reach on the synthetic recordings.

{_grid(tables.witness(content))}

{_grid(tables.joints(content))}

![good, typical and bad frames of real recordings; joints off their part are red](segmentation_real.png)

Left out: {len(content["left_out"])}.
{left_out}

### Conditions

{report.bullets(facts)}
"""  # noqa: E501


def _grid(grid: tables.Grid) -> str:
    return f"**{grid.title}**\n\n{grid.markdown()}" if grid.rows else ""


def _used(content: dict[str, Any]) -> str:
    return ", ".join(dict.fromkeys(facts["runtime"] for facts in content["networks"].values()))


def _has_amx() -> bool:
    """Whether the processor multiplies matrices of int8 and bf16 by itself."""
    try:
        return "amx_int8" in Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        return False


def _version(name: str) -> str:
    import importlib.metadata

    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "none"


def _data(content: dict[str, Any]) -> str:
    config = content["config"]
    said = [f"test part of the `paper` set, {config['frames']} frames of each recording"]
    if len(content["labels"]) > 1:
        said.append(f"{config['real_recordings']} recordings of UTD-MHAD, {config['real_frames']} "
                    "frames of each")  # fmt: skip
    said += list(dict.fromkeys([*content["mask"], *content["witness"]]))
    return "; ".join(said)


if __name__ == "__main__":
    run(main)

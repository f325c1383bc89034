# SPDX-License-Identifier: Apache-2.0
"""Train weights to ship, or every network that the tables compare, with one command.

Data are made, networks trained one after the other in out/training/; a stopped run goes on.

    python tests/benchmarks/training.py ship
    python tests/benchmarks/training.py compare --prepared 100000

`compare` trains Fast-FCN, U-Net and VGG-FCN, Fast-FCN without inserted objects, and with other
weights of the background modifier, all on the same data and for as many steps, and writes
docs/results.md. What validates are people whom training does not see.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import report
from command import DATA, OUT, run
from matplotlib.figure import Figure

from kintrack.errors import DatasetError, ResultError
from kintrack.files import write_atomically
from segmentation.curves import LOG_FILE, read_log
from segmentation.train import WEIGHTS_FILE
from segmentation.weights import load_weights

FOLDER = OUT / "training"
PAPER_FRAMES, PAPER_PARTS = 120, ("paper/train", "paper/objects")
FULL_FRAMES, QUICK_FRAMES = 19_000, 60
"""Of the recipe `training`: 1,900 recordings, half an hour on two cores."""
LATER_SETS = {
    "training_1": ("training", 1, 5_000),
    "arms": ("arms", 0, 8_200),
    "sofas": ("sofas", 0, 1_500),
}
"""Sets of the last leg of what ships: recipe, seed, frames."""
STEPS = {"ship": 7_500, "compare": 20_000}
"""Usual length of each training; `ship` takes 4.3 h on two cores, filming and what follows it
included."""
BANK = ("--bank.cutouts", "3000", "--bank.rooms", "600")
"""Things and rooms to put into pictures, as many as for what ships."""
WIDTHS = {
    "fast_fcn": "32 64 192 512",
    "unet": "64 128 256 512 1024",
    "vgg_fcn": "64 128 256 512 512",
}
QUICK_WIDTHS = {"fast_fcn": "4 4 8 8", "unet": "4 4 8 8 8", "vgg_fcn": "4 4 8 8 8"}
LAMBDAS = (0.0, 1.0)
"""Weights of the background modifier, beside the usual 0.5."""
FIGURE = "training.png"
VALIDATIONS = 10
"""In the course of a run that is counted in steps."""
COLUMNS = ("pixel_accuracy", "background_iou", "non_background_iou", "person_iou", "mean_part_iou")


class Recipe(NamedTuple):
    """One training."""

    name: str
    """Folder of the run."""
    architecture: str
    """Which network."""
    options: tuple[str, ...] = ()
    """What is unlike the others."""
    widths: str = ""
    """Channels per level; those of `WIDTHS` if empty."""
    start: str = ""
    """Run whose weights it begins with; random ones if empty."""
    sets: tuple[str, ...] = ()
    """Datasets below out/training; those that all share if empty."""
    seed: int = 0
    """Added to the seed of the command."""


FIRST_LEG = Recipe(
    "ship",
    "unet",
    ("--background-weight", "0.25", "--augment.region", "0.6", "--augment.other-room", "0.2"),
    "32 64 128 256 512",
)
"""A U-Net of half the usual width: as many weights as Fast-FCN, and a logit sees the whole person,
which tells sides and things apart."""
SECOND_LEG = FIRST_LEG._replace(name="ship_again", start=FIRST_LEG.name, seed=1)
"""The same once more from its weights, with other draws and a warm restart of the learning rate
(Loshchilov & Hutter 2017) to half of its height."""
THIRD_LEG = SECOND_LEG._replace(
    name="ship_arms", start=SECOND_LEG.name, sets=tuple(LATER_SETS), seed=2
)
"""What ships: once more, on new takes, most of whose arms go anywhere, and on sofas. Authored arms
know a few dozen postures, and those of motions that were held out were labelled far worse."""
LATER_SHARE = 4_000 / STEPS["ship"]
"""Length of either, share of the first training's."""
COMPARED = (
    Recipe("fast_fcn", "fast_fcn"),
    Recipe("unet", "unet"),
    Recipe("vgg_fcn", "vgg_fcn"),
    Recipe("without_objects", "fast_fcn", ("--augment.inserted", "0")),
    *(Recipe(f"lambda_{weight:g}", "fast_fcn", ("--background-weight", f"{weight:g}"))
      for weight in LAMBDAS),
)  # fmt: skip


def main() -> int:
    """Make data, train, tell."""
    arguments = _arguments()
    folder = FOLDER.with_name("training_quick") if arguments.quick else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    if not arguments.sets:
        frames = QUICK_FRAMES if arguments.quick else arguments.frames
        _build(folder, arguments.data, frames, arguments.quick)
    steps = 4 if arguments.quick else arguments.steps
    if arguments.what == "ship":
        later = max(1, round(LATER_SHARE * steps))
        _train(folder, FIRST_LEG, steps, arguments)
        _train(folder, SECOND_LEG, later, arguments)
        if not arguments.sets:
            _build_later(folder, arguments.data, arguments.quick)
        print(f"written: {_train(folder, THIRD_LEG, later, arguments)}")
        return 0
    files = {recipe.name: _train(folder, recipe, steps, arguments) for recipe in COMPARED}
    tables = [recipe.name for recipe in COMPARED[:4]]
    pairs = " ".join(f"{name}={files[name]}" for name in tables)
    print(f"the tables: python tests/benchmarks/part_segmentation.py --weights {pairs}")
    if not arguments.quick:
        figure = _figure(files)
        write_atomically(report.RESULTS.with_name(FIGURE), lambda f: figure.savefig(f, dpi=150))
        report.rewrite_section(report.RESULTS, "training", _section(files, steps, arguments.seed))
        print(f"written: {report.RESULTS.relative_to(report.ROOT)}")
    return 0


def _arguments() -> argparse.Namespace:
    made = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    made.add_argument("what", choices=("ship", "compare"))
    made.add_argument("--data", type=Path, default=DATA, help="folder with mocap/")
    made.add_argument("--frames", type=int, default=FULL_FRAMES, help="of the recipe `training`")
    made.add_argument("--sets", nargs="+", help="train on datasets made before, below out/training")
    made.add_argument("--steps", type=int, help=f"length of each training, else {STEPS}")
    made.add_argument("--batch", type=int, default=16)
    made.add_argument("--rate", type=float, default=2e-3, help="highest learning rate")
    made.add_argument("--prepared", type=int, default=0, help="samples made once; 0: all anew")
    made.add_argument("--workers", type=int, default=1, help="processes that make samples")
    made.add_argument("--seed", type=int, default=0)
    made.add_argument("--processes", type=int, default=1, help="one for each core or GPU")
    made.add_argument("--quick", action="store_true", help="tiny networks; docs/ is left as it is")
    found = made.parse_args()
    found.steps = STEPS[found.what] if found.steps is None else found.steps
    if found.quick:
        found.prepared = 0
    for name in ("steps", "processes"):
        if getattr(found, name) < 1:
            raise ResultError(f"--{name} {getattr(found, name)}: at least 1 is needed")
    return found


def _build(folder: Path, data: Path, frames: int, quick: bool) -> None:
    """Both sets, or what is missing of them."""
    mocap = data / "mocap"
    if not mocap.is_dir():
        raise DatasetError(f"{mocap} is no folder: motion capture clips are needed there")
    _kintrack(folder, "dataset", "build", "training", "--recipe", "training", "--mocap",
              str(mocap), "--frames", str(frames))  # fmt: skip
    if not quick:
        _kintrack(folder, "dataset", "build", "paper", "--recipe", "paper", "--mocap", str(mocap),
                  "--frames", str(PAPER_FRAMES))  # fmt: skip


def _build_later(folder: Path, data: Path, quick: bool) -> None:
    """The sets of the last leg, or what is missing of them."""
    for name, (recipe, seed, frames) in LATER_SETS.items():
        _kintrack(folder, "dataset", "build", name, "--recipe", recipe, "--seed", str(seed),
                  "--mocap", str(data / "mocap"),
                  "--frames", str(QUICK_FRAMES if quick else frames))  # fmt: skip


def _train(folder: Path, recipe: Recipe, steps: int, arguments: argparse.Namespace) -> Path:
    """Weights of a run, which goes on where it was stopped."""
    path = folder / recipe.name / WEIGHTS_FILE
    usual = (QUICK_WIDTHS if arguments.quick else WIDTHS)[recipe.architecture]
    widths = usual if arguments.quick else recipe.widths or usual
    shared = ("training", *(() if arguments.quick else PAPER_PARTS))
    sets = arguments.sets or recipe.sets or shared
    if not path.is_file():
        bank = ("--bank.cutouts", "4", "--bank.rooms", "2") if arguments.quick else BANK
        threads = [] if arguments.processes == 1 else ["--threads", "1"]
        rate, seed, start = arguments.rate, arguments.seed + recipe.seed, []
        if recipe.start:
            rate, start = 0.5 * rate, ["--start", f"{recipe.start}/{WEIGHTS_FILE}"]
        _kintrack(
            folder, "train", *sets, "-o", recipe.name, "--cache", "cache",
            "--batch", str(arguments.batch), "--rate", str(rate), "--seed", str(seed),
            "--steps", str(steps), "--validation-steps", str(max(1, steps // VALIDATIONS)),
            "--prepared", str(arguments.prepared), "--workers", str(arguments.workers),
            "--network.architecture", recipe.architecture, "--network.widths", *widths.split(),
            *recipe.options, *start, *bank, *threads, processes=arguments.processes,
        )  # fmt: skip
    return path


def _kintrack(folder: Path, *words: str, processes: int = 1) -> None:
    """Run a command in a folder, so that weights files tell no paths beyond it."""
    command = [str(Path(sys.executable).with_name("kintrack")), *words]
    if processes > 1:
        launch = ["-m", "torch.distributed.run", "--standalone", "--nproc-per-node"]
        command = [sys.executable, *launch, str(processes), "--", *command]
    done = subprocess.run(command, cwd=folder, check=False)
    if done.returncode == 130:
        raise KeyboardInterrupt
    if done.returncode:
        raise ResultError(f"kintrack {' '.join(words)} ended with code {done.returncode}")


def _section(files: dict[str, Path], steps: int, seed: int) -> str:
    """Markdown of the section."""
    facts: dict[str, Any] = {name: load_weights(path).training for name, path in files.items()}
    rows = [
        [name.replace("_", " "), _widths(said), f"{said['config']['background_weight']:g}",
         f"{said['config']['augment']['inserted']:g}", f"{said['hours']:.2f}",
         *(f"{100 * said['validation'][key]:.1f}" for key in COLUMNS)]
        for name, said in facts.items()
    ]  # fmt: skip
    header = ["run", "widths", "lambda", "objects inserted", "hours",
              *(c.replace("_", " ") for c in COLUMNS)]  # fmt: skip
    first = next(iter(facts.values()))
    told = report.conditions(
        data=f"{', '.join(first['data'])}: {first['training_pictures']} pictures train, "
        f"{first['validation_pictures']} of other people validate",
        seeds=str(seed),
    )
    return f"""## Training

All networks on the same data for {steps} steps, scores [%] on people whom training does not see.

{report.table(header, rows)}

![loss and validation over steps]({FIGURE})

### Conditions

{report.bullets(told)}
"""


def _widths(said: dict[str, Any]) -> str:
    """Channels from the finest to the coarsest level."""
    return "/".join(str(width) for width in said["config"]["network"]["widths"])


def _figure(files: dict[str, Path]) -> Figure:
    """Loss and validation of every run, the last one after the end."""
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    loss, score = figure.subplots(1, 2)
    for name, path in files.items():
        entries, end = read_log(path.with_name(LOG_FILE)), load_weights(path).training
        losses = [(e["step"], e["loss"]) for e in entries if "loss" in e]
        scores = [(e["step"], 100 * e["validation"]["non_background_iou"])
                  for e in entries if "validation" in e]  # fmt: skip
        scores.append((end["steps"], 100 * end["validation"]["non_background_iou"]))
        loss.plot(*zip(*losses, strict=True), lw=0.8, label=name)
        score.plot(*zip(*scores, strict=True), "o-", ms=3, lw=1.2, label=name)
    loss.set(xlabel="step", ylabel="training loss", yscale="log")
    score.set(xlabel="step", ylabel="non-background IoU of validation [%]")
    for axis in (loss, score):
        axis.grid(alpha=0.3)
    score.legend(fontsize=7)
    return figure


if __name__ == "__main__":
    run(main)

# SPDX-License-Identifier: Apache-2.0
"""`kintrack train --from-recordings`: label, divide, fine-tune, compare, report."""

from __future__ import annotations

import os
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

from kintrack import __version__
from kintrack.commands.console import StepProgress, console
from kintrack.errors import ConfigError, DatasetError
from kintrack.geometry import camera_pose
from kintrack.labelling.several import Labelled, find_recordings, label_recordings, people_in

if TYPE_CHECKING:
    from kintrack.commands.train import Train
    from segmentation.recordings import Division

BANK_SHARE = 8
"""One object is drawn for judging for so many that are drawn for training."""
CELL = 60
"""Longest text in a cell of the terminal's tables; the files have all of it."""


def tune(options: Train, command: str) -> Path:
    """Label somebody's recordings and adapt weights to them.

    Args:
        options: The command's.
        command: What was typed, for the report and the weights file.

    Returns:
        The new weights file.

    Raises:
        KintrackError: if nothing usable is found, or another run is in the folder.
    """
    from segmentation.augment.bank import load_bank
    from segmentation.augment.sample import Bank
    from segmentation.before_after import FRAMES, compare, conditions
    from segmentation.dataset import Split
    from segmentation.pack import pack
    from segmentation.recordings import (
        divide,
        divided,
        mixed,
        split_others,
        tuning_config,
    )
    from segmentation.train import sources_of, train
    from segmentation.tuning_report import verdict_of, write_report
    from segmentation.weights import SHIPPED, load_weights

    if int(os.environ.get("WORLD_SIZE", 1)) > 1:
        raise ConfigError("--from-recordings runs in one process; start it without torchrun")
    if options.start is None and not SHIPPED.is_file():
        raise ConfigError("no weights to begin with: none are installed; give some with --start")
    start_path = options.start or SHIPPED
    start = load_weights(start_path)
    config = tuning_config(options.config, options.tuning, start)
    labelled, people, held = _label(options)
    usable = [one for one in labelled if one.kept]
    cache, frames = options.cache_folder, dict[str, int]()
    bank = fresh = Bank()
    with StepProgress() as show:
        packs = {}
        for n, one in enumerate(usable, start=1):
            packs[one.key] = cache / "own" / one.key
            frames[one.key] = pack(options.labels / one.key, packs[one.key])[0].frames
            show("packing your recordings", n, len(usable))
        division = divide(frames, people, options.tuning.held_out, held)
        others = []
        for root in options.data:
            others.append(options.pack_folder(root))
            pack(root, others[-1], partial(show, f"packing {root.name}"))
        if config.bank.cutouts or config.bank.rooms:
            bank = load_bank(options.bank_file(config.bank), config.bank,
                             partial(show, "rendering objects"))  # fmt: skip
            fewer = replace(
                config.bank,
                cutouts=-(-config.bank.cutouts // BANK_SHARE),
                rooms=-(-config.bank.rooms // BANK_SHARE),
                seed=config.bank.seed + 1,
            )
            fresh = load_bank(options.bank_file(fewer), fewer,
                              partial(show, "rendering objects to judge with"))  # fmt: skip
    sides = divided(packs, division, options.tuning.held_out)
    data, kept_apart = sides, None
    if others:
        other, kept_apart = split_others(others, config)
        data = Split(mixed(sides.train, other), sides.validation)
    length = f"{config.steps} steps" if config.steps else f"{60 * config.hours:.3g} minutes"
    console.print(f"{len(sides.train)} of your pictures train, {len(sides.validation)} are held "
                  f"out by {division.by}; training takes {length}")  # fmt: skip
    if division.caution:
        console.print(f"caution: {division.caution}", style="yellow")
    facts = {
        "data": sources_of([*options.from_recordings, *options.data]),
        "validation_data": sources_of(options.validation),
        "command": command,
        "start": start_path.name,
    }
    with options.bar() as bar:
        path = train(config, data, bank, options.output, facts, start, on_progress=bar)
    tuned = load_weights(path)
    judged = sides.validation.spread(FRAMES)
    parts = {name: (len(judged), sample_of)
             for name, sample_of in conditions(judged, fresh, config.seed).items()}  # fmt: skip
    if kept_apart is not None:
        rest = kept_apart.spread(FRAMES)
        parts |= {"other recordings": (len(rest), conditions(rest, Bank(), 0)["as recorded"])}
    with StepProgress() as show:
        compared, shown, runtime = compare(start, tuned, parts, 4, partial(show, "judging"))
    scores = [{"condition": one.name, "own": one.name != "other recordings",
               "pictures": one.pictures, "start": one.start.summary(),
               "tuned": one.tuned.summary()} for one in compared]  # fmt: skip
    content: dict[str, Any] = {
        "version": __version__,
        "command": command,
        "weights": path.name,
        "start": start_path.name,
        "verdict": verdict_of(scores),
        "recordings": _rows(labelled, people, division),
        "division": {"by": division.by, "caution": division.caution},
        "training": {
            "your pictures": len(sides.train),
            "other pictures": 0 if not others else len(other),
            "held-out pictures": len(sides.validation),
            "minutes": round(60 * float(tuned.training["hours"]), 2),
            "steps": tuned.training["steps"],
            "samples a step": config.batch,
            "labels computed by": runtime,
        },
        "scores": scores,
    }
    files = write_report(options.output, content, shown)
    print_report(content)
    console.print(f"written: {path}, {', '.join(file.name for file in files)}")
    return path


def _label(options: Train) -> tuple[tuple[Labelled, ...], dict[str, str], set[str]]:
    """Labels of all recordings, who is in them, and which of them the user holds out."""
    sources = find_recordings(options.from_recordings, options.output)
    aside = find_recordings(options.validation, options.output) if options.validation else []
    twice = {path.resolve() for path in sources} & {path.resolve() for path in aside}
    if twice:
        raise ConfigError(f"{min(twice)} is both to train and to validate; give it once")
    people = people_in([*sources, *aside], options.tuning.person)
    with StepProgress() as show:
        labelled = label_recordings(
            [*sources, *aside],
            options.labels,
            options.recording.open,
            T_world_camera=camera_pose(options.recording.camera_pitch_deg),
            on_progress=show,
        )
    usable = [one for one in labelled if one.kept]
    for one in labelled:
        if not one.kept:
            console.print(f"left out {one.name}: {one.problem}", style="yellow", markup=False)
    if not usable:
        raise DatasetError(
            f"none of {len(labelled)} recordings can be trained on; the first: "
            f"{labelled[0].problem}"
        )
    resolved = {path.resolve() for path in aside}
    held = {one.key for one in labelled if one.source.resolve() in resolved}
    return labelled, {one.key: people[one.source] for one in labelled if people}, held


def _rows(
    labelled: Sequence[Labelled], people: Mapping[str, str], division: Division
) -> list[dict[str, Any]]:
    def use(key: str) -> str:
        train, held = key in division.train, key in division.held
        return "both" if train and held else "train" if train else "judge" if held else "nothing"

    return [
        {"name": one.name, "person": people.get(one.key), "use": use(one.key),
         "frames": one.frames, "kept": one.kept, "reasons": one.reasons, "problem": one.problem}
        for one in labelled
    ]  # fmt: skip


def print_report(content: Mapping[str, Any]) -> None:
    """The report's tables and its verdict."""
    from segmentation.tuning_report import (
        RECORDING_HEADER,
        recording_rows,
        score_header,
        score_rows,
    )

    tables = (
        ("Recordings", RECORDING_HEADER, recording_rows(content)),
        ("Held out", score_header(content), score_rows(content)),
    )
    for title, header, rows in tables:
        table = Table(title=title, title_justify="left")
        for name in header:
            table.add_column(name, justify="right" if name in ("frames", "kept") else "left")
        for row in rows:
            table.add_row(*(Text(textwrap.shorten(cell, CELL)) for cell in row))
        console.print(table)
    console.print(content["verdict"])

# SPDX-License-Identifier: Apache-2.0
"""The model card: what the weights that ship are, how they were made, and how well they do."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

from kintrack.bench.segmentation.summary import settings
from kintrack.bench.segmentation.tables import (
    Grid,
    accuracy,
    aims,
    composites,
    mask,
    of_pixels,
    witness,
)
from segmentation.preprocess import SPECIFICATION

HEAD = """# Model card: the part segmentation that ships

What stands between two markers is written by `python tests/benchmarks/part_segmentation.py`; the
rest is written by hand and stays.

"""
TAIL = """
## Known failures

Not written yet. The lowest row of `segmentation.png` and the columns `bad` of
`segmentation_real.png` show where to look.
"""
"""How a card begins and ends that is not there yet."""


_PLACES = r"(?<![^\s=])/\S*/(?=\S)"
"""Folders in which something lay on the machine of the training."""


def card(content: Mapping[str, Any], curves: str | None) -> str:
    """The generated part of the card, for the first network of the bench.

    Args:
        content: Of `segmentation.json`.
        curves: File name of the picture of the training curves beside the card; None without.

    Returns:
        Markdown.
    """
    whole = dict(content)
    name = whole["order"][0]
    facts = whole["networks"][name]
    training = facts["training"]
    own = whole | {"labels": _only(whole["labels"], name), "mask": _only(whole["mask"], name),
                   "witness": _only(whole["witness"], name)}  # fmt: skip
    grids = [aims(whole), accuracy(own), of_pixels(own)]
    grids += [grid for grid in (composites(own), mask(own)) if grid.rows]
    if own["witness"]:
        grids.append(witness(own))
    picture = f"\n![loss and validation through training]({curves})\n" if curves else ""
    return f"""## What it is

{_bullets(_network(name, facts))}

It says for every pixel of a depth image, with or without colour, which part of a person it shows.
It is made to tell a tracker what to fit to. It does not tell people from each other or who
somebody is, and is no safety device.

## How it was trained

{_bullets(_training(training))}
{picture}
{_settings(training).markdown()}

## How well it does

Held-out people, motions and objects, and real recordings; none of them was trained on. What each
column means and how it was measured stands in `results.md`.

{_sections(grids)}
"""


def _network(name: str, facts: Mapping[str, Any]) -> dict[str, str]:
    return {
        "network": f"{name}, {facts['architecture']} of widths "
        f"{'/'.join(map(str, facts['widths']))}, {facts['parameters'] / 1e6:.2f} M parameters, "
        f"{facts['gflop']:.1f} GFLOP a frame",
        "input": SPECIFICATION,
        "file": f"{facts['bytes'] / 1e6:.1f} MB, SHA-256 `{facts['sha256']}`",
    }


def _training(training: Mapping[str, Any]) -> dict[str, str]:
    """Facts that training wrote into the weights; those that it did not are not listed."""
    words = {
        "data": "data",
        "validation_data": "validation data",
        "training_pictures": "training pictures",
        "validation_pictures": "validation pictures",
        "command": "command",
        "start": "begun from",
        "steps": "steps",
        "hours": "hours",
        "device": "device",
        "processes": "processes",
        "precision": "precision",
        "kintrack": "kintrack",
        "torch": "torch",
    }
    found = {word: _text(training[key]) for key, word in words.items() if training.get(key)}
    if isinstance(first := training.get("start"), Mapping):
        told = {word: first.get(word) for word in ("data", "steps", "device")}
        found["begun from"] = f"`{re.sub(_PLACES, '', str(first.get('command')))}`, " + ", ".join(
            f"{word} {_text(value)}" for word, value in told.items() if value
        )
    if "command" in found:
        found["command"] = f"`{re.sub(_PLACES, '', found['command'])}`"
    config = training.get("config")
    if isinstance(config, Mapping) and "seed" in config:
        found["seed"] = _text(config["seed"])
    if isinstance(training.get("validation"), Mapping):
        scores = training["validation"]
        found["validation while training"] = ", ".join(
            f"{key.replace('_', ' ')} {100 * value:.1f} %"
            for key, value in scores.items()
            if isinstance(value, (int, float))
        )
    return found or {"facts": "the weights file tells none"}


def _settings(training: Mapping[str, Any]) -> Grid:
    """Every setting of the training."""
    rows = [(key, _text(value)) for key, value in settings(training).items()]
    return Grid("Settings", ("setting", "value"), rows)


def _only(groups: Mapping[str, Any], name: str) -> dict[str, Any]:
    return {group: {name: networks[name]} for group, networks in groups.items() if name in networks}


def _bullets(facts: Mapping[str, str]) -> str:
    return "\n".join(f"- {name}: {value}" for name, value in facts.items())


def _text(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)


def _sections(grids: Sequence[Grid]) -> str:
    return "\n\n".join(f"### {grid.title}\n\n{grid.markdown()}" for grid in grids)

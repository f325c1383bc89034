# SPDX-License-Identifier: Apache-2.0
"""The command line: choose a command, run it, turn a caller's mistake into a message.

Only the command that is asked for is imported, so that help does not wait for what it does not
need.
"""

from __future__ import annotations

import sys
from dataclasses import make_dataclass
from functools import reduce
from importlib import import_module
from operator import or_
from typing import Any

import tyro

from kintrack.commands.console import errors
from kintrack.errors import KintrackError

COMMANDS = {
    "fit": "Fit the body to every frame of a recording.",
    "view": "Replay a result in a browser.",
    "export": "Write the surface of every tracked frame as PLY and glTF.",
    "evaluate": "Compare a result with reference joints.",
    "calibrate": "Learn a person's size and build from a recording, once.",
    "demo": "Fit the recording that ships, write its page and video, and compare with the truth.",
    "label": "Label the body parts in a clean recording of one person, dropping frames in doubt.",
    "occlude": "Insert an object, a real scene, or both into any recording, by depth.",
    "dataset": "Synthetic people in synthetic rooms: build a dataset or look at one.",
    "train": "Train the part segmentation on labelled recordings; a stopped run goes on.",
    "bench": "Measure on held-out people, motions and objects.",
    "model": "The human itself: build it, learn its postures, or draw it.",
}
"""First sentence of each command `name`, which is class `Name` of `kintrack.commands.name`."""


def main(arguments: list[str] | None = None) -> None:
    """Entry point: exit code 0, 2 for a caller's mistake, 130 for Ctrl-C."""
    arguments = sys.argv[1:] if arguments is None else arguments
    try:
        tyro.cli(commands(arguments), prog="kintrack", args=arguments).run()
    except KintrackError as error:
        errors.print(f"kintrack: {error}", style="red", highlight=False, markup=False)
        sys.exit(2)
    except KeyboardInterrupt:
        errors.print("stopped; what was done so far is written")
        sys.exit(130)


def commands(arguments: list[str]) -> Any:
    """The union of all commands: the chosen one as it is, of the others name and sentence.

    Args:
        arguments: What was typed; shell completion (`--tyro-...`) gets every command whole.
    """
    chosen = arguments[0] if arguments else ""
    everything = chosen.startswith("--tyro")
    return reduce(
        or_,
        (
            command(name) if everything or name == chosen else _named(name, sentence)
            for name, sentence in COMMANDS.items()
        ),
    )


def command(name: str) -> type:
    """The class of a command."""
    return getattr(import_module(f"kintrack.commands.{name}"), name.capitalize())


def _named(name: str, sentence: str) -> type:
    return make_dataclass(name.capitalize(), (), namespace={"__doc__": sentence})

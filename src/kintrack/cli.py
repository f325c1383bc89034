# SPDX-License-Identifier: Apache-2.0
"""The command line: choose a command, run it, turn a caller's mistake into a message."""

from __future__ import annotations

import sys

import tyro

from kintrack.commands.bench import Bench
from kintrack.commands.calibrate import Calibrate
from kintrack.commands.console import errors
from kintrack.commands.dataset import Dataset
from kintrack.commands.demo import Demo
from kintrack.commands.evaluate import Evaluate
from kintrack.commands.fit import Fit
from kintrack.commands.label import Label
from kintrack.commands.model import Model
from kintrack.commands.occlude import Occlude
from kintrack.commands.train import Train
from kintrack.commands.view import View
from kintrack.errors import KintrackError


def main(arguments: list[str] | None = None) -> None:
    """Entry point: exit code 0, 2 for a caller's mistake, 130 for Ctrl-C."""
    try:
        tyro.cli(
            Fit
            | View
            | Evaluate
            | Calibrate
            | Demo
            | Label
            | Occlude
            | Dataset
            | Train
            | Bench
            | Model,
            prog="kintrack",
            args=arguments,
        ).run()
    except KintrackError as error:
        errors.print(f"kintrack: {error}", style="red", highlight=False, markup=False)
        sys.exit(2)
    except KeyboardInterrupt:
        errors.print("stopped; what was done so far is written")
        sys.exit(130)

# SPDX-License-Identifier: Apache-2.0
"""`kintrack evaluate`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro

from kintrack.commands.console import console


@dataclass(frozen=True)
class Evaluate:
    """Compare a result with reference joints."""

    result: tyro.conf.Positional[Path]
    """Result folder or track.npz."""
    reference: tyro.conf.Positional[Path]
    """reference_joints.csv, a recording that holds one, or another result."""
    output: Path | None = None
    """Where evaluation.json and evaluation.png go; the result folder if not given."""
    truth: bool = False
    """The reference is exact, so distances are errors; otherwise they are agreement."""

    def run(self) -> None:
        """Print the table, write the JSON and the plot."""
        from kintrack.evaluation import evaluate, print_evaluation, write_evaluation

        folder = self.output or (self.result if self.result.is_dir() else self.result.parent)
        evaluation = evaluate(self.result, self.reference, reference_is_truth=self.truth)
        write_evaluation(evaluation, folder)
        print_evaluation(evaluation, console)
        console.print(f"written to {folder}/evaluation.json and .png")

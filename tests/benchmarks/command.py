# SPDX-License-Identifier: Apache-2.0
"""What the measuring commands have in common: where data lies, and how they end."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import baseline
from baseline import Metric
from report import ROOT, cpu_model

from kintrack.errors import KintrackError

DATA = ROOT.parent / "shared" / "data"
"""Where recordings are looked for if nothing else is said."""

OUT = ROOT / "out"
"""Where results go; git ignores it."""


def parser(says: str | None) -> argparse.ArgumentParser:
    """A parser with the options that every benchmark has."""
    made = argparse.ArgumentParser(
        description=says, formatter_class=argparse.ArgumentDefaultsHelpFormatter
    )
    made.add_argument("--data", type=Path, default=DATA, help="folder of the recordings")
    made.add_argument("--quick", action="store_true", help="a subset; docs/ is left as it is")
    made.add_argument("--check", action="store_true", help="compare with baseline.json")
    made.add_argument("--save-baseline", action="store_true", help="write baseline.json")
    return made


def settle(arguments: argparse.Namespace, group: str, metrics: Sequence[Metric]) -> int:
    """Compare with the baseline or make a new one, as the arguments say.

    Returns:
        Exit code: 1 if there is a regression, else 0.
    """
    if arguments.save_baseline:
        baseline.save(group, metrics)
        print(f"written: {baseline.BASELINE.relative_to(ROOT)}")
    if not arguments.check:
        return 0
    if (there := baseline.machine(group)) != cpu_model():
        print(f"note: the baseline was taken on another processor ({there})")
    regressions = baseline.check(group, metrics)
    for line in regressions:
        print(f"regression: {line}")
    print(f"{len(regressions)} regressions in {len(metrics)} metrics")
    return 1 if regressions else 0


def run(main: Callable[[], int]) -> None:
    """Run a benchmark: exit code 2 for a caller's mistake, 130 for Ctrl-C."""
    try:
        sys.exit(main())
    except KintrackError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print("stopped; finished recordings are kept, run again to go on", file=sys.stderr)
        sys.exit(130)


def refuse_quick_baseline(arguments: argparse.Namespace) -> None:
    """Pass unless a subset is asked to be or to meet the baseline.

    Raises:
        KintrackError: if it is.
    """
    if arguments.quick and (arguments.check or arguments.save_baseline):
        raise KintrackError("--quick measures a subset: not comparable with baseline.json")

# SPDX-License-Identifier: Apache-2.0
"""A result against reference joints: the numbers, a figure, two tables."""

from kintrack.evaluation.comparison import Evaluation, evaluate
from kintrack.evaluation.figure import plot_evaluation
from kintrack.evaluation.report import print_evaluation, write_evaluation

__all__ = [
    "Evaluation",
    "evaluate",
    "plot_evaluation",
    "print_evaluation",
    "write_evaluation",
]

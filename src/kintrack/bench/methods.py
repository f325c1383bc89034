# SPDX-License-Identifier: Apache-2.0
"""What the bench compares: every way to get joints from a recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from kintrack.fit import fit_sequence
from kintrack.sequence import open_sequence

Method = Callable[[Path, Path, Callable[[], None]], None]
"""Reads the first folder, writes a result into the second, and calls after every frame."""


def geometry(sequence: Path, result: Path, on_frame: Callable[[], None]) -> None:
    """The geometric tracker alone; it starts by itself on what it sees."""
    fit_sequence(open_sequence(sequence), result, on_frame=lambda frame, found: on_frame())


METHODS: dict[str, Method] = {"geometry": geometry}
"""Every method by name."""

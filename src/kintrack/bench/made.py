# SPDX-License-Identifier: Apache-2.0
"""Whether a folder that the bench makes is there, whole, and still what is asked for."""

from __future__ import annotations

import hashlib
from pathlib import Path

MADE_FILE = "made.txt"
"""Tells what a recording was made of, written when it is whole."""


def recipe_of(*facts: object) -> str:
    """What a folder must have been made of: a digest of facts that print themselves."""
    return hashlib.sha256(repr(facts).encode()).hexdigest() + "\n"


def is_made(folder: Path, recipe: str) -> bool:
    """Whether a folder is whole and made of what is asked for."""
    try:
        return (folder / MADE_FILE).read_text() == recipe
    except OSError:
        return False


def finish(folder: Path, recipe: str) -> None:
    """Say that a folder is whole."""
    (folder / MADE_FILE).write_text(recipe)

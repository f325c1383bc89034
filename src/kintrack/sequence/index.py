# SPDX-License-Identifier: Apache-2.0
"""Index files ("timestamp_s file" lines) and the pairing of two of them by time."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import SequenceError


@dataclass(frozen=True)
class IndexEntry:
    """One line of an index file."""

    timestamp_s: float
    """Time stamp [s]."""
    path: Path
    """The image, resolved against the index file's folder; it may be missing."""
    line: int
    """Line number in the index file, from 1."""


def read_index(path: Path) -> list[IndexEntry]:
    """Entries of an index file in its own order; empty lines and '#' comments are skipped.

    Args:
        path: The index file.

    Returns:
        At least one entry.

    Raises:
        SequenceError: if the file cannot be read, lists nothing, or has a line that is not a
            finite number followed by a file name.
    """
    try:
        text = path.read_text(encoding="utf-8-sig", errors="replace")
    except OSError as error:
        raise SequenceError(f"index {path} cannot be read: {error.strerror}") from error
    entries = [
        _parse(line.strip(), number, path)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not entries:
        raise SequenceError(f"index {path} lists no frame; needed: 'timestamp_s file' lines")
    return entries


def read_ordered_index(path: Path) -> list[IndexEntry]:
    """Entries of an index file whose time stamps must increase strictly.

    Args:
        path: The index file.

    Returns:
        At least one entry.

    Raises:
        SequenceError: as `read_index`, and if a time stamp is not above the one before.
    """
    entries = read_index(path)
    for before, after in pairwise(entries):
        if after.timestamp_s <= before.timestamp_s:
            raise SequenceError(
                f"index {path}, line {after.line}: time stamp {after.timestamp_s!r} s does not "
                f"come after {before.timestamp_s!r} s of line {before.line}; "
                "they must increase strictly"
            )
    return entries


def associate(
    times_s: Float[ndarray, " n"], other_times_s: Float[ndarray, " m"], tolerance_s: float
) -> list[int | None]:
    """Pair two lists of time stamps one to one, closest pairs first, as TUM's `associate.py` does.

    Args:
        times_s: Time stamps to find partners for [s], shape (N,).
        other_times_s: Their possible partners, in any order [s], shape (M,).
        tolerance_s: A pair must lie closer than this [s].

    Returns:
        For each of the N the index of its partner, or None.
    """
    order = np.argsort(other_times_s, kind="stable")
    begin = np.searchsorted(other_times_s, times_s - tolerance_s, side="right", sorter=order)
    end = np.searchsorted(other_times_s, times_s + tolerance_s, side="left", sorter=order)
    close = [
        (abs(times_s[i] - other_times_s[j]), i, int(j))
        for i in range(len(times_s))
        for j in order[begin[i] : end[i]]
    ]
    partners: list[int | None] = [None] * len(times_s)
    taken: set[int] = set()
    for _, i, j in sorted(close):
        if partners[i] is None and j not in taken:
            partners[i] = j
            taken.add(j)
    return partners


def pair_colors(depth: list[IndexEntry], rgb_index: Path, tolerance_s: float) -> list[Path | None]:
    """The colour image of each depth image, by time.

    Args:
        depth: Entries of the depth index, N of them.
        rgb_index: The colour index; a missing one means a recording without colour.
        tolerance_s: A pair must lie closer than this [s].

    Returns:
        N paths; None where no colour image is close enough.

    Raises:
        SequenceError: if the colour index is broken.
    """
    if not rgb_index.is_file():
        return [None] * len(depth)
    rgb = read_index(rgb_index)
    partners = associate(timestamps(depth), timestamps(rgb), tolerance_s)
    return [None if j is None else rgb[j].path for j in partners]


def timestamps(entries: list[IndexEntry]) -> Float[ndarray, " n"]:
    """Time stamps of entries [s], shape (N,)."""
    return np.array([entry.timestamp_s for entry in entries])


def _parse(line: str, number: int, path: Path) -> IndexEntry:
    stamp, _, name = line.partition(" ") if " " in line else line.partition("\t")
    try:
        timestamp_s = float(stamp)
    except ValueError:
        timestamp_s = math.nan
    if not math.isfinite(timestamp_s) or not name.strip() or "\0" in name:
        raise SequenceError(
            f"index {path}, line {number}: {line!r} is not 'timestamp_s file', "
            "for example '0.033333 depth/000001.png'"
        )
    return IndexEntry(timestamp_s, path.parent / name.strip(), number)

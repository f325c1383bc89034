# SPDX-License-Identifier: Apache-2.0
"""The files of a pack: small pictures one after the other, and a line per recording.

Pictures lie in three raw files, and `sequences.jsonl` says which rows are whose. Recordings are
added in order, each line after its pictures, so that a pack is whole up to its last line.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from kintrack.errors import DatasetError
from kintrack.files import write_json
from segmentation.picture import HEIGHT, WIDTH, Picture

DEPTH_UNIT_M = 0.00025
"""Metres per unit of packed depth: 16 bits reach 16.4 m."""
HEADER = {"version": 3, "width": WIDTH, "height": HEIGHT, "depth_unit_m": DEPTH_UNIT_M}
HEADER_FILE, INDEX_FILE = "pack.json", "sequences.jsonl"


class Planes(NamedTuple):
    """The raw files of a pack, one row a picture."""

    depth: ndarray
    """(n, 159, 192) uint16, units of `DEPTH_UNIT_M`, 0 = no reading."""
    color: ndarray
    """(n, 159, 192, 3) uint8."""
    labels: ndarray
    """(n, 159, 192) uint8."""


ROW = {"depth": ((HEIGHT, WIDTH), "<u2"), "color": ((HEIGHT, WIDTH, 3), "u1"),
       "labels": ((HEIGHT, WIDTH), "u1")}  # fmt: skip
"""Shape and type of a picture's row in each file."""


@dataclass(frozen=True)
class Packed:
    """One recording of a pack."""

    name: str
    """Its folder, relative to the root."""
    fingerprint: str
    """Changes when the recording does."""
    start: int
    """Row of its first picture."""
    frames: int
    """Its pictures; 0 if none of its frames can be used."""
    columns: int
    """Width of its pictures [px]."""
    rows: int
    """Height of its pictures [px]."""
    focal_px: float
    """Focal length in pixels of its pictures [px]."""
    colored: tuple[bool, ...]
    """Whether each picture has colour."""
    person_shares: tuple[float, ...]
    """Share of each picture that is the person."""
    skipped: int
    """Frames without labels or with broken depth."""
    facts: dict[str, Any] = field(default_factory=dict)
    """What the recording says of itself."""


def open_pack(folder: Path) -> tuple[list[Packed], Planes]:
    """The recordings of a pack, and its pictures, which are read when they are looked at.

    Raises:
        DatasetError: if it is missing or broken.
    """
    try:
        _check_header(folder)
        entries = list(_index(folder))
        count = sum(entry.frames for entry in entries)
        planes = {
            name: np.memmap(folder / f"{name}.raw", dtype, "r", shape=(count, *shape))
            for name, (shape, dtype) in ROW.items()
        }
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise DatasetError(f"{folder} holds no whole pack ({error}); remove it") from error
    return entries, Planes(**planes)


def picture(entry: Packed, planes: Planes, index: int) -> Picture:
    """One picture of a recording."""
    at = (entry.start + index, slice(entry.rows), slice(entry.columns))
    depth = planes.depth[at].astype(np.float32) * np.float32(DEPTH_UNIT_M)
    color = np.array(planes.color[at]) if entry.colored[index] else None
    return Picture(depth, color, np.array(planes.labels[at]), entry.focal_px)


def kept(folder: Path, wanted: list[tuple[str, str]]) -> list[Packed]:
    """The recordings at the index's beginning that are whole and still what they were.

    Args:
        folder: Where the pack lies or will lie.
        wanted: Name and fingerprint of every recording, in order.
    """
    found: list[Packed] = []
    try:
        _check_header(folder)
        there = min(_size(folder / f"{name}.raw") // _bytes(name) for name in ROW)
        for entry, source in zip(_index(folder), wanted, strict=False):
            if (entry.name, entry.fingerprint) != source or entry.start + entry.frames > there:
                break
            found.append(entry)
    except (OSError, ValueError, TypeError, KeyError):
        pass
    return found


def begin(folder: Path, source: str, entries: Sequence[Packed]) -> None:
    """Make a pack of these recordings, or drop what lies behind them.

    Args:
        folder: Where the pack lies; made where missing.
        source: What the pack is of, for its header.
        entries: Recordings that are there already and stay.

    Raises:
        OSError: if it cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    (folder / INDEX_FILE).write_text("".join(_line(entry) for entry in entries), encoding="utf-8")
    rows = sum(entry.frames for entry in entries)
    for name in ROW:
        with (folder / f"{name}.raw").open("ab") as file:
            file.truncate(rows * _bytes(name))
    write_json(folder / HEADER_FILE, {**HEADER, "source": source})


def append(folder: Path, entry: Packed, pictures: Sequence[Picture]) -> None:
    """Add one recording behind the others.

    Raises:
        OSError: if it cannot be written.
    """
    for plane, (shape, dtype) in ROW.items():
        rows = np.zeros((len(pictures), *shape), dtype)
        for row, one in zip(rows, pictures, strict=True):
            value = one.depth_m if plane == "depth" else getattr(one, plane)
            if plane == "depth":
                value = np.clip(np.rint(one.depth_m / DEPTH_UNIT_M), 0, 65535)
            if value is not None:
                row[: value.shape[0], : value.shape[1]] = value
        with (folder / f"{plane}.raw").open("ab") as file:
            file.write(rows.tobytes())
            file.flush()
            os.fsync(file.fileno())
    with (folder / INDEX_FILE).open("a", encoding="utf-8") as file:
        file.write(_line(entry))


def _check_header(folder: Path) -> None:
    header = json.loads((folder / HEADER_FILE).read_text())
    if {key: header.get(key) for key in HEADER} != HEADER:
        raise ValueError(f"it says {header}, {HEADER} is needed")


def _index(folder: Path) -> Iterator[Packed]:
    path = folder / INDEX_FILE
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        fields = json.loads(line)
        for name in ("colored", "person_shares"):
            fields[name] = tuple(fields[name])
        yield Packed(**fields)


def _bytes(name: str) -> int:
    shape, dtype = ROW[name]
    return int(np.prod(shape)) * np.dtype(dtype).itemsize


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0


def _line(entry: Packed) -> str:
    return json.dumps(asdict(entry)) + "\n"

# SPDX-License-Identifier: Apache-2.0
"""Labelled recordings reduced once to small pictures, from which training draws its samples.

A picture fits 192 x 159, 1.5 times the network's, so that a crop stays sharp. Pictures lie one
after the other in three raw files; a line per recording in `sequences.jsonl` says where. Recordings
are added in order, each line after its pictures: a packing that was stopped goes on where it was,
and from the first recording that has changed since.
"""

from __future__ import annotations

import json
import os
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from numpy import ndarray

from kintrack.errors import DatasetError, KintrackError
from kintrack.result import write_json
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.sequence.images import read_labels
from kintrack.sequence.recording import Recording
from segmentation.labels import BACKGROUND, IGNORED
from segmentation.picture import HEIGHT, WIDTH, Picture, checked, reduced

DEPTH_UNIT_M = 0.00025
"""Metres per unit of packed depth: 16 bits reach 16.4 m."""
HEADER = {"version": 2, "width": WIDTH, "height": HEIGHT, "depth_unit_m": DEPTH_UNIT_M}
HEADER_FILE, INDEX_FILE = "pack.json", "sequences.jsonl"
FACTS = ("part", "person", "action", "sensor")
"""What is kept of a synthetic take's description."""
READERS = min(16, os.cpu_count() or 1)
"""Recordings that are decoded and reduced at a time."""


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


def recordings_in(root: Path) -> list[Path]:
    """The folder itself if it is a recording, else all recordings below it, sorted by name.

    Raises:
        DatasetError: if there is none.
    """
    if not root.is_dir():
        raise DatasetError(f"{root} is no folder; needed: a recording, or a folder of recordings")
    if (root / "depth.txt").is_file():
        return [root]
    found = sorted(path.parent for path in root.rglob("depth.txt"))
    found = [p for p in found if not any(x.startswith(".") for x in p.relative_to(root).parts)]
    if not found:
        raise DatasetError(f"{root} holds no recording: no folder below it has a depth.txt")
    return found


def pack(
    root: Path, folder: Path, on_progress: Callable[[int, int], None] = lambda done, total: None
) -> list[Packed]:
    """Pack a recording, or all below a folder; what is packed already is kept.

    Args:
        root: Recording or folder of recordings.
        folder: Where the pack lies; made where missing.
        on_progress: Called with recordings done and in all.

    Returns:
        The recordings, in the order of their names.

    Raises:
        DatasetError: if there is no labelled frame with a person, a label image is not what it
            must be, or the pack cannot be written.
    """
    sources = recordings_in(root)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        done = _kept(folder, [(_name(path, root), _fingerprint(path)) for path in sources])
        start = sum(entry.frames for entry in done)
        _cut(folder, done, start)
        write_json(folder / HEADER_FILE, {**HEADER, "source": root.name})
        on_progress(len(done), len(sources))
        for path, recording in _read_ahead(sources[len(done) :]):
            done.append(_add(recording, path, _name(path, root), folder, start))
            start += done[-1].frames
            on_progress(len(done), len(sources))
    except OSError as error:
        raise DatasetError(f"{folder}: recordings cannot be packed there ({error})") from error
    if not any(any(entry.person_shares) for entry in done):
        raise DatasetError(
            f"{root}: none of {len(done)} recordings has a frame with depth and a labelled person; "
            "kintrack label makes labels, kintrack dataset build recordings with labels"
        )
    return done


def open_pack(folder: Path) -> tuple[list[Packed], Planes]:
    """The recordings of a pack, and its pictures, which are read when they are looked at.

    Raises:
        DatasetError: if it is missing or broken.
    """
    try:
        header = json.loads((folder / HEADER_FILE).read_text())
        if {key: header.get(key) for key in HEADER} != HEADER:
            raise ValueError(f"it says {header}, {HEADER} is needed")
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


def _name(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def _fingerprint(path: Path) -> str:
    """Of the index and of names, sizes and times of the label images."""
    crc = zlib.crc32((path / "depth.txt").read_bytes())
    for label in sorted((path / "labels").glob("*.png")):
        facts = label.stat()
        crc = zlib.crc32(f"{label.name} {facts.st_size} {facts.st_mtime_ns}".encode(), crc)
    return f"{crc:08x}"


def _index(folder: Path) -> Iterator[Packed]:
    path = folder / INDEX_FILE
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        fields = json.loads(line)
        for name in ("colored", "person_shares"):
            fields[name] = tuple(fields[name])
        yield Packed(**fields)


def _kept(folder: Path, wanted: list[tuple[str, str]]) -> list[Packed]:
    """The recordings at the index's beginning that are whole and still what they were."""
    kept: list[Packed] = []
    try:
        header = json.loads((folder / HEADER_FILE).read_text())
        if {key: header.get(key) for key in HEADER} != HEADER:
            return []
        there = min(_size(folder / f"{name}.raw") // _bytes(name) for name in ROW)
        for entry, source in zip(_index(folder), wanted, strict=False):
            if (entry.name, entry.fingerprint) != source or entry.start + entry.frames > there:
                break
            kept.append(entry)
    except (OSError, ValueError, TypeError, KeyError):
        pass
    return kept


def _cut(folder: Path, kept: list[Packed], rows: int) -> None:
    """Drop what lies behind the recordings that are kept."""
    (folder / INDEX_FILE).write_text("".join(_line(entry) for entry in kept), encoding="utf-8")
    for name in ROW:
        with (folder / f"{name}.raw").open("ab") as file:
            file.truncate(rows * _bytes(name))


def _bytes(name: str) -> int:
    shape, dtype = ROW[name]
    return int(np.prod(shape)) * np.dtype(dtype).itemsize


def _size(path: Path) -> int:
    return path.stat().st_size if path.is_file() else 0


def _line(entry: Packed) -> str:
    return json.dumps(asdict(entry)) + "\n"


class Reduced(NamedTuple):
    """A recording as it is packed."""

    fingerprint: str
    """Of the recording before it was read."""
    pictures: list[Picture]
    """Its usable frames."""
    skipped: int
    """Frames without labels or with broken depth."""


def _read_ahead(paths: list[Path]) -> Iterator[tuple[Path, Reduced]]:
    """Recordings in order, some of them read before they are asked for."""
    with ThreadPoolExecutor(READERS) as pool:
        waiting: deque[Future[Reduced]] = deque()
        for n, path in enumerate(paths):
            while len(waiting) < min(2 * READERS, len(paths) - n):
                waiting.append(pool.submit(_reduced, paths[n + len(waiting)]))
            try:
                yield path, waiting.popleft().result()
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise


def _reduced(path: Path) -> Reduced:
    fingerprint = _fingerprint(path)
    recording = cast(Recording, open_sequence(path))
    pictures = []
    for number, files in enumerate(recording.files):
        if files.labels is not None:
            one = _read(recording, path, number)
            pictures += [] if one is None else [one]
    return Reduced(fingerprint, pictures, len(recording) - len(pictures))


def _add(recording: Reduced, path: Path, name: str, folder: Path, start: int) -> Packed:
    """Pack one recording behind the others."""
    pictures = recording.pictures
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
    height, width = pictures[0].depth_m.shape if pictures else (0, 0)
    entry = Packed(
        name=name,
        fingerprint=recording.fingerprint,
        start=start,
        frames=len(pictures),
        columns=width,
        rows=height,
        focal_px=pictures[0].focal_px if pictures else 0.0,
        colored=tuple(one.color is not None for one in pictures),
        person_shares=tuple(round(float(_is_person(one.labels).mean()), 5) for one in pictures),
        skipped=recording.skipped,
        facts=_facts(path),
    )
    with (folder / INDEX_FILE).open("a", encoding="utf-8") as file:
        file.write(_line(entry))
    return entry


def _read(recording: Recording, path: Path, number: int) -> Picture | None:
    """A frame as it is packed; none if its depth is broken."""
    frame = recording.frame(number)
    if frame.depth_m is None:
        _complain_of_labels(recording, frame)
        return None
    checked(frame, path)
    assert frame.labels is not None
    return reduced(frame.depth_m, frame.color, frame.labels, recording.camera.fx)


def _is_person(labels: ndarray) -> ndarray:
    return (labels != BACKGROUND) & (labels != IGNORED)


def _complain_of_labels(recording: Recording, frame: Frame) -> None:
    """Raise if it is the labels that make a frame unusable; broken depth is only left out."""
    path = recording.files[frame.index].labels
    assert path is not None
    try:
        read_labels(path, recording.camera)
    except KintrackError as error:
        raise DatasetError(str(error)) from None


def _facts(path: Path) -> dict[str, Any]:
    try:
        take = json.loads((path / "take.json").read_text(encoding="utf-8"))["take"]
        return {key: take[key] for key in FACTS if key in take}
    except (OSError, ValueError, KeyError, TypeError):
        return {}

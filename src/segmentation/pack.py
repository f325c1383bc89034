# SPDX-License-Identifier: Apache-2.0
"""Labelled recordings reduced once to small pictures, from which training draws its samples.

A picture fits 192 x 159, 1.5 times the network's, so that a crop stays sharp. Recordings are added
in order: a packing that was stopped goes on where it was, and from the first recording that has
changed since.
"""

from __future__ import annotations

import json
import os
import zlib
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, cast

from kintrack.errors import DatasetError, KintrackError
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.sequence.images import read_labels
from kintrack.sequence.recording import Recording
from segmentation.labels import person_of
from segmentation.pack_files import Packed, append, begin, kept
from segmentation.picture import Picture, checked, reduced

FACTS = ("part", "person", "action", "sensor")
"""What is kept of a synthetic take's description."""
READERS = min(16, os.cpu_count() or 1)
"""Recordings that are decoded and reduced at a time."""


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
        done = kept(folder, [(_name(path, root), _fingerprint(path)) for path in sources])
        begin(folder, root.name, done)
        start = sum(entry.frames for entry in done)
        on_progress(len(done), len(sources))
        for path, recording in _read_ahead(sources[len(done) :]):
            done.append(_entry(recording, path, _name(path, root), start))
            append(folder, done[-1], recording.pictures)
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


def _name(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()


def _fingerprint(path: Path) -> str:
    """Of the index and of names, sizes and times of the label images."""
    crc = zlib.crc32((path / "depth.txt").read_bytes())
    for label in sorted((path / "labels").glob("*.png")):
        facts = label.stat()
        crc = zlib.crc32(f"{label.name} {facts.st_size} {facts.st_mtime_ns}".encode(), crc)
    return f"{crc:08x}"


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


def _entry(recording: Reduced, path: Path, name: str, start: int) -> Packed:
    pictures = recording.pictures
    height, width = pictures[0].depth_m.shape if pictures else (0, 0)
    return Packed(
        name=name,
        fingerprint=recording.fingerprint,
        start=start,
        frames=len(pictures),
        columns=width,
        rows=height,
        focal_px=pictures[0].focal_px if pictures else 0.0,
        colored=tuple(one.color is not None for one in pictures),
        person_shares=tuple(round(float(person_of(one.labels).mean()), 5) for one in pictures),
        skipped=recording.skipped,
        facts=_facts(path),
    )


def _read(recording: Recording, path: Path, number: int) -> Picture | None:
    """A frame as it is packed; none if its depth is broken."""
    frame = recording.frame(number)
    if frame.depth_m is None:
        _complain_of_labels(recording, frame)
        return None
    checked(frame, path)
    assert frame.labels is not None
    return reduced(frame.depth_m, frame.color, frame.labels, recording.camera.fx)


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

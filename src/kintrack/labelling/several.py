# SPDX-License-Identifier: Apache-2.0
"""Many recordings labelled into one folder, in which a run that was stopped goes on.

Each recording gets a sequence folder of its kept frames, and beside it a file that says what became
of it. Neither is made again while the recording, the tracker and the drop rule stay as they are.
"""

from __future__ import annotations

import json
import re
import shutil
import zlib
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, cast

from jaxtyping import Float
from numpy import ndarray

from kintrack import __version__
from kintrack.config import TrackerConfig
from kintrack.errors import ConfigError, DatasetError, KintrackError
from kintrack.files import write_json
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.labelling.opinions import LabellingConfig
from kintrack.labelling.sequence import label_sequence
from kintrack.sequence import SequenceReader, open_sequence
from kintrack.sequence.recording import Recording

MARKS = ("depth.txt", "intrinsic.json")
"""A folder with one of these is a recording."""
STAGES = {"finding the person": (0.0, 0.1), "tracking": (0.1, 0.9), "judging": (0.9, 0.95),
          "labelling": (0.95, 1.0)}  # fmt: skip
"""About which share of the work each stage of labelling begins and ends at."""
VERSION = 1


@dataclass(frozen=True)
class Labelled:
    """What became of a recording."""

    name: str
    """Its folder's name, with that of the folder above where two have the same."""
    key: str
    """Name of its folder of labelled frames; unique."""
    source: Path
    """The recording."""
    frames: int = 0
    """Frames that it lists."""
    kept: int = 0
    """Frames whose labels are kept."""
    reasons: dict[str, int] = field(default_factory=dict)
    """Kind of reason -> dropped frames that have it."""
    problem: str = ""
    """Why nothing of it is kept; empty if something is."""


def find_recordings(roots: Sequence[Path], beside: Path | None = None) -> list[Path]:
    """Recordings among folders and below them, sorted by name in each, none twice.

    Args:
        roots: Recordings, or folders of recordings.
        beside: A folder in which nothing is looked for: that of the run itself.

    Raises:
        DatasetError: if one of the folders holds none.
    """
    found: dict[Path, Path] = {}
    for root in roots:
        if not root.is_dir():
            raise DatasetError(f"{root} is no folder; needed: a recording, or a folder of them")
        marked = {path.parent for mark in MARKS for path in root.rglob(mark)}
        below = sorted(path for path in marked if not _hidden(path, root, beside))
        if root in marked:
            below = [root]
        if not below:
            raise DatasetError(
                f"{root} holds no recording: no folder in it has a {' or '.join(MARKS)}"
            )
        for path in below:
            found.setdefault(path.resolve(), path)
    return list(found.values())


def people_in(sources: Sequence[Path], pattern: str) -> dict[Path, str]:
    """Who is in each recording, by its path.

    Args:
        sources: Recordings.
        pattern: Regular expression that is searched in the path; its first group, or all that it
            finds, names the person. Empty if nobody knows.

    Returns:
        Recording -> person; nothing without a pattern.

    Raises:
        ConfigError: if the pattern is none, or finds nobody in a path.
    """
    if not pattern:
        return {}
    try:
        search = re.compile(pattern).search
    except re.error as error:
        raise ConfigError(f"person = {pattern!r} is no regular expression: {error}") from None
    matches = {path: search(path.resolve().as_posix()) for path in sources}
    if unknown := [path for path, match in matches.items() if match is None]:
        raise ConfigError(
            f"person = {pattern!r} is not found in {unknown[0]} ({len(unknown)} of {len(sources)} "
            "recordings); it must name the person in every path"
        )
    return {
        path: match[1] if match.re.groups else match[0] for path, match in matches.items() if match
    }


def label_recordings(
    sources: Sequence[Path],
    folder: Path,
    opener: Callable[[Path], SequenceReader] = open_sequence,
    config: LabellingConfig | None = None,
    tracker: TrackerConfig | None = None,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    on_progress: Callable[[str, int, int], None] = lambda what, done, total: None,
) -> tuple[Labelled, ...]:
    """Label recordings; one that cannot be read or of which no frame is kept is passed over.

    Args:
        sources: Recordings, each of one person with nothing in front.
        folder: Where the labelled frames go: a sequence folder per recording.
        opener: Opens a recording.
        config: Tolerances and thresholds; the defaults if None.
        tracker: The tracker; the defaults if None.
        T_world_camera: Camera pose of all of them; a level camera if not given.
        on_progress: Called with what is done, frames done and frames in all.

    Returns:
        What became of each, in the order given.
    """
    config, tracker = config or LabellingConfig(), tracker or TrackerConfig()
    names = _names(sources)
    opened: list[Recording | KintrackError] = [_opened(path, opener) for path in sources]
    total = sum(len(one) for one in opened if isinstance(one, Recording))
    settings = zlib.crc32(json.dumps([VERSION, __version__, asdict(config), asdict(tracker),
                                      T_world_camera.tolist()], default=str).encode())  # fmt: skip
    found: list[Labelled] = []
    before = 0
    for path, name, recording in zip(sources, names, opened, strict=True):
        key = f"{path.resolve().name}-{zlib.crc32(str(path.resolve()).encode()):08x}"
        if not isinstance(recording, Recording):
            found.append(Labelled(name, key, path, problem=str(recording)))
            continue

        def show(stage: str, done: int, of: int, start: int = before, n: int = len(recording)):
            first, last = STAGES[stage]
            on_progress("labelling", start + int(n * (first + (last - first) * done / of)), total)

        fingerprint = f"{_fingerprint(recording, settings):08x}"
        labelled = _remembered(folder, Labelled(name, key, path, len(recording)), fingerprint)
        if labelled is None:
            labelled = _label(recording, Labelled(name, key, path, len(recording)), folder,
                              fingerprint, config, tracker, T_world_camera, show)  # fmt: skip
        found.append(labelled)
        before += len(recording)
        on_progress("labelling", before, total)
    return tuple(found)


def _label(recording, blank, folder, fingerprint, config, tracker, T, show) -> Labelled:
    """Label into a hidden folder that takes its name once it is whole."""
    part, whole = folder / f".{blank.key}", folder / blank.key
    for old in (part, whole):
        shutil.rmtree(old, ignore_errors=True)
    stages: list[tuple[str, int, int]] = []

    def step(stage: str, done: int, of: int) -> None:
        stages[:] = [(stage, done, of)]
        show(stage, done, of)

    facts: dict[str, Any]
    try:
        report = label_sequence(recording, part, config, tracker, T, on_progress=step)
    except KintrackError as error:
        judged = stages == [("labelling", blank.frames, blank.frames)] and not part.exists()
        facts = {"kept": 0, "reasons": {}, "problem": str(error)}
        shutil.rmtree(part, ignore_errors=True)
        if not judged:
            return Labelled(blank.name, blank.key, blank.source, blank.frames, **facts)
    else:
        facts = {"kept": report.kept, "reasons": report.summary()["reasons"], "problem": ""}
        part.rename(whole)
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / f"{blank.key}.json", {"fingerprint": fingerprint, **facts})
    return Labelled(blank.name, blank.key, blank.source, blank.frames, **facts)


def _remembered(folder: Path, blank: Labelled, fingerprint: str) -> Labelled | None:
    """What became of a recording in an earlier run; None if it must be labelled."""
    try:
        facts = json.loads((folder / f"{blank.key}.json").read_text(encoding="utf-8"))
        fits = facts.pop("fingerprint") == fingerprint
        made = Labelled(blank.name, blank.key, blank.source, blank.frames, **facts)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    there = not made.kept or (folder / blank.key / "depth.txt").is_file()
    return made if fits and there else None


def _opened(path: Path, opener: Callable[[Path], SequenceReader]) -> Recording | KintrackError:
    try:
        return cast(Recording, opener(path))
    except KintrackError as error:
        return error


def _fingerprint(recording: Recording, settings: int) -> int:
    """Changes when the camera, an image or a setting does."""
    crc = zlib.crc32(f"{recording.camera} {recording.depth_scale_m}".encode(), settings)
    for files in recording.files:
        for path in (files.depth, files.color):
            if path is not None and path.is_file():
                facts = path.stat()
                line = f"{files.timestamp_s} {path.name} {facts.st_size} {facts.st_mtime_ns}"
                crc = zlib.crc32(line.encode(), crc)
    return crc


def _hidden(path: Path, root: Path, beside: Path | None) -> bool:
    if beside is not None and path.resolve().is_relative_to(beside.resolve()):
        return True
    return any(part.startswith(".") for part in path.relative_to(root).parts)


def _names(sources: Sequence[Path]) -> list[str]:
    last = [path.resolve().name for path in sources]
    return [
        "/".join(path.resolve().parts[-2:]) if last.count(name) > 1 else name
        for path, name in zip(sources, last, strict=True)
    ]

# SPDX-License-Identifier: Apache-2.0
"""The folder that holds a recording's result, valid while it grows."""

from __future__ import annotations

import importlib
import math
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack import __version__
from kintrack.files import make_result_folder, write_atomically, write_json
from kintrack.geometry import PinholeCamera
from kintrack.offsets import SURFACE_FILE, packed, save_offsets
from kintrack.result import STATUSES, TRACK_FILE, FrameResult, Track

SUMMARY_FILE = "summary.json"


class TrackWriter:
    """Collects frames into a result folder that is valid at every moment.

    Opening it writes an empty track, so a folder that cannot be written shows before any work, and
    never mixes two runs. Leaving the `with` block writes every frame so far, whatever ended it; a
    process killed outright loses the frames of the last `flush_every_s` at most.
    """

    def __init__(
        self,
        folder: Path,
        joint_names: Sequence[str],
        *,
        sequence_name: str,
        camera: PinholeCamera,
        config: Mapping[str, Any],
        flush_every_s: float = 5.0,
    ) -> None:
        """Make the folder and write an empty result.

        Args:
            folder: Result folder; made where missing.
            joint_names: Names of the J reported joints.
            sequence_name: Name of the recording.
            camera: Camera of the depth images.
            config: The whole resolved configuration, of JSON's types, tuples, paths and arrays.
            flush_every_s: Longest time between two writes while frames arrive [s].

        Raises:
            ResultError: if the folder cannot be made or written.
        """
        self.folder = make_result_folder(folder)
        self._joint_names = tuple(joint_names)
        self._facts = {
            "sequence": sequence_name,
            "camera": asdict(camera),
            "config": dict(config),
            "versions": _versions(),
        }
        self._flush_every_s = flush_every_s
        self._frames: list[FrameResult] = []
        self._offsets: list[ndarray] = []
        self._write(finished=False)
        (self.folder / SURFACE_FILE).unlink(missing_ok=True)

    def append(self, frame: FrameResult) -> None:
        """Take one frame; now and then, write all so far.

        Raises:
            ResultError: if a write is due and fails.
        """
        self._offsets.append(packed(frame.offsets_m))
        self._frames.append(replace(frame, offsets_m=None))
        if time.monotonic() - self._written_at_s >= self._flush_every_s:
            self._write(finished=False)

    def note(self, **facts: Any) -> None:
        """Add facts of the run to the summary, such as the person's shape, from now on."""
        self._facts.update(facts)

    def close(self, *, finished: bool = True) -> Track:
        """Write every frame so far; `finished` says in the summary whether the recording ended.

        Raises:
            ResultError: if the folder cannot be written.
        """
        if any(map(len, self._offsets)):
            write_atomically(
                self.folder / SURFACE_FILE, lambda file: save_offsets(file, self._offsets)
            )
        return self._write(finished)

    def __enter__(self) -> TrackWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close(finished=kind is None)

    def _write(self, finished: bool) -> Track:
        track = Track.from_frames(self._joint_names, self._frames)
        why = {
            name: [
                {"frame": index, "reason": frame.reason}
                for index, frame in enumerate(self._frames)
                if frame.reason is not None and (frame.status == "skipped") == (name == "skipped")
            ]
            for name in ("skipped", "untracked")
        }
        track.save(self.folder / TRACK_FILE)
        summary = self._facts | summarise(track) | why | {"finished": finished}
        write_json(self.folder / SUMMARY_FILE, summary)
        self._written_at_s = time.monotonic()
        return track


def summarise(track: Track) -> dict[str, Any]:
    """Counts, speed and residuals of a track.

    Returns:
        frames and status_counts; latency_ms, the median and 95th percentile of the milliseconds of
        frames not skipped; fps_median = 1000 / median latency; residual_rms_m, the median and 95th
        percentile over frames with status `tracking`. NaN where there is no such frame.
    """
    latency_ms = _median_p95(track.milliseconds[track.status != "skipped"])
    return {
        "frames": len(track),
        "status_counts": {name: int(np.sum(track.status == name)) for name in STATUSES},
        "latency_ms": latency_ms,
        "fps_median": 1000.0 / latency_ms["median"] if latency_ms["median"] > 0 else math.nan,
        "residual_rms_m": _median_p95(track.residual_rms_m[track.status == "tracking"]),
    }


def _median_p95(values: Float[ndarray, " n"]) -> dict[str, float]:
    values = values[np.isfinite(values)]
    if values.size == 0:
        return {"median": math.nan, "p95": math.nan}
    return {"median": float(np.median(values)), "p95": float(np.percentile(values, 95))}


def _versions() -> dict[str, str]:
    modules = {"numpy": "numpy", "pin": "pinocchio", "numba": "numba", "opencv": "cv2"}
    versions = {
        name: importlib.import_module(module).__version__ for name, module in modules.items()
    }
    return versions | {"python": platform.python_version(), "kintrack": __version__}

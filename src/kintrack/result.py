# SPDX-License-Identifier: Apache-2.0
"""What tracking yields: a frame's result, a recording's track, and the folder that holds them."""

from __future__ import annotations

import importlib
import json
import math
import os
import platform
import time
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack import __version__
from kintrack.errors import ResultError
from kintrack.geometry import PinholeCamera
from kintrack.offsets import SURFACE_FILE, packed, save_offsets

STATUSES = ("initialising", "tracking", "lost", "skipped")
TRACK_FILE = "track.npz"
SUMMARY_FILE = "summary.json"


@dataclass(frozen=True)
class FrameResult:
    """The person's state at one frame, with what is needed to doubt it."""

    timestamp_s: float
    """Time stamp of the frame [s]."""
    status: str
    """One of `STATUSES`."""
    q: Float[ndarray, " nq"]
    """Configuration of the body in Pinocchio's order [m, rad]; NaN where there is none."""
    joint_positions_camera_m: Float[ndarray, "j 3"]
    """Joint centres in the camera frame [m]; NaN where there is none."""
    joint_covariances_m2: Float[ndarray, "j 3 3"]
    """Covariance of each joint centre in the camera frame [m^2]."""
    joint_visible: Float[ndarray, " j"]
    """Share of the skin near each joint that the camera saw, 0 to 1."""
    residual_rms_m: float
    """Root mean square of the inliers' surface residuals [m]; NaN where nothing was solved."""
    inliers: int
    """Observed points that agree with the skin."""
    milliseconds: float
    """Time spent on the frame, reading the files left out [ms]."""
    reason: str | None = None
    """Why the frame was skipped; None for any other status."""
    iterations: int = 0
    """Solver iterations spent."""
    offsets_m: Float[ndarray, " v"] | None = None
    """Offset of every vertex of the tracking skin along its normal [m]; None without a surface."""


@dataclass(frozen=True)
class Track:
    """A recording's results as arrays: N frames, J joints; `track.npz` holds exactly these."""

    timestamps_s: Float[ndarray, " n"]
    """Time stamps [s], shape (N,)."""
    status: ndarray
    """One of `STATUSES` per frame, dtype <U12, shape (N,)."""
    q: Float[ndarray, "n nq"]
    """Configurations in Pinocchio's order [m, rad], shape (N, nq)."""
    joint_names: tuple[str, ...]
    """Names of the J joints."""
    joint_positions_camera_m: Float[ndarray, "n j 3"]
    """Joint centres in the camera frame [m], shape (N, J, 3); NaN where there is none."""
    joint_covariances_m2: Float[ndarray, "n j 3 3"]
    """Covariances of the joint centres in the camera frame [m^2], shape (N, J, 3, 3)."""
    joint_visible: Float[ndarray, "n j"]
    """Share of the skin near each joint that the camera saw, 0 to 1, shape (N, J)."""
    residual_rms_m: Float[ndarray, " n"]
    """Root mean square of the inliers' surface residuals [m], shape (N,)."""
    inliers: Int[ndarray, " n"]
    """Observed points that agree with the skin, shape (N,)."""
    milliseconds: Float[ndarray, " n"]
    """Time spent per frame, reading the files left out [ms], shape (N,)."""

    def __post_init__(self) -> None:
        _check_arrays(self._arrays())

    def __len__(self) -> int:
        return len(self.timestamps_s)

    @classmethod
    def from_frames(cls, joint_names: Sequence[str], frames: Sequence[FrameResult]) -> Track:
        """Stack frames in the order given; no frames make an empty, valid track.

        Args:
            joint_names: Names of the J joints.
            frames: Results of N frames.

        Returns:
            The track; its q has shape (0, 0) when there are no frames.

        Raises:
            ResultError: if a frame's arrays do not fit the joint names, or a status is unknown.
        """
        n, j = len(frames), len(joint_names)

        def stack(field: str, empty: tuple[int, ...], dtype: str = "<f8") -> ndarray:
            values = [getattr(frame, field) for frame in frames]
            return np.array(values, dtype=dtype) if n else np.empty(empty, dtype=dtype)

        return cls(
            timestamps_s=stack("timestamp_s", (0,)),
            status=stack("status", (0,), "<U12"),
            q=stack("q", (0, 0)),
            joint_names=tuple(joint_names),
            joint_positions_camera_m=stack("joint_positions_camera_m", (0, j, 3)),
            joint_covariances_m2=stack("joint_covariances_m2", (0, j, 3, 3)),
            joint_visible=stack("joint_visible", (0, j)),
            residual_rms_m=stack("residual_rms_m", (0,)),
            inliers=stack("inliers", (0,), "<i8"),
            milliseconds=stack("milliseconds", (0,)),
        )

    def save(self, path: Path) -> None:
        """Write `track.npz` in one step: a reader sees the old file or the new, never a part.

        Raises:
            ResultError: if the file cannot be written.
        """
        arrays = self._arrays()
        write_atomically(path, lambda file: np.savez(file, **arrays))

    @classmethod
    def load(cls, path: Path) -> Track:
        """Read a `track.npz`; nothing in it is unpickled.

        Raises:
            ResultError: if the file is missing or no npz, or one of its arrays is missing, pickled
                or of the wrong type or shape.
        """
        arrays = _read_npz(path)
        try:
            _check_arrays(arrays)
        except ResultError as error:
            raise ResultError(f"{path}: {error}") from error
        names = tuple(str(name) for name in arrays.pop("joint_names"))
        return cls(joint_names=names, **arrays)

    def _arrays(self) -> dict[str, Any]:
        arrays = {field.name: getattr(self, field.name) for field in fields(self)}
        return arrays | {"joint_names": np.array(self.joint_names, dtype=np.str_)}


_LAYOUT: dict[str, tuple[str, tuple[str | int, ...]]] = {
    "timestamps_s": ("f", ("N",)),
    "status": ("U", ("N",)),
    "q": ("f", ("N", "nq")),
    "joint_names": ("U", ("J",)),
    "joint_positions_camera_m": ("f", ("N", "J", 3)),
    "joint_covariances_m2": ("f", ("N", "J", 3, 3)),
    "joint_visible": ("f", ("N", "J")),
    "residual_rms_m": ("f", ("N",)),
    "inliers": ("iu", ("N",)),
    "milliseconds": ("f", ("N",)),
}
"""Array name -> (kinds of dtype allowed, shape); equal letters stand for equal lengths."""


def _check_arrays(arrays: Mapping[str, ndarray]) -> None:
    """Raise ResultError unless the arrays are the ones of a track."""
    missing = [name for name in _LAYOUT if name not in arrays]
    if missing:
        raise ResultError(f"array {', '.join(missing)} is missing; needed: {', '.join(_LAYOUT)}")
    lengths: dict[str | int, int] = {3: 3}
    for name, (kinds, shape) in _LAYOUT.items():
        array = arrays[name]
        wanted = " x ".join(str(lengths.get(letter, letter)) for letter in shape)
        if array.dtype.kind not in kinds:
            raise ResultError(f"array {name} has dtype {array.dtype}; kind {kinds!r} is needed")
        if array.ndim != len(shape) or any(
            lengths.setdefault(letter, length) != length
            for letter, length in zip(shape, array.shape, strict=True)
        ):
            raise ResultError(f"array {name} has shape {array.shape}; needed: {wanted}")
    unknown = sorted(set(arrays["status"].tolist()) - set(STATUSES))
    if unknown:
        raise ResultError(f"status {unknown[0]!r} is unknown; valid: {', '.join(STATUSES)}")


def _read_npz(path: Path) -> dict[str, ndarray]:
    """The arrays of `_LAYOUT` that the file holds."""
    try:
        with open(path, "rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("it holds a single array")
            return {name: archive[name] for name in _LAYOUT if name in archive.files}
    except FileNotFoundError:
        raise ResultError(f"{path}: there is no such file") from None
    except (OSError, EOFError, ValueError, zipfile.BadZipFile, zlib.error) as error:
        raise ResultError(f"{path} is not a track.npz: {error}") from error


def write_atomically(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Write a file beside `path`, then move it there in one step.

    Args:
        path: The file to make or replace; its folder must exist.
        write: Called with the open binary file.

    Raises:
        ResultError: if the folder or the file cannot be written.
    """
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        try:
            with open(part, "wb") as file:
                write(file)
            os.replace(part, path)
        except BaseException:
            part.unlink(missing_ok=True)
            raise
    except OSError as error:
        raise ResultError(f"cannot write {path}: {error.strerror or error}") from error


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write sorted, indented, strictly valid JSON in one step; NaN and infinity become null.

    Raises:
        ResultError: if the file cannot be written.
    """
    text = json.dumps(_json_ready(content), indent=2, sort_keys=True, allow_nan=False) + "\n"
    write_atomically(path, lambda file: file.write(text.encode()))


def _json_ready(value: Any) -> Any:
    """The value in JSON's own types."""
    if isinstance(value, Mapping):
        return {str(key): _json_ready(item) for key, item in value.items()}
    if isinstance(value, (ndarray, np.generic)):
        return _json_ready(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_json_ready(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def make_result_folder(folder: Path) -> Path:
    """Make the folder, and its parents, where they are missing.

    Raises:
        ResultError: if it cannot be made.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ResultError(f"cannot make the folder {folder}: {error.strerror}") from error
    return folder


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
        reasons = [
            {"frame": index, "reason": frame.reason}
            for index, frame in enumerate(self._frames)
            if frame.status == "skipped"
        ]
        track.save(self.folder / TRACK_FILE)
        summary = self._facts | summarise(track) | {"skipped": reasons, "finished": finished}
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

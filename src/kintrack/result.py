# SPDX-License-Identifier: Apache-2.0
"""What tracking yields: a frame's result and a recording's track."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.files import write_atomically

STATUSES = ("initialising", "tracking", "lost", "skipped")
TRACK_FILE = "track.npz"


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
    """Why there is no pose; None where there is one."""
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

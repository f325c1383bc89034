# SPDX-License-Identifier: Apache-2.0
"""Motion capture: joint centres of a real person over time, read from npz files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import DatasetError
from kintrack.joints import JOINT_NAMES

HELD_OUT = ("cmu_01_03", "cmu_02_02", "cmu_02_06", "cmu_02_10")
"""Clips that no training set may use: one of each kind (climb, walk, bend, wash), so that a test
asks for motions that are like the ones trained on but never the same."""
SPIKE_M_S2 = 140.0
"""Acceleration of a joint that no clip shows but by a marker taken for another [m/s^2]."""
ARRAYS = ("joint_positions_m", "joint_names", "rate_hz")


@dataclass(frozen=True)
class Clip:
    """A person's joint centres over time; z is up, the floor near z = 0."""

    name: str
    """File name without its suffix."""
    times_s: Float[ndarray, " n"]
    """Time of each frame [s], from 0."""
    joint_names: tuple[str, ...]
    """Names of the joints: those of `JOINT_NAMES`, in any order."""
    joint_positions_m: Float[ndarray, "n j 3"]
    """Joint centres [m]. `pelvis` is the root, above the hips."""

    def joint(self, name: str) -> Float[ndarray, "n 3"]:
        """Path of one joint [m], shape (N, 3)."""
        return self.joint_positions_m[:, self.joint_names.index(name)]

    def rate_hz(self) -> float:
        """Frames per second [Hz]."""
        return float((len(self.times_s) - 1) / (self.times_s[-1] - self.times_s[0]))


def load_clip(path: Path) -> Clip:
    """Read a clip.

    Args:
        path: npz with `joint_positions_m` (N, J, 3) [m], `joint_names` (J,), `rate_hz` [Hz].

    Returns:
        The clip.

    Raises:
        DatasetError: if the file is missing or broken, an array is missing or of a wrong shape,
            a joint is missing, unknown or named twice, a frame holds values that are not finite,
            or there are fewer than 2 frames.
    """
    path = Path(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            missing = [name for name in ARRAYS if name not in file.files]
            if missing:
                raise DatasetError(f"{path}: lacks the arrays {', '.join(missing)}")
            positions, joints, rate = (file[name] for name in ARRAYS)
    except (OSError, ValueError, EOFError, TypeError, AttributeError, BadZipFile) as error:
        raise DatasetError(f"{path}: cannot be read as motion capture ({error})") from error
    names = tuple(str(name) for name in joints.ravel())
    _check_names(path, names)
    if positions.ndim != 3 or positions.shape[1:] != (len(names), 3) or positions.dtype.kind != "f":
        raise DatasetError(
            f"{path}: joint_positions_m has shape {positions.shape} of {positions.dtype}; "
            f"real numbers of shape (frames, {len(names)}, 3) are needed"
        )
    if len(positions) < 2:
        raise DatasetError(f"{path}: {len(positions)} frames; at least 2 are needed")
    bad = np.flatnonzero(~np.isfinite(positions).all(axis=(1, 2)))
    if len(bad):
        raise DatasetError(
            f"{path}: {len(bad)} frames hold values that are not finite, the first is {bad[0]}"
        )
    if rate.size != 1 or rate.dtype.kind not in "iuf" or not 0.0 < float(rate.item()) < np.inf:
        raise DatasetError(f"{path}: rate_hz = {rate!r}; one number above 0 Hz is needed")
    times_s = np.arange(len(positions)) / float(rate.item())
    return Clip(path.stem, times_s, names, positions.astype(float))


def excerpt(clip: Clip, start: int, length: int) -> Clip:
    """`length` frames of a clip from frame `start` on."""
    part = slice(start, start + length)
    return replace(
        clip, times_s=clip.times_s[:length], joint_positions_m=clip.joint_positions_m[part]
    )


def clips_in(folder: Path) -> tuple[Path, ...]:
    """Every clip of a folder, by name.

    Args:
        folder: Where the `*.npz` are.

    Returns:
        Paths in order of their names, at least one.

    Raises:
        DatasetError: if there is no such folder or no clip in it.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise DatasetError(f"{folder}: no such folder; a folder of motion capture (npz) is needed")
    paths = tuple(sorted(folder.glob("*.npz")))
    if not paths:
        raise DatasetError(f"{folder}: no *.npz in it; a folder of motion capture is needed")
    return paths


def mirrored_clip(clip: Clip) -> Clip:
    """The clip seen in a mirror: y turns its sign, left and right change places."""
    other = {"l": "r", "r": "l"}
    names = tuple(other[n[0]] + n[1:] if n[:2] in ("l_", "r_") else n for n in clip.joint_names)
    return Clip(clip.name, clip.times_s, names, clip.joint_positions_m * [1.0, -1.0, 1.0])


def despiked(clip: Clip) -> Clip:
    """The clip without frames in which a joint jumps away and back.

    A frame is replaced by the mean of its neighbours if the acceleration of one of its joints is
    above `SPIKE_M_S2`.
    """
    x = clip.joint_positions_m.copy()
    limit_m = 0.5 * SPIKE_M_S2 / clip.rate_hz() ** 2
    middles = 0.5 * (x[:-2] + x[2:])
    far = np.linalg.norm(x[1:-1] - middles, axis=2).max(axis=1)
    for n in np.flatnonzero(far > limit_m):
        if far[n] == far[max(n - 1, 0) : n + 2].max():
            x[n + 1] = middles[n]
    return Clip(clip.name, clip.times_s, clip.joint_names, x)


def facing_x(clip: Clip) -> Clip:
    """The clip turned and moved over the floor: it starts between the hips, looking along x."""
    across = (clip.joint("l_hip") - clip.joint("r_hip"))[0]
    length = np.hypot(across[0], across[1])
    if length < 1e-6:
        raise DatasetError(
            f"clip {clip.name}: in its first frame one hip is above the other; "
            "it must show where the person looks"
        )
    c, s = across[1] / length, across[0] / length
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    start = 0.5 * (clip.joint("l_hip") + clip.joint("r_hip"))[0] * [1.0, 1.0, 0.0]
    return Clip(clip.name, clip.times_s, clip.joint_names, (clip.joint_positions_m - start) @ R.T)


def _check_names(path: Path, names: tuple[str, ...]) -> None:
    """Every joint of `JOINT_NAMES` once, and no other."""
    missing = [name for name in JOINT_NAMES if name not in names]
    unknown = [name for name in names if name not in JOINT_NAMES]
    if missing or unknown or len(set(names)) != len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise DatasetError(
            f"{path}: joints missing: {missing}, unknown: {unknown}, named twice: {twice}; "
            f"needed are {', '.join(JOINT_NAMES)}"
        )

# SPDX-License-Identifier: Apache-2.0
"""`occlusion.csv`: how much of the person, and which joints, something hides in each frame."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES

OCCLUSION_FILE = "occlusion.csv"
OCCLUSION_HEADER = "frame,hidden_share,hidden_joints\n"


def occlusion_row(frame: int, hidden_share: float, hidden_joints: Sequence[str]) -> str:
    """One line of the file.

    Args:
        frame: Position in the recording, from 0.
        hidden_share: Share of the person's pixels behind something else, 0..1; NaN where the
            person is not in the image.
        hidden_joints: Names of the joints behind something else.
    """
    return f"{frame},{hidden_share:.4f},{' '.join(hidden_joints)}\n"


def read_occlusion(path: Path) -> tuple[Float[ndarray, " n"], Bool[ndarray, "n j"]]:
    """Read the file.

    Args:
        path: The file.

    Returns:
        Hidden share per frame (N,), NaN where the person is not in the image or a frame has no
        line, and which of `JOINT_NAMES` are hidden (N, 21).

    Raises:
        ResultError: if it cannot be read, or a line is malformed.
    """
    shares: dict[int, float] = {}
    hidden: dict[int, list[bool]] = {}
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.reader(file)
            if next(reader, None) != OCCLUSION_HEADER.strip().split(","):
                raise ResultError(f"{path}: the first line must be {OCCLUSION_HEADER.strip()!r}")
            for row in reader:
                where = f"{path}, line {reader.line_num}"
                try:
                    frame, share, names = int(row[0]), float(row[1]), row[2].split()
                except (IndexError, ValueError):
                    raise ResultError(f"{where}: {','.join(row)!r} is no row of it") from None
                unknown = sorted(set(names) - set(JOINT_NAMES))
                if unknown or frame < 0 or share > 1.0:
                    raise ResultError(
                        f"{where}: frame {frame}, share {share}, unknown joints {unknown}; "
                        f"allowed: frames from 0, shares up to 1, {', '.join(JOINT_NAMES)}"
                    )
                shares[frame], hidden[frame] = share, [name in names for name in JOINT_NAMES]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"cannot read {path}: {error}") from error
    n = max(shares, default=-1) + 1
    out = np.full(n, np.nan), np.zeros((n, len(JOINT_NAMES)), dtype=bool)
    for frame, share in shares.items():
        out[0][frame], out[1][frame] = share, hidden[frame]
    return out

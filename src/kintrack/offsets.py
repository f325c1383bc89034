# SPDX-License-Identifier: Apache-2.0
"""Offsets of the skin in a file: `surface.npz` holds tenths of a millimetre as 16-bit integers."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from jaxtyping import Float, Int16
from numpy import ndarray

from kintrack.errors import ResultError

SURFACE_FILE = "surface.npz"
UNIT_M = 1e-4
"""One step of the file [m]; 16 bits reach 3.2 m."""
NONE = np.int16(-32768)
"""A frame without a surface."""


def packed(offsets_m: Float[ndarray, " v"] | None) -> Int16[ndarray, " v"]:
    """Offsets as they are stored; empty for None."""
    if offsets_m is None:
        return np.zeros(0, dtype=np.int16)
    return np.clip(np.rint(offsets_m / UNIT_M), -32767, 32767).astype(np.int16)


def save_offsets(file: BinaryIO, rows: Sequence[Int16[ndarray, " v"]]) -> None:
    """Write one row per frame; frames without a surface are filled with `NONE`.

    Args:
        file: Open for writing.
        rows: What `packed` gave for each frame.
    """
    vertices = max(map(len, rows), default=0)
    whole = np.full((len(rows), vertices), NONE, dtype="<i2")
    for row, filled in zip(rows, whole, strict=True):
        if len(row):
            filled[:] = row
    np.savez_compressed(file, offsets_100um=whole)


def load_offsets(path: Path) -> Float[ndarray, "n v"]:
    """Offsets of every frame [m], NaN in frames without a surface; nothing is unpickled.

    Raises:
        ResultError: if the file is missing or holds something else.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            stored = archive["offsets_100um"]
    except FileNotFoundError:
        raise ResultError(
            f"{path}: there is no such file; track with --config.deformation.enabled"
        ) from None
    except (OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error) as error:
        raise ResultError(f"{path} holds no offsets of a skin: {error}") from error
    if stored.dtype != np.int16 or stored.ndim != 2:
        raise ResultError(
            f"{path}: offsets_100um is {stored.dtype} in {stored.ndim} dimensions; "
            "int16, frames by vertices, is needed"
        )
    return np.where(stored == NONE, np.nan, UNIT_M * stored)

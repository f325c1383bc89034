# SPDX-License-Identifier: Apache-2.0
"""Reference joints beside a recording: 3-D (`reference_joints.csv`) and in the image."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES

REFERENCE_FILE = "reference_joints.csv"
JOINTS_HEADER = "frame,joint,x_m,y_m,z_m"
PIXELS_HEADER = "frame,joint,u_px,v_px,visibility"


def read_reference_joints(path: Path) -> tuple[tuple[str, ...], Float[ndarray, "n j 3"]]:
    """Joint centres of `reference_joints.csv`.

    Args:
        path: The file, with the columns frame, joint, x_m, y_m, z_m.

    Returns:
        The J names the file has, in the order of `JOINT_NAMES`, and positions in the depth
        camera's frame [m], shape (N, J, 3), NaN where missing. Row n is frame n of the
        recording; N ends with the last frame that has a reference.

    Raises:
        ResultError: if the file cannot be read, lacks a column, names an unknown joint, repeats
            one in a frame, or has a value that is no number.
    """
    names, values = _read_table(path, JOINTS_HEADER, allowed=JOINT_NAMES)
    order = sorted(range(len(names)), key=lambda j: JOINT_NAMES.index(names[j]))
    return tuple(names[j] for j in order), values[:, order]


def read_reference_pixels(
    path: Path,
) -> tuple[tuple[str, ...], Float[ndarray, "n j 2"], Float[ndarray, "n j"]]:
    """Image joints of `reference_mediapipe.csv`; any joint name is allowed.

    Args:
        path: The file, with the columns frame, joint, u_px, v_px, visibility.

    Returns:
        The J names in the order of their first appearance; pixels (u, v) [px], shape (N, J, 2),
        NaN where missing; visibility in 0..1, shape (N, J), 0 where missing. Row n is frame n.

    Raises:
        ResultError: as `read_reference_joints`, but for unknown names.
    """
    names, values = _read_table(path, PIXELS_HEADER)
    return names, values[..., :2], np.nan_to_num(values[..., 2], nan=0.0)


def write_reference_joints(
    path: Path, joint_names: Sequence[str], positions_m: Float[ndarray, "n j 3"]
) -> None:
    """Write `reference_joints.csv`; joints whose position is not finite are left out.

    Args:
        path: The file, overwritten.
        joint_names: J names out of `JOINT_NAMES`.
        positions_m: Joint centres in the depth camera's frame [m], shape (N, J, 3).

    Raises:
        ResultError: if a name is unknown or the file cannot be written.
    """
    check_joint_names(joint_names, path)
    rows = (reference_rows(n, joint_names, frame_m) for n, frame_m in enumerate(positions_m))
    try:
        path.write_text(JOINTS_HEADER + "\n" + "".join(rows), encoding="utf-8")
    except OSError as error:
        raise ResultError(f"cannot write {path}: {error.strerror}") from error


def reference_rows(
    frame: int, joint_names: Sequence[str], positions_m: Float[ndarray, "j 3"]
) -> str:
    """Lines of `reference_joints.csv` for one frame, to the micrometre.

    Args:
        frame: Position of the frame in the recording, from 0.
        joint_names: J names.
        positions_m: Joint centres in the depth camera's frame [m], shape (J, 3).
    """
    return "".join(
        f"{frame},{name},{x:.6f},{y:.6f},{z:.6f}\n"
        for name, (x, y, z) in zip(joint_names, positions_m, strict=True)
        if math.isfinite(x + y + z)
    )


def check_joint_names(joint_names: Sequence[str], where: object) -> None:
    """Pass if every name is one of `JOINT_NAMES`.

    Args:
        joint_names: The names.
        where: The file they belong to, for the message.

    Raises:
        ResultError: if one is not.
    """
    for name in joint_names:
        if name not in JOINT_NAMES:
            raise ResultError(f"{where}: unknown joint {name!r}; allowed: {', '.join(JOINT_NAMES)}")


def _read_table(
    path: Path, header: str, allowed: Sequence[str] | None = None
) -> tuple[tuple[str, ...], Float[ndarray, "n j 3"]]:
    columns = header.split(",")
    table: dict[tuple[int, str], list[float]] = {}
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file)
            missing = [c for c in columns if c not in (reader.fieldnames or ())]
            if missing:
                raise ResultError(
                    f"{path}: column {', '.join(missing)} is missing; needed: {', '.join(columns)}"
                )
            for row in reader:
                where = f"{path}, line {reader.line_num}"
                key = (_frame(row["frame"], where), row["joint"] or "")
                if allowed is not None:
                    check_joint_names(key[1:], where)
                if key in table:
                    raise ResultError(f"{where}: joint {key[1]} of frame {key[0]} appears twice")
                table[key] = [_number(row[c], c, where) for c in columns[2:]]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ResultError(f"cannot read {path}: {error}") from error
    names = tuple(dict.fromkeys(name for _, name in table))
    values = np.full((max((n for n, _ in table), default=-1) + 1, len(names), 3), np.nan)
    column_of = {name: j for j, name in enumerate(names)}
    for (frame, name), numbers in table.items():
        values[frame, column_of[name]] = numbers
    return names, values


def _frame(text: str | None, where: str) -> int:
    if text is None or not text.strip().isdecimal():
        raise ResultError(f"{where}: frame = {text!r}; allowed: a whole number from 0")
    return int(text)


def _number(text: str | None, column: str, where: str) -> float:
    try:
        return float(text or "")
    except ValueError:
        raise ResultError(f"{where}: {column} = {text!r}; allowed: a number") from None

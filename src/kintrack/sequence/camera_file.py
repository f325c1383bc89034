# SPDX-License-Identifier: Apache-2.0
"""Camera files: ours (`camera.json`) and Open3D's (`intrinsic.json`), checked key by key."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, TypeGuard

from kintrack.errors import ConfigError, SequenceError
from kintrack.geometry import PinholeCamera

CAMERA_FORMAT = (
    '{"model": "pinhole", "width": 640, "height": 480, "fx": 525.0, "fy": 525.0, '
    '"cx": 319.5, "cy": 239.5, "depth_scale_m": 0.001}'
)
"""An example of `camera.json`, for messages."""


def read_camera_file(path: Path) -> tuple[PinholeCamera, float | None]:
    """Camera and depth unit of `camera.json` or of Open3D's `intrinsic.json`.

    A file with the key `intrinsic_matrix` is taken as Open3D's, whose matrix is stored column by
    column and whose optional `depth_scale` counts units per metre. Ours gives metres per unit.

    Args:
        path: The file.

    Returns:
        The camera, and metres per depth unit; None if the file does not tell.

    Raises:
        SequenceError: if the file is missing, is no JSON, lacks a key, or holds a value that is
            not allowed.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SequenceError(
            f"camera file {path} cannot be read: {error.strerror}. Format: {CAMERA_FORMAT}"
        ) from error
    except ValueError as error:
        raise SequenceError(
            f"camera file {path} is not JSON: {error}. Format: {CAMERA_FORMAT}"
        ) from error
    if not isinstance(content, dict):
        raise SequenceError(
            f"camera file {path} holds a {type(content).__name__}; "
            f"a JSON object is needed. Format: {CAMERA_FORMAT}"
        )
    return (_read_open3d if "intrinsic_matrix" in content else _read_ours)(content, path)


def write_camera_file(path: Path, camera: PinholeCamera, depth_scale_m: float) -> None:
    """Write `camera.json`.

    Args:
        path: The file.
        camera: Camera of the depth images.
        depth_scale_m: Metres per depth unit.

    Raises:
        OSError: if the file cannot be written.
    """
    content = {
        "model": "pinhole",
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "depth_scale_m": depth_scale_m,
    }
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


def check_positive(name: str, value: object, where: object) -> float:
    """The value, if it is a finite number above zero.

    Args:
        name: What the value is called by whoever gave it.
        value: The value.
        where: The file or recording it belongs to, for the message.

    Raises:
        SequenceError: if it is anything else.
    """
    if not _is_number(value) or not (math.isfinite(value) and value > 0):
        raise SequenceError(f"{where}: {name} = {value!r}; allowed: a finite number above 0")
    return float(value)


def _read_ours(content: dict[str, Any], path: Path) -> tuple[PinholeCamera, float | None]:
    model = _value(content, "model", path)
    if model != "pinhole":
        raise SequenceError(
            f"camera file {path}: model = {model!r}; allowed: 'pinhole' (undistorted images)"
        )
    figures = {key: _value(content, key, path) for key in ("fx", "fy", "cx", "cy")}
    camera = _camera(content, figures, path)
    if "depth_scale_m" not in content:
        return camera, None
    return camera, check_positive("depth_scale_m", content["depth_scale_m"], f"camera file {path}")


def _read_open3d(content: dict[str, Any], path: Path) -> tuple[PinholeCamera, float | None]:
    matrix = content["intrinsic_matrix"]
    if not (isinstance(matrix, list) and len(matrix) == 9 and all(map(_is_number, matrix))):
        raise SequenceError(
            f"camera file {path}: intrinsic_matrix = {matrix!r}; allowed: 9 numbers, "
            "column by column: [fx, 0, 0, 0, fy, 0, cx, cy, 1]"
        )
    if any(matrix[i] != 0 for i in (1, 2, 3, 5)) or matrix[8] != 1:
        raise SequenceError(
            f"camera file {path}: intrinsic_matrix = {matrix} is not a pinhole camera stored "
            "column by column: [fx, 0, 0, 0, fy, 0, cx, cy, 1]"
        )
    figures = {"fx": matrix[0], "fy": matrix[4], "cx": matrix[6], "cy": matrix[7]}
    camera = _camera(content, figures, path)
    if "depth_scale" not in content:
        return camera, None
    units_per_metre = check_positive("depth_scale", content["depth_scale"], f"camera file {path}")
    return camera, 1.0 / units_per_metre


def _camera(content: dict[str, Any], figures: dict[str, Any], path: Path) -> PinholeCamera:
    for key, value in figures.items():
        if not _is_number(value):
            raise SequenceError(f"camera file {path}: {key} = {value!r}; allowed: a number [px]")
    width, height = (_value(content, key, path) for key in ("width", "height"))
    fx, fy, cx, cy = (float(figures[key]) for key in ("fx", "fy", "cx", "cy"))
    try:
        return PinholeCamera(width, height, fx, fy, cx, cy)
    except ConfigError as error:
        raise SequenceError(f"camera file {path}: {error}") from error


def _value(content: dict[str, Any], key: str, path: Path) -> Any:
    if key not in content:
        raise SequenceError(
            f"camera file {path}: key '{key}' is missing; it has {', '.join(content) or 'no key'}. "
            f"Format: {CAMERA_FORMAT}"
        )
    return content[key]


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool)

# SPDX-License-Identifier: Apache-2.0
"""One image file in, one checked array out; what cannot be used raises a `FrameError`."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8, UInt16
from numpy import ndarray

from kintrack.errors import FrameError
from kintrack.geometry import LABELS, PinholeCamera

_TRAILERS = {b"\x89PNG": b"IEND", b"\xff\xd8\xff": b"\xff\xd9"}
"""How a PNG and a JPEG begin, and what stands at the end of a whole one."""


def clean_depth(depth_m: Float[ndarray, "h w"]) -> Float[ndarray, "h w"]:
    """Depth whose every value is finite: NaN, infinities and negatives become 0 = no reading.

    Args:
        depth_m: Depth along z [m], shape (h, w).

    Returns:
        Depth [m], float32, shape (h, w).
    """
    depth_m = np.asarray(depth_m, dtype=np.float32)
    return np.where(np.isfinite(depth_m) & (depth_m > 0), depth_m, np.float32(0))


def encode_depth(depth_m: Float[ndarray, "h w"], depth_scale_m: float) -> UInt16[ndarray, "h w"]:
    """Depth in whole units of `depth_scale_m`; what 16 bits cannot hold becomes no reading.

    Args:
        depth_m: Depth along z [m], shape (h, w); NaN counts as no reading.
        depth_scale_m: Metres per unit.

    Returns:
        Units, 0 = no reading, shape (h, w).
    """
    units = np.rint(clean_depth(depth_m).astype(np.float64) / depth_scale_m)
    return np.where(units <= np.iinfo(np.uint16).max, units, 0).astype(np.uint16)


def read_depth(path: Path, camera: PinholeCamera, depth_scale_m: float) -> Float[ndarray, "h w"]:
    """Depth of a 16-bit single-channel PNG.

    Args:
        path: The PNG.
        camera: The depth camera; the image must have its size.
        depth_scale_m: Metres per unit of the image.

    Returns:
        Depth along z [m], float32, 0 = no reading, shape (h, w).

    Raises:
        FrameError: if the file is missing, broken, not 16-bit single-channel, of another size
            than the camera's, or without a single reading.
    """
    units = _decode(path, "depth image", cv2.IMREAD_UNCHANGED)
    if units.dtype != np.uint16 or units.ndim != 2 or units.shape != (camera.height, camera.width):
        raise FrameError(
            f"depth image {path} is {_describe(units)}; allowed: 16-bit, 1 channel, "
            f"{camera.width}x{camera.height} px (the camera's size)"
        )
    if not units.any():
        raise FrameError(f"no depth reading in {path}: every pixel is 0")
    return units.astype(np.float32) * np.float32(depth_scale_m)


def read_color(path: Path, camera: PinholeCamera) -> UInt8[ndarray, "h w 3"]:
    """Colour of a PNG or JPEG that is registered to depth.

    Args:
        path: The image; grey ones become colour.
        camera: The depth camera; the image must have its size.

    Returns:
        R G B, uint8, shape (h, w, 3).

    Raises:
        FrameError: if the file is missing, broken or of another size than the camera's.
    """
    bgr = _decode(path, "colour image", cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if bgr.shape[:2] != (camera.height, camera.width):
        raise FrameError(
            f"colour image {path} is {_describe(bgr)}; allowed: {camera.width}x{camera.height} px "
            "(registered to depth)"
        )
    return np.asarray(cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB))


def read_labels(path: Path, camera: PinholeCamera) -> UInt8[ndarray, "h2 w2"]:
    """Part labels of an 8-bit single-channel PNG, any size with the depth's aspect.

    Args:
        path: The PNG.
        camera: The depth camera, for the aspect; one label pixel of rounding is allowed.

    Returns:
        Indices into `kintrack.geometry.LABELS`, uint8, shape (h2, w2).

    Raises:
        FrameError: if the file is missing, broken, not 8-bit single-channel, of another aspect,
            or holds a value that is no label.
    """
    labels = _decode(path, "label image", cv2.IMREAD_UNCHANGED)
    height, width = labels.shape[:2]
    skewed = abs(width * camera.height - height * camera.width) > max(camera.width, camera.height)
    if labels.dtype != np.uint8 or labels.ndim != 2 or skewed:
        raise FrameError(
            f"label image {path} is {_describe(labels)}; allowed: 8-bit, 1 channel, "
            f"the aspect of {camera.width}x{camera.height} px"
        )
    if labels.max() >= len(LABELS):
        raise FrameError(
            f"label image {path} holds the value {labels.max()}; allowed: 0 to {len(LABELS) - 1} "
            f"({', '.join(LABELS)})"
        )
    return labels


def _decode(path: Path, kind: str, flags: int) -> ndarray:
    try:
        data = path.read_bytes()
    except OSError as error:
        raise FrameError(f"{kind} {path} cannot be read: {error.strerror}") from error
    for head, tail in _TRAILERS.items():
        if data.startswith(head) and tail not in data[-1024:]:
            raise FrameError(f"{kind} {path} is truncated: it breaks off after {len(data)} bytes")
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags) if data else None
    except cv2.error:
        image = None
    if image is None:
        raise FrameError(
            f"{kind} {path} cannot be decoded ({len(data)} bytes); allowed: a whole PNG"
            + (" or JPEG" if kind == "colour image" else "")
        )
    return np.asarray(image)


def _describe(image: ndarray) -> str:
    channels = 1 if image.ndim == 2 else image.shape[2]
    height, width = image.shape[:2]
    plural = "" if channels == 1 else "s"
    return f"{8 * image.dtype.itemsize}-bit, {channels} channel{plural}, {width}x{height} px"

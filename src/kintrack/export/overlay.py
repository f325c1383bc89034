# SPDX-License-Identifier: Apache-2.0
"""A still picture of one frame: the depth image, and beside it the same under the fitted body."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray

from kintrack.geometry import PinholeCamera
from kintrack.joints import JOINT_NAMES
from kintrack.raster import rasterise
from kintrack.sequence import Frame
from kintrack.skin import vertex_normals

BONES = (
    ("pelvis", "spine"),
    ("spine", "chest"),
    ("chest", "neck"),
    ("neck", "head"),
    *(
        bone
        for s in "lr"
        for bone in (
            ("chest", f"{s}_shoulder"),
            (f"{s}_shoulder", f"{s}_elbow"),
            (f"{s}_elbow", f"{s}_wrist"),
            (f"{s}_wrist", f"{s}_hand"),
            ("pelvis", f"{s}_hip"),
            (f"{s}_hip", f"{s}_knee"),
            (f"{s}_knee", f"{s}_ankle"),
            (f"{s}_ankle", f"{s}_foot"),
        )
    ),
)
"""Lines between joints, parent and child; the children come in the order of `JOINT_NAMES`."""

BONE_INDICES = np.array([[JOINT_NAMES.index(name) for name in bone] for bone in BONES])
"""`BONES` as rows of `JOINT_NAMES`, shape (20, 2)."""

PART_COLORS = np.array(
    [
        [128, 128, 128],
        [240, 228, 66],
        [86, 180, 233],
        [213, 94, 0],
        [0, 158, 115],
        [204, 121, 167],
        [120, 140, 255],
    ],
    dtype=np.uint8,
)
"""R G B of each label; hues that stay apart for colour-blind eyes (after Okabe & Ito 2008)."""

STATUS_COLORS = {
    "initialising": (230, 159, 0),
    "tracking": (0, 158, 115),
    "lost": (220, 50, 32),
    "skipped": (150, 150, 150),
}
"""R G B of each status."""

BAR_PX = 34
"""Height of the line of text above the pictures [px]."""

_PICTURE_PX = 1280
_GAP_PX = 4
_SEEN_OPACITY = 0.65
_HIDDEN_OPACITY = 0.3
_HIDDEN_BEHIND_M = 0.15


def upscale_factor(camera: PinholeCamera) -> int:
    """How many times larger the picture shows each depth pixel; both panels make about 1280 px."""
    return max(1, round(_PICTURE_PX / (2 * camera.width)))


def upscaled(camera: PinholeCamera, factor: int) -> PinholeCamera:
    """The camera of the same view whose every pixel is divided into factor x factor pixels."""
    return PinholeCamera(
        width=camera.width * factor,
        height=camera.height * factor,
        fx=camera.fx * factor,
        fy=camera.fy * factor,
        cx=(camera.cx + 0.5) * factor - 0.5,
        cy=(camera.cy + 0.5) * factor - 0.5,
    )


def depth_range(depth_m: Float[ndarray, "h w"] | None) -> tuple[float, float]:
    """Nearest and farthest depth worth a grey level [m], on steps of 0.5 m; at least 1 m apart."""
    seen = np.zeros(0) if depth_m is None else depth_m[np.isfinite(depth_m) & (depth_m > 0)]
    if seen.size == 0:
        return 0.5, 5.0
    near, far = np.percentile(seen, (1, 99))
    near = np.floor(2 * near) / 2
    return float(near), float(max(np.ceil(2 * far) / 2, near + 1.0))


def depth_picture(
    depth_m: Float[ndarray, "h w"], range_m: tuple[float, float]
) -> UInt8[ndarray, "h w 3"]:
    """Near is bright, far is dim, no reading is black; slopes are shaded as under a light.

    Args:
        depth_m: Depth along z [m], 0 = no reading, shape (H, W).
        range_m: Depths of the brightest and the dimmest grey [m].

    Returns:
        R G B, shape (H, W, 3).
    """
    near, far = range_m
    valid = np.isfinite(depth_m) & (depth_m > 0)
    share = np.clip((far - np.where(valid, depth_m, far)) / (far - near), 0.0, 1.0)
    grey = (60 + 150 * share) * _relief(np.where(valid, depth_m, 0.0), valid)
    ramp = cv2.applyColorMap(np.clip(grey, 30, 255).astype(np.uint8), cv2.COLORMAP_BONE)
    return np.where(valid[..., None], ramp[..., ::-1], 0).astype(np.uint8)


def _relief(depth_m: Float[ndarray, "h w"], valid: Bool[ndarray, "h w"]) -> Float[ndarray, "h w"]:
    """Brightness of the smoothed surface lit from above left, 1 where it faces the camera."""
    sigma_px = depth_m.shape[1] / 130
    weight = cv2.GaussianBlur(valid.astype(float), (0, 0), sigma_px)
    smooth = cv2.GaussianBlur(depth_m, (0, 0), sigma_px) / np.maximum(weight, 1e-6)
    dv, du = np.gradient(smooth)
    pixel_m = np.maximum(smooth, 0.1) / depth_m.shape[1]  # about one pixel's width on the surface
    return 1 - 0.22 * np.tanh((du + dv) / (2 * pixel_m))


def draw_overlay(
    frame: Frame,
    vertices_camera: Float[ndarray, "v 3"] | None,
    faces: Int[ndarray, "f 3"],
    labels_of_vertices: UInt8[ndarray, " v"],
    joint_positions_camera: Float[ndarray, "j 3"] | None,
    status: str,
    text: str,
    range_m: tuple[float, float] | None = None,
) -> UInt8[ndarray, "h2 w2 3"]:
    """Left the depth image, right the same with the body and its joints; above, status and text.

    The body is tinted by part; where the camera saw something well in front of it, it is fainter.

    Args:
        frame: The frame; without a depth image the panels are black.
        vertices_camera: Skin, camera frame [m], shape (V, 3); None draws no body.
        faces: Triangles of the skin, shape (F, 3).
        labels_of_vertices: Body part of each vertex, 1..6, shape (V,).
        joint_positions_camera: Joint centres in the order of `JOINT_NAMES`, camera frame [m],
            shape (J, 3), NaN where unknown; None draws no joints.
        status: One of the statuses of a `FrameResult`.
        text: Anything else worth a line, frame number or speed.
        range_m: Depths of the brightest and dimmest grey [m]; `depth_range` of this frame if None.
            Give the same one to all frames of a video.

    Returns:
        R G B, shape (BAR_PX + factor * H, 2 * factor * W + 4, 3).
    """
    factor = upscale_factor(frame.camera)
    camera = upscaled(frame.camera, factor)
    small_m = np.zeros((frame.camera.height, frame.camera.width))
    if frame.depth_m is not None:
        small_m = np.asarray(frame.depth_m, dtype=float)
    plain = _enlarge(depth_picture(small_m, range_m or depth_range(frame.depth_m)), factor)
    depth_m = _enlarge(small_m, factor)
    fitted = plain.copy()
    if vertices_camera is not None and np.isfinite(vertices_camera).all():
        _tint_body(fitted, depth_m, vertices_camera, faces, labels_of_vertices, camera)
    if joint_positions_camera is not None:
        _draw_skeleton(fitted, joint_positions_camera, camera)
    if status != "tracking":
        cv2.rectangle(
            fitted, (1, 1), (camera.width - 2, camera.height - 2), STATUS_COLORS[status], 3
        )
    gap = np.full((camera.height, _GAP_PX, 3), 60, dtype=np.uint8)
    panels = np.concatenate([plain, gap, fitted], axis=1)
    return np.concatenate([_bar(panels.shape[1], status, text), panels], axis=0)


def _enlarge(image: ndarray, factor: int) -> ndarray:
    return image.repeat(factor, axis=0).repeat(factor, axis=1)


def _tint_body(
    picture: UInt8[ndarray, "h w 3"],
    depth_m: Float[ndarray, "h w"],
    vertices_camera: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    labels_of_vertices: UInt8[ndarray, " v"],
    camera: PinholeCamera,
) -> None:
    """Blend the shaded body into the picture, lit from the camera."""
    body_m, face = rasterise(np.ascontiguousarray(vertices_camera, dtype=float), faces, camera)
    hit: Bool[ndarray, "h w"] = face >= 0
    corners = faces[face[hit]]  # (P, 3)
    normals = vertex_normals(vertices_camera, faces)[corners].mean(axis=1)
    towards = -vertices_camera[corners].mean(axis=1)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    light = 0.35 + 0.65 * np.clip(np.sum(normals * towards, axis=1), 0.0, 1.0)
    color = PART_COLORS[labels_of_vertices[corners[:, 0]]] * light[:, None]
    in_front = (depth_m[hit] > 0) & (depth_m[hit] < body_m[hit] - _HIDDEN_BEHIND_M)
    opacity = np.where(in_front, _HIDDEN_OPACITY, _SEEN_OPACITY)[:, None]
    picture[hit] = ((1 - opacity) * picture[hit] + opacity * color).astype(np.uint8)


def _draw_skeleton(
    picture: UInt8[ndarray, "h w 3"],
    joint_positions_camera: Float[ndarray, "j 3"],
    camera: PinholeCamera,
) -> None:
    known = np.isfinite(joint_positions_camera).all(axis=1) & (joint_positions_camera[:, 2] > 0.05)
    safe = np.where(known[:, None], joint_positions_camera, 1.0)
    limit = 4 * max(camera.width, camera.height)  # keeps OpenCV's coordinates within an int
    pixels = np.clip(camera.project(safe), -limit, limit).round().astype(int)
    bones = [pixels[bone] for bone in BONE_INDICES if known[bone].all()]
    for color, thickness in (((0, 0, 0), 4), ((255, 255, 255), 2)):
        for start, end in bones:
            cv2.line(picture, start.tolist(), end.tolist(), color, thickness, cv2.LINE_AA)
    for pixel in pixels[known]:
        cv2.circle(picture, pixel.tolist(), 4, (0, 0, 0), -1, cv2.LINE_AA)
        cv2.circle(picture, pixel.tolist(), 3, (255, 210, 60), -1, cv2.LINE_AA)


def _bar(width: int, status: str, text: str) -> UInt8[ndarray, "b w 3"]:
    """The line above the panels: the status on its colour, then the text."""
    bar = np.full((BAR_PX, width, 3), 24, dtype=np.uint8)
    font = cv2.FONT_HERSHEY_SIMPLEX
    (status_px, _), _ = cv2.getTextSize(status, font, 0.6, 1)
    cv2.rectangle(bar, (0, 0), (status_px + 20, BAR_PX - 1), STATUS_COLORS[status], -1)
    cv2.putText(bar, status, (10, 22), font, 0.6, (255, 255, 255), 1, cv2.LINE_AA)
    cv2.putText(bar, text, (status_px + 36, 22), font, 0.6, (220, 220, 220), 1, cv2.LINE_AA)
    return bar

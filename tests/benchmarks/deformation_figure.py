# SPDX-License-Identifier: Apache-2.0
"""A person's surface without and with deformation, as a picture.

From left to right: the depth of one frame under a lamp, the skin that does not deform, the one that
does, and the latter coloured by its offsets (red out, blue in, full colour at 3 cm).

    python -m tests.benchmarks.deformation_figure --recording out/shape/training/02_waving \
        --person person.json --frame 45 --output docs/deformation.png
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import tyro
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.bench.cases import pitch_of
from kintrack.body import run_kinematics
from kintrack.calibration.person import human_of, read_person
from kintrack.config import TrackerConfig
from kintrack.export.coloring import FULL_OFFSET_M, signed_colors
from kintrack.geometry import PinholeCamera, camera_pose, invert_rigid, transform_points
from kintrack.human import Human
from kintrack.raster import rasterise
from kintrack.segmenter import Region
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.skin import skinned_vertices, vertex_normals
from kintrack.tracker import Tracker

FINER = 2
"""Pixels drawn per pixel of the sensor, along each axis."""
RIM_PX = 12
"""Shown around the person [px]."""
LAMP = np.array([0.55, -0.45, -0.70])
"""Where the light comes from, camera frame."""
BLUR_PX = 2.5
"""Noise of the sensor is smoothed by this before the light is put on [px]."""


class TrueLabels:
    """The recording's own labels."""

    name = "true labels"

    def segment(self, frame: Frame, region: Region | None = None) -> UInt8[ndarray, "r c"]:
        """What the frame brings along."""
        assert frame.labels is not None
        return frame.labels


def lit(normals: Float[ndarray, "h w 3"], seen: Bool[ndarray, "h w"]) -> UInt8[ndarray, "h w"]:
    """Brightness under the lamp, white beside the person."""
    shade = 40 + 190 * np.clip(normals @ LAMP, 0.0, 1.0)
    return np.where(seen, shade, 255).astype(np.uint8)


def depth_panel(frame: Frame, camera: PinholeCamera) -> UInt8[ndarray, "h w"]:
    """The observed person under the lamp, at the size of `camera`."""
    assert frame.depth_m is not None and frame.labels is not None
    size = (camera.width, camera.height)
    own = ((frame.labels > 0) & (frame.depth_m > 0)).astype(float)
    weight = cv2.GaussianBlur(own, (0, 0), BLUR_PX)
    smooth = cv2.GaussianBlur(own * frame.depth_m, (0, 0), BLUR_PX) / np.maximum(weight, 1e-6)
    points = camera.back_project(cv2.resize(smooth, size, interpolation=cv2.INTER_LINEAR))
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-12)
    seen = cv2.resize(own, size, interpolation=cv2.INTER_NEAREST) > 0
    return lit(normals, seen)


def skin_panels(
    human: Human, q: Float[ndarray, " nq"], offsets_m: Float[ndarray, " v"], T, camera
) -> tuple[UInt8[ndarray, "h w"], UInt8[ndarray, "h w 3"]]:
    """The skin under the lamp, and coloured by its offsets."""
    vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
    vertices, faces = transform_points(invert_rigid(T), vertices), human.skin.faces
    _, index = rasterise(vertices, faces, camera)
    seen = index >= 0
    y, x = np.nonzero(seen)
    corners = faces[index[seen]]
    a, b, c = np.moveaxis(camera.project(vertices[corners]), 1, 0)
    area, p = _cross(b - a, c - a), np.stack([x, y], axis=1) - a
    second, third = _cross(p, c - a) / area, _cross(b - a, p) / area
    mix = np.stack([1 - second - third, second, third], axis=1)
    normals = np.zeros((*seen.shape, 3))
    normals[seen] = (vertex_normals(vertices, faces)[corners] * mix[..., None]).sum(axis=1)
    shade = lit(normals, seen)
    colors = np.full((*seen.shape, 3), 255, dtype=np.uint8)
    tint = (signed_colors(offsets_m, FULL_OFFSET_M)[corners] * mix[..., None]).sum(axis=1)
    colors[seen] = np.clip(tint * (0.45 + 0.55 * shade[seen] / 230)[:, None], 0, 255)
    return shade, colors


def _cross(a: Float[ndarray, "n 2"], b: Float[ndarray, "n 2"]) -> Float[ndarray, " n"]:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def main(recording: Path, person: Path, frame: int = 45, output: Path = Path("deformation.png")):
    """Track the recording twice and draw one frame.

    Args:
        recording: Labelled recording.
        person: Who it is, from `kintrack calibrate`.
        frame: Which frame.
        output: PNG to write.
    """
    sequence, T = open_sequence(recording), camera_pose(pitch_of(recording))
    shot, human = sequence.frame(frame), human_of(read_person(person))
    given = sequence.camera
    camera = PinholeCamera(
        given.width * FINER,
        given.height * FINER,
        given.fx * FINER,
        given.fy * FINER,
        (given.cx + 0.5) * FINER - 0.5,
        (given.cy + 0.5) * FINER - 0.5,
    )
    panels = [np.repeat(depth_panel(shot, camera)[..., None], 3, axis=2)]
    for enabled in (False, True):
        config = TrackerConfig()
        config = replace(config, deformation=replace(config.deformation, enabled=enabled))
        tracker = Tracker(config, human, T, segmenter=TrueLabels())
        for n in range(frame + 1):
            result = tracker.step(sequence.frame(n))
        raised = np.zeros(len(human.skin.labels))
        if result.offsets_m is not None:
            raised = result.offsets_m
        shade, colors = skin_panels(tracker.human, result.q, raised, T, camera)
        panels.append(np.repeat(shade[..., None], 3, axis=2))
    assert shot.labels is not None
    rows, columns = (np.flatnonzero((shot.labels > 0).any(axis=a)) for a in (1, 0))
    tall = slice(max(FINER * rows[0] - RIM_PX, 0), FINER * rows[-1] + RIM_PX)
    wide = slice(max(FINER * columns[0] - RIM_PX, 0), FINER * columns[-1] + RIM_PX)
    sheet = np.hstack([panel[tall, wide] for panel in [*panels, colors]])
    cv2.imwrite(str(output), sheet[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 9])


if __name__ == "__main__":
    tyro.cli(main)

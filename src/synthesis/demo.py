# SPDX-License-Identifier: Apache-2.0
"""The short recording that ships: a dressed stranger before a noisy Kinect v1, with the truth.

python -m synthesis.demo OUT
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import tyro
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from kintrack.sequence.write import SequenceWriter
from kintrack.skin import skinned_vertices
from synthesis.motions.motion import RATE_HZ, Motion, perform
from synthesis.motions.scripts import demo
from synthesis.people.person import Person, dressed, load_person
from synthesis.render.camera import level_camera, look
from synthesis.sensors.models import Sensor, kinect_v1

KINECT_V1 = PinholeCamera(width=320, height=240, fx=285.6, fy=285.6, cx=160.0, cy=120.0)
SHAPE = (0.8, -0.6, 0.5, 0.3)
"""Build of the person [standard deviations of the adult population]."""
DISTANCE_M, HEIGHT_M = 3.0, 1.0
"""Where the level camera stands: from the person's start, above the floor [m]."""
PNG_COMPRESSION = 9


@dataclass(frozen=True)
class Exposure:
    """One frame with its truth."""

    depth_m: Float[ndarray, "h w"]
    """Depth as the sensor reports it [m], 0 = no reading."""
    true_depth_m: Float[ndarray, "h w"]
    """Depth without noise [m], 0 = nothing there."""
    labels: UInt8[ndarray, "h w"]
    """True part labels."""
    joint_positions_camera_m: Float[ndarray, "j 3"]
    """True joint centres, camera frame [m]."""


def film(
    person: Person,
    motion: Motion,
    camera: PinholeCamera,
    T_world_camera: Float[ndarray, "4 4"],
    sensor: Sensor,
    rng: np.random.Generator,
) -> Iterator[Exposure]:
    """Record a motion.

    Args:
        person: Who moves.
        motion: How.
        camera: Depth camera.
        T_world_camera: Its pose; the floor is z = 0.
        sensor: How it misreads.
        rng: Draws the noise.

    Yields:
        One exposure a frame of the motion.
    """
    for q in motion.q:
        state = run_kinematics(person.body, q)
        view = look(skinned_vertices(state, person.skin), person.skin.faces, camera, T_world_camera)
        yield Exposure(
            depth_m=sensor(view, rng),
            true_depth_m=view.depth_m,
            labels=view.labels(person.skin.faces, person.skin.labels),
            joint_positions_camera_m=transform_points(
                invert_rigid(T_world_camera), state.joint_positions_world
            ),
        )


def write_demo_sequence(folder: Path, seed: int = 0) -> None:
    """Write the demo: 5 s at 30 Hz, 320 x 240, depth in mm, true labels and true joints.

    The joints are those of the person's own skeleton, and the labels those of the true surface, so
    at the silhouette they differ from the noisy depth by a pixel.

    Args:
        folder: Where to; a sequence that is there is replaced.
        seed: Draws the clothes and the noise; the same seed gives the same bytes.

    Raises:
        ResultError: if the folder cannot be written.
    """
    rng = np.random.default_rng(seed)
    shape = np.array(SHAPE)
    person = dressed(load_person(shape), rng)
    motion = perform(person, demo())
    writer = SequenceWriter(folder, KINECT_V1, overwrite=True)
    T_world_camera = level_camera(DISTANCE_M, HEIGHT_M)
    exposures = film(person, motion, KINECT_V1, T_world_camera, kinect_v1, rng)
    for n, exposure in enumerate(exposures):
        writer.write(
            n / RATE_HZ,
            exposure.depth_m,
            labels=exposure.labels,
            joint_positions_m=exposure.joint_positions_camera_m,
        )
    for path in sorted(folder.glob("*/*.png")):
        _compress(path)


def _compress(path: Path) -> None:
    """Rewrite a PNG as small as the format allows, pixels unchanged."""
    image = np.asarray(cv2.imread(str(path), cv2.IMREAD_UNCHANGED))
    options = [cv2.IMWRITE_PNG_COMPRESSION, PNG_COMPRESSION]
    path.write_bytes(cv2.imencode(".png", image, options)[1].tobytes())


def main(out: tyro.conf.Positional[Path], seed: int = 0) -> None:
    """Write the demo sequence.

    Args:
        out: Folder to write; a sequence that is there is replaced.
        seed: Draws the clothes and the noise.
    """
    write_demo_sequence(out, seed)


if __name__ == "__main__":
    tyro.cli(main)

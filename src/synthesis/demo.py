# SPDX-License-Identifier: Apache-2.0
"""The short recording that ships: a dressed stranger before a noisy Kinect v1, with the truth.

python -m synthesis.demo OUT
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import tyro
from jaxtyping import Float
from numpy import ndarray

from kintrack.sequence.write import SequenceWriter
from synthesis.film import film
from synthesis.motions.motion import perform
from synthesis.motions.scripts import demo
from synthesis.people.person import load_person
from synthesis.people.wardrobe import dress
from synthesis.render.lights import Lights
from synthesis.render.placing import level_camera
from synthesis.scene import Scene
from synthesis.sensors.catalogue import SENSORS
from synthesis.sensors.sensor import Sensor

PERSON = 425
"""Who is filmed: a strong man of 31 years, one that nothing is trained on."""
DISTANCE_M, HEIGHT_M = 3.3, 1.0
"""Where the level camera stands: from the person's start, above the floor [m]."""
DARK = Lights(sky=np.zeros(3), ground=np.zeros(3))
"""The sensor's own light is enough for depth."""
PNG_COMPRESSION = 9


def demo_scene(sensor: Sensor, outfit: np.random.Generator) -> Scene:
    """The person of the demo before a sensor, nothing around.

    Args:
        sensor: The sensor.
        outfit: Draws what is worn.
    """
    person = load_person(PERSON)
    motion = perform(person, demo())
    T_world_camera: Float[ndarray, "4 4"] = level_camera(DISTANCE_M, HEIGHT_M)
    return Scene(
        figure=dress(person, outfit),
        motion=motion,
        held=(),
        fixed=None,
        lights=DARK,
        sensor=sensor,
        color=None,
        Ts_world_camera=np.tile(T_world_camera, (len(motion.q), 1, 1)),
        stride=1,
    )


def write_demo_sequence(folder: Path, seed: int = 0) -> None:
    """Write the demo: 5 s at 30 Hz, 320 x 240, depth in mm, true labels and true joints.

    The joints are those of the person's own skeleton; labels say what the noisy depth shows.

    Args:
        folder: Where to; a sequence that is there is replaced.
        seed: Draws the clothes and the noise; the same seed gives the same bytes.

    Raises:
        ResultError: if the folder cannot be written.
    """
    outfit, noise = np.random.default_rng(seed).spawn(2)
    scene = demo_scene(SENSORS["kinect_v1_320"](), outfit)
    writer = SequenceWriter(folder, scene.sensor.camera, overwrite=True)
    for exposure in film(scene, noise):
        writer.write(
            exposure.timestamp_s,
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

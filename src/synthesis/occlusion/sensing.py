# SPDX-License-Identifier: Apache-2.0
"""Which sensor took a recording, as far as its image size tells."""

from __future__ import annotations

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from synthesis.sensors.catalogue import SENSORS
from synthesis.sensors.sensor import Sensor

BY_SIZE = {
    (512, 424): "kinect_v2",
    (640, 480): "kinect_v1",
    (320, 240): "kinect_v1",
    (848, 480): "stereo",
    (1280, 720): "stereo",
}
"""Image size -> the sensor that usually has it."""


def sensor_for(name: str, camera: PinholeCamera) -> Sensor:
    """A sensor with a recording's camera.

    Args:
        name: A sensor's name, or auto to tell by the image size; unusual sizes get no noise.
        camera: The recording's camera.

    Raises:
        SceneError: if the name is unknown.
    """
    if name == "auto":
        name = BY_SIZE.get((camera.width, camera.height), "perfect")
    if name not in SENSORS:
        raise SceneError(f"sensor {name!r}; allowed: auto, {', '.join(SENSORS)}")
    return SENSORS[name]().with_camera(camera)

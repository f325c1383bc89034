# SPDX-License-Identifier: Apache-2.0
"""Every sensor model by name."""

from __future__ import annotations

from collections.abc import Callable

from synthesis.sensors.kinect_v1 import CAMERA_320, KinectV1
from synthesis.sensors.kinect_v2 import KinectV2
from synthesis.sensors.perfect import Perfect
from synthesis.sensors.sensor import Sensor
from synthesis.sensors.stereo import Stereo

SENSORS: dict[str, Callable[[], Sensor]] = {
    "kinect_v1": KinectV1,
    "kinect_v1_320": lambda: KinectV1().with_camera(CAMERA_320),
    "kinect_v2": KinectV2,
    "kinect_v2_far": lambda: KinectV2(range_m=(0.5, 8.0)),
    "stereo": Stereo,
    "perfect": Perfect,
}
"""Name -> what makes the sensor with its usual camera."""

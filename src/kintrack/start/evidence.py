# SPDX-License-Identifier: Apache-2.0
"""What one frame tells of one labelled person: sampled points, and images of what is free."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.geometry import LABELS, PinholeCamera, transform_points

SAMPLES = 45
"""About how many points of each part are looked at."""
LEAST = 6
"""Parts with fewer pixels are left out."""


class Evidence(NamedTuple):
    """What is known of one person in one frame."""

    points_world: Float[ndarray, "n 3"]
    """Sampled points, part after part [m]."""
    weights_m2: Float[ndarray, " n"]
    """Area that each point stands for, across the line of sight [m^2]."""
    ends: Int[ndarray, " 7"]
    """Part y has the points ends[y-1] to ends[y]."""
    depth_m: Float[ndarray, "h w"]
    """Depth at working resolution [m]; 0 = no reading. Beside the person the least of a pixel and
    its neighbours, so that skin on the rim of an overlooked limb does not stand in free space."""
    away_px: Float[ndarray, "h w"]
    """Distance of each pixel from the person's [px]."""
    labels: UInt8[ndarray, "h w"]
    """The person's labels; 0 elsewhere."""
    camera: PinholeCamera
    """Camera of those images."""
    T_world_camera: Float[ndarray, "4 4"]
    """Its pose."""
    has_background: bool
    """False if an empty pixel is free space."""

    @property
    def intrinsics(self) -> Float[ndarray, " 4"]:
        """Focal lengths and principal point [px]."""
        camera = self.camera
        return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


def evidence_of(observation: Observation, T_world_camera: Float[ndarray, "4 4"]) -> Evidence:
    """Points and images of a labelled person.

    Args:
        observation: Labels of one person only.
        T_world_camera: Camera pose.

    Returns:
        The evidence; parts with hardly a pixel are left out.
    """
    assert observation.labels is not None
    camera, z = observation.camera, np.ascontiguousarray(observation.points_camera[..., 2])
    labels = np.where(observation.region, observation.labels, np.uint8(0))
    labels[labels >= len(LABELS)] = 0
    points, weights = [np.zeros((0, 3))], [np.zeros(0)]
    ends = np.zeros(len(LABELS), np.int64)
    for part in range(1, len(LABELS)):
        rows, columns = np.nonzero(labels == part)
        if len(rows) >= LEAST:
            step = max(1, int(np.sqrt(len(rows) / SAMPLES)))
            kept = (rows % step == 0) & (columns % step == 0)
            if kept.sum() < LEAST:
                kept[:] = True
            area = np.sum(z[rows, columns] ** 2) / (camera.fx * camera.fy)
            points.append(observation.points_camera[rows[kept], columns[kept]])
            weights.append(np.full(kept.sum(), area / kept.sum()))
        ends[part] = sum(map(len, points))
    nearest = cv2.erode(np.where(z > 0, z, np.inf), np.ones((3, 3), np.uint8))
    away = cv2.distanceTransform((labels == 0).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    return Evidence(
        transform_points(T_world_camera, np.concatenate(points)),
        np.concatenate(weights),
        ends,
        np.where((labels > 0) | (z == 0), z, nearest),
        away,
        labels,
        camera,
        T_world_camera,
        observation.has_background,
    )

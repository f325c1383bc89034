# SPDX-License-Identifier: Apache-2.0
"""One rough place per body part from the label map [Wan19, 6].

The image is cut into bins; of each part the bin with the most pixels wins, not the mean of all,
which a few wrong labels far away would drag along. Its median point is pushed inward along the line
of sight by half the part's thickness and stands for the model joint at the part's middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.bounds import check_bounds
from kintrack.geometry import LABELS
from kintrack.joints import JOINT_NAMES

JOINT_OF_PART = {
    "head": "neck",
    "torso": "chest",
    "right_arm": "r_elbow",
    "left_arm": "l_elbow",
    "right_leg": "r_knee",
    "left_leg": "l_knee",
}
"""Part -> model joint at its middle [Wan19]; `neck` is the base of the skull."""
DEPTH_OF_PART_M = {
    "head": 0.09,
    "torso": 0.11,
    "right_arm": 0.045,
    "left_arm": 0.045,
    "right_leg": 0.065,
    "left_leg": 0.065,
}
"""Half the part's thickness [m], rounded from the average adult of `model/`."""


@dataclass(frozen=True)
class TargetConfig:
    """How places are found."""

    bin_m: float = 0.14
    """Side of a bin at the part's distance [m]."""
    least_m2: float = 0.003
    """Parts that show less give no target [m^2]."""

    def __post_init__(self) -> None:
        check_bounds(self, bin_m=(0.01, 1), least_m2=(0, 1))


@dataclass(frozen=True)
class Targets:
    """Places of the parts that show."""

    parts: UInt8[ndarray, " n"]
    """Label of each part."""
    joints: Int[ndarray, " n"]
    """Row of `JOINT_NAMES` that each stands for."""
    places_camera: Float[ndarray, "n 3"]
    """Where it is, camera frame [m]."""


def find_targets(observation: Observation, config: TargetConfig | None = None) -> Targets:
    """The densest place of every part.

    Args:
        observation: Labelled points of one person, see `kintrack.people.only`.
        config: How places are found.

    Returns:
        One target per part that shows enough; none without labels.
    """
    config = TargetConfig() if config is None else config
    parts, places = [], []
    camera, points = observation.camera, observation.points_camera
    for label in range(1, len(LABELS)):
        if observation.labels is None:
            break
        rows, columns = np.nonzero((observation.labels == label) & observation.region)
        if len(rows) == 0:
            continue
        seen = points[rows, columns]
        z = float(np.median(seen[:, 2]))
        if len(seen) * z * z / (camera.fx * camera.fy) < config.least_m2:
            continue
        side = max(2, round(config.bin_m * camera.fx / z))
        bins = (rows // side) * (camera.width // side + 1) + columns // side
        middle = np.median(seen[bins == np.bincount(bins).argmax()], axis=0)
        inward = DEPTH_OF_PART_M[LABELS[label]] / np.linalg.norm(middle)
        parts.append(label)
        places.append(middle * (1.0 + inward))
    joints = [JOINT_NAMES.index(JOINT_OF_PART[LABELS[label]]) for label in parts]
    return Targets(
        np.array(parts, dtype=np.uint8),
        np.array(joints, dtype=np.int64),
        np.array(places, dtype=float).reshape(-1, 3),
    )

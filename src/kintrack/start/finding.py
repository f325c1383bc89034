# SPDX-License-Identifier: Apache-2.0
"""A start with or without labels."""

from __future__ import annotations

from jaxtyping import Float
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.config import TrackerConfig
from kintrack.human import Human
from kintrack.labelled_config import LabelledStartConfig
from kintrack.start.begun import Start
from kintrack.start.blob import start
from kintrack.start.labelled import start_at


def found_by(
    human: Human,
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    labelled: LabelledStartConfig,
) -> Start | None:
    """The best start; None if nobody is found.

    Args:
        human: Body and skin.
        observation: The person's points if they are labelled, else all.
        T_world_camera: Camera pose.
        config: All weights.
        labelled: How many headings and fits, where there are labels.
    """
    if observation.labels is None:
        return start(human, observation, T_world_camera, config)
    return start_at(human, observation, T_world_camera, config, labelled)

# SPDX-License-Identifier: Apache-2.0
"""Which pixels are the person's, and when tracking ends: what the tracker asks before a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.config import JudgeConfig
from kintrack.geometry import transform_points
from kintrack.labelled_config import LabelledConfig, LifecycleConfig, Limits
from kintrack.objective_config import PullConfig
from kintrack.people import find_people, only, without_others
from kintrack.residuals.targets import TargetResidual
from kintrack.targets import find_targets
from kintrack.whereabouts import Whereabouts, follow, mine, seek


def geometric_lifecycle(judge: JudgeConfig) -> LifecycleConfig:
    """When tracking begins and ends without labels."""
    return LifecycleConfig(
        begin=Limits(judge.max_rms_m, judge.start_explained, judge.min_supported, 0.0),
        stay=Limits(judge.max_rms_m, judge.min_explained, judge.min_supported, 0.0),
        patience=judge.patience,
        young=0,
        retry=0,
    )


def own_pixels(
    observation: Observation,
    where: Whereabouts,
    tracked: bool,
    timestamp_s: float,
    T_world_camera: Float[ndarray, "4 4"],
    config: LabelledConfig,
) -> tuple[Observation, Whereabouts]:
    """The observation without the labels of people who are not followed.

    Args:
        observation: All labelled points.
        where: Who was where.
        tracked: True while the person is tracked.
        timestamp_s: When [s].
        T_world_camera: Camera pose.
        config: Who is a person, and who is who.

    Returns:
        The observation and who is where now. While he is tracked, whoever surely is somebody else
        is taken out; it is the whole if he cannot be told from the others. While he is not, it has
        the pixels of one person alone, and no region if he is not in view. Without labels nothing
        changes.
    """
    if observation.labels is None:
        return observation, where
    people = find_people(observation, T_world_camera, config.start.people)
    if tracked:
        own = mine(where, people, timestamp_s, config.whereabouts)
        where = follow(where, own, people, timestamp_s, config.whereabouts)
        if own is not None:
            observation = without_others(observation, own, people, config.start.people)
        return observation, where
    where, own = seek(where, people, timestamp_s, config.whereabouts)
    if own is None:
        nobody = np.zeros_like(observation.region)
        return replace(observation, region=nobody), where
    return only(observation, own), where


def part_pull(
    observation: Observation, T_world_camera: Float[ndarray, "4 4"], config: PullConfig
) -> TargetResidual:
    """A pull at joints that are far from where their part shows [Wan19, 6]; none without labels.

    Args:
        observation: The person's labelled points.
        T_world_camera: Camera pose.
        config: Weight and free distance.
    """
    found = find_targets(observation)
    places = transform_points(T_world_camera, found.places_camera)
    return TargetResidual(found.joints, places, config.sigma_m, config.free_m)

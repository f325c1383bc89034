# SPDX-License-Identifier: Apache-2.0
"""How much of the skin lies on pixels of its own part."""

from dataclasses import replace

import numpy as np
import pytest

from kintrack.alignment import view_skin
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid
from kintrack.judge import label_agreement, label_counts
from kintrack.sides import OTHER_SIDE
from labelled_people import labelled


def view_of(scene, q, observation):
    state = run_kinematics(scene.human.body, q)
    T = invert_rigid(T_LEVEL_WORLD_CAMERA)
    return view_skin(scene.human, state, T, observation, TrackerConfig())


@pytest.fixture(scope="module")
def facing(scene):
    """Somebody's configuration, the observation, and the view in the true and the turned pose."""
    q, turned = scene.place(), scene.place(heading_deg=180.0)
    observation = labelled(scene, q)
    return q, observation, view_of(scene, q, observation), view_of(scene, turned, observation)


def test_a_true_pose_agrees_with_its_labels_and_a_turned_one_does_not(facing):
    _, observation, right, turned = facing
    assert label_agreement(label_counts(right, observation)) > 0.95
    assert label_agreement(label_counts(turned, observation)) < 0.75


def test_where_nothing_is_labelled_nothing_is_said(facing):
    _, observation, right, _ = facing
    counts = label_counts(right, replace(observation, labels=None))
    assert counts.sum() == 0
    assert np.isnan(label_agreement(counts))


def test_swapped_sides_are_counted_as_the_other_side(facing):
    _, observation, right, _ = facing
    counts = label_counts(right, observation)
    swapped = label_counts(right, replace(observation, labels=OTHER_SIDE[observation.labels]))
    assert np.array_equal(swapped, counts[:, OTHER_SIDE[: len(counts)]])
    assert label_agreement(swapped) < 0.7

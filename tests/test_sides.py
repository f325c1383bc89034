# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.alignment import view_skin
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid
from kintrack.sides import OTHER_SIDE, settle_sides
from labelled_people import labelled


@pytest.fixture(scope="module")
def scene(scene, human):
    """Filmed bare, so that the thighs do not touch."""
    return replace(scene, human=human)


def settled(scene, q, observation, side_m=0.08):
    state = run_kinematics(scene.human.body, q)
    T = invert_rigid(T_LEVEL_WORLD_CAMERA)
    view = view_skin(scene.human, state, T, observation, TrackerConfig())
    return settle_sides(observation, view.vertices_camera, view.visible, view.labels, side_m).labels


def test_sides_that_a_network_swapped_are_put_right_by_a_known_body(scene):
    q = scene.place(heading_deg=180.0)
    observation = labelled(scene, q)
    swapped = replace(observation, labels=OTHER_SIDE[observation.labels])
    assert (settled(scene, q, swapped) == observation.labels).mean() > 0.998
    assert (swapped.labels == observation.labels).mean() < 0.97


def test_right_sides_stay_even_if_the_body_is_a_hands_breadth_off(scene):
    q = scene.place()
    observation = labelled(scene, q)
    q[1] += 0.1
    assert (settled(scene, q, observation) == observation.labels).mean() > 0.995


def test_sides_are_believed_if_the_margin_is_wide(scene):
    q = scene.place()
    observation = labelled(scene, q)
    swapped = replace(observation, labels=OTHER_SIDE[observation.labels])
    assert np.array_equal(settled(scene, q, swapped, side_m=5.0), swapped.labels)


def test_head_torso_and_background_never_change(scene):
    q = scene.place(heading_deg=180.0)
    observation = labelled(scene, q)
    others = observation.labels < 3
    swapped = replace(observation, labels=OTHER_SIDE[observation.labels])
    assert np.array_equal(settled(scene, q, swapped)[others], observation.labels[others])


def test_without_labels_nothing_happens(scene):
    q = scene.place()
    observation = replace(labelled(scene, q), labels=None)
    assert settled(scene, q, observation) is None

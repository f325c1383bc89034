# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.geometry import LABELS
from kintrack.joints import JOINT_NAMES
from kintrack.targets import JOINT_OF_PART, TargetConfig, find_targets
from labelled_people import board, labelled


@pytest.fixture(scope="module")
def scene(scene, human):
    """Filmed bare: the head is as small as the wrong labels beside it."""
    return replace(scene, human=human)


def names(targets):
    return [LABELS[part] for part in targets.parts]


@pytest.mark.parametrize("heading_deg", [0.0, 180.0])
def test_every_part_of_somebody_standing_has_a_target_near_its_joint(scene, heading_deg):
    q = scene.place(heading_deg=heading_deg)
    targets = find_targets(labelled(scene, q))
    assert names(targets) == list(LABELS[1:])
    assert [JOINT_NAMES[j] for j in targets.joints] == [JOINT_OF_PART[n] for n in names(targets)]
    away = np.linalg.norm(scene.joints(q)[targets.joints] - targets.places_camera, axis=1)
    assert away.max() < 0.35  # the densest bin of a limb lies anywhere along it
    assert np.median(away) < 0.2


def test_a_target_lies_inside_the_body_not_on_its_skin(scene):
    observation = labelled(scene, scene.place())
    targets = find_targets(observation)
    chest = targets.places_camera[names(targets).index("torso")]
    u, v = np.rint(observation.camera.project(chest)).astype(int)
    assert 0.05 < chest[2] - observation.points_camera[v, u, 2] < 0.15


def test_wrong_labels_far_away_do_not_move_a_target(scene):
    observation = labelled(scene, scene.place())
    labels = observation.labels.copy()
    labels[5:12, 5:12] = LABELS.index("head")
    wrong = replace(observation, labels=labels, region=labels > 0)
    right, moved = find_targets(observation), find_targets(wrong)
    assert np.allclose(right.places_camera, moved.places_camera, atol=0.03)
    head = labels == LABELS.index("head")
    mean = observation.points_camera[head].mean(axis=0)
    assert np.linalg.norm(mean - right.places_camera[0]) > 0.3


def test_parts_that_hardly_show_have_none(scene):
    legs = board(scene, 2.0, (0, 320), (105, 240))
    targets = find_targets(labelled(scene, scene.place(), things=[legs]))
    assert not {"right_leg", "left_leg"} & set(names(targets))
    few = find_targets(labelled(scene, scene.place()), TargetConfig(least_m2=0.08))
    assert names(few) == ["torso", "right_leg", "left_leg"]


def test_without_labels_there_are_none(scene):
    targets = find_targets(replace(labelled(scene, scene.place()), labels=None))
    assert len(targets.parts) == 0
    assert targets.places_camera.shape == (0, 3)

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.errors import ConfigError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA as T
from kintrack.joints import JOINT_NAMES
from kintrack.labelled_config import PeopleConfig
from kintrack.people import choose, find_people, only
from labelled_people import board, labelled, world_joints

CHEST = JOINT_NAMES.index("chest")


def test_nobody_is_found_without_labels_and_where_none_says_person(scene):
    assert find_people(replace(labelled(scene), labels=None), T) == ()
    assert find_people(labelled(scene), T) == ()


def test_two_people_are_two_and_each_is_where_he_stands(scene):
    left, right = scene.place(at=(3.0, 0.7, 0.0)), scene.place(at=(2.5, -0.6, 0.0))
    observation = labelled(scene, left, right)
    found = find_people(observation, T)
    assert len(found) == 2
    for q in (left, right):
        chest = world_joints(scene, q)[CHEST]
        assert min(np.linalg.norm(body.place_world - chest) for body in found) < 0.3
    assert not (found[0].mask & found[1].mask).any()
    assert (found[0].mask | found[1].mask).sum() > 0.98 * (observation.labels > 0).sum()
    assert found[0].area_m2 >= found[1].area_m2 > 0.3


def test_somebody_cut_in_two_by_a_board_is_one(scene):
    q = scene.place(at=(3.0, 0.0, 0.0))
    cut = board(scene, 2.0, (0, 320), (120, 150))
    observation = labelled(scene, q, things=[cut])
    found = find_people(observation, T)
    assert len(found) == 1
    assert found[0].mask[:120].any() and found[0].mask[150:].any()


def test_somebody_right_behind_another_is_not_joined_with_him(scene):
    near, far = scene.place(at=(2.2, 0.0, 0.0)), scene.place(at=(3.0, 0.3, 0.0))
    found = find_people(labelled(scene, near, far), T)
    assert len(found) == 2


def test_labels_that_spill_onto_the_wall_are_left_out(scene):
    observation = labelled(scene, scene.place())
    labels = observation.labels.copy()
    for shift in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        rolled = np.roll(observation.labels, shift, (0, 1))
        labels = np.where(labels == 0, rolled, labels)
    found = find_people(replace(observation, labels=labels, region=labels > 0), T)
    assert len(found) == 1
    wall = observation.points_camera[..., 2] > 4.4
    assert (labels[wall] > 0).sum() > 200
    assert (found[0].mask & wall).sum() == 0


def test_the_nearer_is_chosen_unless_a_place_is_given(scene):
    near, far = scene.place(at=(2.3, -0.7, 0.0)), scene.place(at=(3.2, 0.7, 0.0))
    found = find_people(labelled(scene, near, far), T)
    assert choose(found).distance_m < 2.5
    assert choose(found, np.array([3.2, 0.7, 0.2])).distance_m > 2.9
    assert choose(()) is None


def test_a_sliver_beside_a_whole_person_is_not_chosen(scene):
    whole, sliver = scene.place(at=(3.4, 0.5, 0.0)), scene.place(at=(1.8, -0.7, 0.0))
    hide = board(scene, 1.2, (160, 290), (0, 240))
    found = find_people(labelled(scene, whole, sliver, things=[hide]), T)
    assert len(found) == 2
    assert choose(found).distance_m > 3.0


def test_somebody_whom_the_side_of_the_image_cuts_is_chosen_only_for_want_of_others(scene):
    whole, cut = scene.place(at=(3.2, 0.0, 0.0)), scene.place(at=(2.0, 1.05, 0.0))
    found = find_people(labelled(scene, whole, cut), T)
    assert sorted(body.cut for body in found) == [False, True]
    assert choose(found).distance_m > 2.9
    assert choose(tuple(body for body in found if body.cut)).cut


def test_only_one_persons_labels_are_left(scene):
    observation = labelled(scene, scene.place(at=(2.5, -0.6, 0.0)), scene.place(at=(3, 0.7, 0)))
    body = find_people(observation, T)[1]
    alone = only(observation, body)
    assert np.array_equal(alone.region, body.mask)
    assert np.array_equal(alone.labels > 0, body.mask)
    assert len(find_people(alone, T)) == 1


def test_a_distance_without_sense_is_refused():
    with pytest.raises(ConfigError, match="edge_m = -1"):
        PeopleConfig(edge_m=-1)

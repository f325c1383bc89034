# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.alignment import view_skin
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.flips import FlipWatch, questioned, unflipped, watched
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid
from kintrack.joints import JOINT_NAMES
from kintrack.judge import label_counts
from kintrack.labelled_config import FlipConfig, LabelledConfig
from kintrack.sides import OTHER_SIDE
from labelled_people import labelled

CONFIG = FlipConfig(ages=())
LABELLED = LabelledConfig(flips=CONFIG)
CHEST = JOINT_NAMES.index("chest")


def view_of(scene, q, observation):
    state = run_kinematics(scene.human.body, q)
    T = invert_rigid(T_LEVEL_WORLD_CAMERA)
    return view_skin(scene.human, state, T, observation, TrackerConfig())


def frames(watch, counts, n):
    for _ in range(n):
        watch = watched(watch, counts, CONFIG)
    return watch


@pytest.fixture(scope="module")
def facing(scene):
    """Somebody's configuration, the observation, and the view in the true and the turned pose."""
    q, turned = scene.place(), scene.place(heading_deg=180.0)
    observation = labelled(scene, q)
    return q, observation, view_of(scene, q, observation), view_of(scene, turned, observation)


def test_where_nothing_is_labelled_nothing_is_said(facing):
    _, observation, right, _ = facing
    counts = label_counts(right, replace(observation, labels=None))
    assert counts.sum() == 0
    assert watched(FlipWatch(), counts, CONFIG) == FlipWatch(age=1)


def test_a_turned_pose_is_suspected_after_several_frames_not_after_one(facing):
    _, observation, right, turned = facing
    wrong, fine = label_counts(turned, observation), label_counts(right, observation)
    assert not frames(FlipWatch(), wrong, 2).suspects(CONFIG)
    assert frames(FlipWatch(), wrong, 15).suspects(CONFIG)
    assert not frames(FlipWatch(), fine, 100).suspects(CONFIG)


def test_a_network_that_errs_for_a_third_of_a_second_is_outvoted_by_a_long_good_track(facing):
    _, observation, right, _ = facing
    wrong = replace(observation, labels=OTHER_SIDE[observation.labels])
    long = frames(FlipWatch(), label_counts(right, observation), 60)
    assert not frames(long, label_counts(right, wrong), 10).suspects(CONFIG)
    assert frames(long, label_counts(right, wrong), 40).suspects(CONFIG)


def test_legs_alone_may_be_swapped(facing):
    _, observation, right, _ = facing
    labels = observation.labels.copy()
    legs = labels >= 5
    labels[legs] = OTHER_SIDE[labels[legs]]
    watch = frames(FlipWatch(), label_counts(right, replace(observation, labels=labels)), 15)
    assert watch.suspects(CONFIG)
    assert watch.arms > 0 > watch.legs


def test_a_young_track_is_questioned_at_set_ages(facing):
    _, observation, right, _ = facing
    fine, ages = label_counts(right, observation), FlipConfig(ages=(3, 5))
    asked = []
    watch = FlipWatch()
    for frame in range(1, 8):
        watch = watched(watch, fine, ages)
        asked += [frame] if watch.suspects(ages) else []
    assert asked == [3, 5]


def arguments(scene, q, view, observation):
    state = run_kinematics(scene.human.body, q)
    return scene.human, state, view, observation, T_LEVEL_WORLD_CAMERA, TrackerConfig(), LABELLED


def test_after_a_try_some_frames_pass(scene, facing):
    q, observation, right, turned = facing
    wrong = label_counts(turned, observation)
    watch = frames(FlipWatch(), wrong, 15)
    watch, _ = questioned(watch, *arguments(scene, q, turned, observation))
    assert watch.wait == CONFIG.again
    watch = frames(watch, wrong, CONFIG.again - 1)
    assert not watch.suspects(CONFIG)
    assert frames(watch, wrong, 1).suspects(CONFIG)


def test_labels_of_one_part_ask_nothing(scene, facing):
    q, observation, _, turned = facing
    blind = replace(observation, labels=np.where(observation.labels > 0, 4, 0).astype(np.uint8))
    watch = FlipWatch(arms=-20.0)
    watch, found = questioned(watch, *arguments(scene, q, turned, blind))
    assert found is None and watch.wait == 0


def test_a_turned_pose_is_put_right_and_a_true_one_is_kept(scene, facing):
    q, observation, right, turned = facing
    chest = run_kinematics(scene.human.body, q).joint_positions_world[CHEST]
    known = (observation, T_LEVEL_WORLD_CAMERA, TrackerConfig(), LABELLED)
    found = unflipped(scene.human, turned, chest, *known)
    assert scene.errors(q, scene.joints(found.fit.state.q)).mean() < 0.05
    assert unflipped(scene.human, right, chest, *known) is None
    assert unflipped(scene.human, turned, chest + [0.0, 2.0, 0.0], *known) is None

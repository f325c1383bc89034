# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.config import TrackerConfig
from kintrack.errors import ConfigError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA as T
from kintrack.human import ARMS_OUT_DEG, SITTING_DEG
from kintrack.joints import JOINT_NAMES
from kintrack.labelled_config import LabelledStartConfig
from kintrack.sides import OTHER_SIDE
from kintrack.start import start_from_labels
from kintrack.start.evidence import evidence_of
from kintrack.start.placing import WEAK_M2, guesses, rested
from kintrack.start.postures import ARMS_DEG, LEGS_DEG, TRUNKS_DEG, postures_of
from labelled_people import board, labelled, world_joints

CONFIG = TrackerConfig()
LEGS = [n for n, name in enumerate(JOINT_NAMES) if name[2:] in ("knee", "ankle", "foot")]
STEPPING_DEG = {
    "l_hip_flexion": 35.0,
    "l_knee_flexion": 30.0,
    "r_hip_flexion": -10.0,
    "r_knee_flexion": 20.0,
}


def errors(scene, q, found):
    return np.linalg.norm(found.fit.state.joint_positions_world - world_joints(scene, q), axis=1)


@pytest.mark.parametrize("heading_deg", [0, 70, 135, 180, -110])
@pytest.mark.parametrize(
    "degrees", [STEPPING_DEG, SITTING_DEG, ARMS_OUT_DEG], ids=["stepping", "sitting", "arms out"]
)
def test_somebody_is_found_at_any_heading(scene, degrees, heading_deg):
    q = scene.place(degrees, heading_deg, at=(2.9, 0.2, 0.0))
    observation = labelled(scene, q)
    found = start_from_labels(scene.human, observation, T, CONFIG)
    assert errors(scene, q, found).mean() < 0.08
    assert found.agreed.explained > 0.9


def test_somebody_cut_by_the_image_and_behind_a_board_is_found(scene):
    q = scene.place(None, 160.0, at=(1.9, 0.75, 0.0))
    hide = board(scene, 1.2, (0, 320), (170, 240))
    observation = labelled(scene, q, things=[hide])
    found = start_from_labels(scene.human, observation, T, CONFIG)
    away = errors(scene, q, found)
    seen = [n for n in range(len(away)) if n not in LEGS]
    assert away[seen].mean() < 0.12


def test_of_two_people_the_one_near_the_last_place_is_taken(scene):
    left, right = scene.place(at=(3.0, 0.7, 0.0)), scene.place(at=(2.4, -0.6, 0.0))
    observation = labelled(scene, left, right)
    for q in (left, right):
        found = start_from_labels(scene.human, observation, T, CONFIG, near_world=q[:3])
        assert errors(scene, q, found).mean() < 0.05
    nearest = start_from_labels(scene.human, observation, T, CONFIG)
    assert errors(scene, right, nearest).mean() < 0.05


def test_wrong_sides_of_both_legs_do_not_turn_the_body(scene):
    q = scene.place(SITTING_DEG, 20.0)
    observation = labelled(scene, q)
    labels = observation.labels.copy()
    legs = labels >= 5
    labels[legs] = OTHER_SIDE[labels[legs]]
    found = start_from_labels(scene.human, replace(observation, labels=labels), T, CONFIG)
    assert errors(scene, q, found).mean() < 0.1


def test_a_leg_that_is_overlooked_is_guessed_as_the_other_one(scene):
    postures = postures_of(scene.human)
    for leg in (0, 4):
        q = postures.configuration(0, np.array([0, 0, leg, leg]))
        q[:3] = scene.place(at=(2.8, 0.0, 0.0))[:3]
        observation = labelled(scene, q)
        labels = np.where(observation.labels == 6, np.uint8(0), observation.labels)
        seen = replace(observation, labels=labels, region=observation.region & (labels > 0))
        vertices = len(scene.human.skin.labels)
        best = guesses(postures, evidence_of(seen, T), 12, 0.05, vertices, 12)[0]
        away = np.linalg.norm(world_joints(scene, best.q) - world_joints(scene, q), axis=1)
        assert away[[n for n in LEGS if JOINT_NAMES[n].startswith("l_")]].mean() < 0.2


def test_a_hardly_seen_limb_is_also_tried_at_rest():
    choice = np.array([3, 7, 2, 9])
    seen, hardly = 2 * WEAK_M2, 0.5 * WEAK_M2
    assert (rested(choice, np.full(4, seen)) == choice).all()
    assert rested(choice, np.array([hardly, seen, seen, seen])).tolist() == [0, 7, 2, 9]
    assert rested(choice, np.array([seen, seen, seen, hardly])).tolist() == [3, 7, 2, 2]
    assert rested(choice, np.array([seen, seen, 0.0, hardly])).tolist() == [3, 7, 9, 9]


def test_guesses_with_an_arm_of_few_pixels_come_with_one_whose_arm_rests(scene):
    q = scene.place(ARMS_OUT_DEG, at=(2.9, 0.0, 0.0))
    observation = labelled(scene, q)
    arm = np.argwhere(observation.labels == 3)
    labels = observation.labels.copy()
    labels[tuple(arm[12:].T)] = 0
    few = evidence_of(replace(observation, labels=labels, region=labels > 0), T)
    tries = guesses(postures_of(scene.human), few, 12, 0.1, len(scene.human.skin.labels), 4)
    right = postures_of(scene.human).arms[:4]
    resting = postures_of(scene.human).configuration(0, np.zeros(4, int))[right]
    assert len(tries) > 4
    assert any(np.allclose(one.q[right], resting) for one in tries)


def test_nobody_is_found_where_nobody_is_labelled(scene):
    observation = labelled(scene)
    assert start_from_labels(scene.human, observation, T, CONFIG) is None
    assert start_from_labels(scene.human, replace(observation, labels=None), T, CONFIG) is None


def test_limbs_alone_are_no_body(scene):
    observation = labelled(scene, scene.place(None, 0.0, at=(2.9, 0.2, 0.0)))
    legs = np.where(observation.labels >= 5, observation.labels, 0).astype(np.uint8)
    alone = replace(observation, labels=legs, region=legs > 0)
    assert start_from_labels(scene.human, observation, T, CONFIG) is not None
    assert start_from_labels(scene.human, alone, T, CONFIG) is None


def test_the_same_frame_gives_the_same_start_to_the_bit(scene):
    observation = labelled(scene, scene.place(STEPPING_DEG, 100.0))
    one, two = (start_from_labels(scene.human, observation, T, CONFIG) for _ in range(2))
    assert np.array_equal(one.fit.state.q, two.fit.state.q)
    assert one.mismatch_m2 == two.mismatch_m2


def test_a_guess_is_the_body_that_its_postures_drew(human):
    postures = postures_of(human)
    q = postures.configuration(2, np.array([3, 5, 8, 6]))
    body = human.body
    for side, arm, leg in (("r", 3, 8), ("l", 5, 6)):
        assert np.degrees(q[body.dof(f"{side}_elbow_flexion") + 1]) == pytest.approx(
            ARMS_DEG[arm][3]
        )
        assert np.degrees(q[body.dof(f"{side}_hip_flexion") + 1]) == pytest.approx(LEGS_DEG[leg][0])
    flexion = q[body.dof("spine_flexion") + 1] + q[body.dof("chest_flexion") + 1]
    assert np.degrees(flexion) == pytest.approx(TRUNKS_DEG[2][1])


def test_the_best_guess_is_near_before_anything_is_fitted(scene):
    q = scene.place(None, 90.0)
    evidence = evidence_of(labelled(scene, q), T)
    found = guesses(postures_of(scene.human), evidence, 12, 0.05, len(scene.human.skin.labels), 12)
    costs = [guess.mismatch_m2 + guess.unrest_m2 for guess in found]
    assert costs == sorted(costs)
    guess = world_joints(scene, found[0].q)
    assert np.linalg.norm(guess - world_joints(scene, q), axis=1).mean() < 0.1


def test_numbers_without_sense_are_refused():
    with pytest.raises(ConfigError, match="headings = 1"):
        LabelledStartConfig(headings=1)

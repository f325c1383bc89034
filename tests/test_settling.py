# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np

from kintrack.alignment import view_skin
from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid
from kintrack.settling import settle_doubts
from labelled_people import board, labelled

TORSO, R_ARM, L_ARM = 2, 3, 4
DOUBT_M = 0.06


def doubted(observation, where, first, second):
    """The observation of a network that wavers somewhere."""
    labels = np.where(where, np.uint8(first), observation.labels)
    other = np.where(where, np.uint8(second), labels).astype(np.uint8)
    return replace(observation, labels=labels, second=other, region=labels > 0)


def settled(scene, q, observation, doubt_m=DOUBT_M):
    state = run_kinematics(scene.human.body, q)
    T = invert_rigid(T_LEVEL_WORLD_CAMERA)
    view = view_skin(scene.human, state, T, observation, TrackerConfig())
    return settle_doubts(observation, view, doubt_m)


def test_what_was_overlooked_is_found_where_the_body_is_expected(scene):
    q = scene.place()
    seen = labelled(scene, q)
    out = settled(scene, q, doubted(seen, seen.labels == R_ARM, 0, TORSO))
    arm = seen.labels == R_ARM
    assert (out.labels[arm] == R_ARM).mean() > 0.9 and out.region[arm].mean() > 0.9
    assert np.array_equal(out.labels[~arm], seen.labels[~arm])


def test_a_part_in_doubt_is_what_lies_there(scene):
    q = scene.place()
    seen = labelled(scene, q)
    arm = seen.labels == L_ARM
    out = settled(scene, q, doubted(seen, arm, TORSO, L_ARM))
    assert (out.labels[arm] == L_ARM).mean() > 0.9
    assert np.array_equal(out.labels[~arm], seen.labels[~arm])


def test_the_place_decides_nothing_of_which_a_network_is_sure(scene):
    q = scene.place()
    seen = labelled(scene, q)
    for label in (0, TORSO):
        sure = doubted(seen, seen.labels == R_ARM, label, label)
        assert np.array_equal(settled(scene, q, sure).labels, sure.labels)


def test_a_second_guess_far_from_its_skin_stays_a_guess(scene):
    q = scene.place()
    seen = labelled(scene, q)
    torn = doubted(seen, seen.labels == TORSO, TORSO, 1)
    changed = settled(scene, q, torn).labels != torn.labels
    assert changed.sum() < 0.1 * (seen.labels == TORSO).sum()


def test_a_thing_apart_from_her_is_not_claimed(scene):
    q = scene.place()
    seen = labelled(scene, q)
    z = float(np.median(seen.points_camera[seen.labels == TORSO][:, 2]))
    rows, columns = np.nonzero(seen.labels == TORSO)
    left, top = int(np.median(columns)), int(np.median(rows))
    thing = board(scene, z - 0.3, (2 * left - 8, 2 * left + 8), (2 * top - 8, 2 * top + 8))
    hidden = labelled(scene, q, things=(thing,))
    before = hidden.points_camera[..., 2] < z - 0.2
    assert before.any()
    torn = doubted(hidden, before, 0, TORSO)
    assert not (settled(scene, q, torn).labels[before] > 0).any()


def test_nobody_labelled_claims_nothing(scene):
    q = scene.place()
    seen = labelled(scene, q)
    nobody = doubted(seen, seen.labels > 0, 0, TORSO)
    assert not settled(scene, q, nobody).region.any()


def test_without_second_guesses_nothing_happens(scene):
    q = scene.place()
    seen = labelled(scene, q)
    assert seen.second is None and settled(scene, q, seen) is seen
    torn = doubted(seen, seen.labels == R_ARM, 0, R_ARM)
    assert settled(scene, q, torn, doubt_m=0.0) is torn


def test_second_guesses_come_with_an_observation(scene):
    frame = scene.frame(np.full((scene.camera.height, scene.camera.width), 3.0, np.float32))
    guesses = np.zeros((2, 106, 128), dtype=np.uint8)
    guesses[1] = TORSO
    seen = observe(frame, 320, labels=guesses)
    assert not seen.region.any() and (seen.second == TORSO).all()

# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np
import pytest

from kintrack.metrics import (
    accelerations_m_s2,
    accuracy_curve,
    joint_distances,
    offset_free_distances,
    score,
    swapped_limbs,
    torso_rotations,
)

TORSO = ("l_hip", "r_hip", "l_shoulder", "r_shoulder")
FACING = np.array([[0.1, 0.5, 2], [-0.1, 0.5, 2], [0.2, 0.0, 2], [-0.2, 0.0, 2]])
"""Torso joints of a person who faces the camera, whose left is at the camera's right."""


def turn(angle_rad):
    """Rotation about the camera's y axis."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def score_plain(estimate, reference, names=None):
    names = names or [f"joint{i}" for i in range(estimate.shape[1])]
    unknown = np.full((len(estimate), 3, 3), np.nan)
    return score(names, estimate, reference, np.arange(len(estimate)) / 10, unknown)


def test_mean_and_median_are_those_worked_out_by_hand():
    reference = np.zeros((3, 2, 3))
    estimate = np.zeros((3, 2, 3))
    estimate[:, 0, 0] = [0.03, 0.05, 0.10]
    estimate[:, 1] = [[0.03, 0.04, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.01]]
    scores = score_plain(estimate, reference)
    np.testing.assert_allclose(scores.joint_mean_m, [0.06, 0.02])
    np.testing.assert_allclose(scores.joint_median_m, [0.05, 0.01])
    assert scores.mean_m == pytest.approx(0.04) and scores.median_m == pytest.approx(0.04)
    assert (scores.frames, scores.samples, scores.coverage) == (3, 6, 1.0)


def test_a_joint_missing_on_either_side_is_left_out_but_lowers_coverage_only_if_it_was_wanted():
    reference = np.zeros((2, 3, 3))
    estimate = np.full((2, 3, 3), 0.0)
    estimate[..., 0] = 0.1
    estimate[0, 0, 2] = np.nan
    reference[:, 1] = np.nan
    estimate[1] = np.nan
    scores = score_plain(estimate, reference)
    assert (scores.frames, scores.samples, scores.coverage) == (1, 1, 0.25)
    assert scores.mean_m == pytest.approx(0.1)
    np.testing.assert_allclose(scores.joint_mean_m, [np.nan, np.nan, 0.1])


def test_nothing_to_compare_gives_nan_without_a_warning(recwarn):
    empty = np.full((4, 2, 3), np.nan)
    scores = score_plain(empty, empty, ["l_knee", "r_knee"])
    assert scores.samples == 0 and scores.swap_frames == 0
    assert np.isnan([scores.mean_m, scores.coverage, scores.jitter_m_s2]).all()
    assert np.isnan(scores.accuracy).all() and len(recwarn) == 0


def test_accuracy_counts_distances_at_the_threshold_and_leaves_missing_ones_out():
    distances = np.array([[0.01, 0.05], [0.10, np.nan], [0.25, 0.02]])
    curve = accuracy_curve(distances, np.array([0.02, 0.05, 0.20]))
    np.testing.assert_allclose(curve, [0.4, 0.6, 0.8])


def test_thresholds_run_from_2_to_20_cm():
    scores = score_plain(np.zeros((1, 1, 3)), np.zeros((1, 1, 3)))
    np.testing.assert_allclose(scores.thresholds_m, np.arange(0.02, 0.205, 0.01))
    np.testing.assert_array_equal(scores.accuracy, np.ones(19))


def test_a_constant_offset_in_the_camera_frame_is_taken_off():
    rng = np.random.default_rng(1)
    reference = rng.normal(size=(20, 3, 3))
    estimate = reference + rng.normal(size=(3, 3))
    estimate[4, 1] = np.nan
    distances = offset_free_distances(estimate, reference)
    assert np.isnan(distances[4, 1]) and np.isnan(distances).sum() == 1
    np.testing.assert_allclose(distances[np.isfinite(distances)], 0.0, atol=1e-12)


def test_what_varies_about_the_offset_remains():
    estimate = np.zeros((2, 1, 3))
    estimate[:, 0, 1] = [0.10, 0.16]
    np.testing.assert_allclose(offset_free_distances(estimate, np.zeros((2, 1, 3))), 0.03)


def test_an_offset_that_turns_with_the_person_is_taken_off_in_the_torso_frame_alone():
    Rs = np.array([turn(angle) for angle in np.linspace(0, np.pi, 9)])
    reference = np.einsum("nij,kj->nki", Rs, FACING)
    estimate = reference + np.einsum("nij,j->ni", Rs, [0.0, 0.0, 0.05])[:, None]
    Rs_camera_torso = torso_rotations(TORSO, reference)
    in_torso = offset_free_distances(estimate, reference, Rs_camera_torso)
    np.testing.assert_allclose(in_torso, 0.0, atol=1e-12)
    assert offset_free_distances(estimate, reference).mean() > 0.03


def test_the_torso_of_a_person_who_faces_the_camera_looks_towards_it():
    R = torso_rotations(TORSO, FACING[None])[0]
    np.testing.assert_allclose(R.T, [[0, 0, -1], [1, 0, 0], [0, -1, 0]], atol=1e-12)


def test_a_torso_with_a_missing_joint_is_unknown():
    positions = np.stack([FACING, FACING, np.zeros((4, 3))])
    positions[1, 2] = np.nan
    unknown = np.isnan(torso_rotations(TORSO, positions)).all(axis=(1, 2))
    assert unknown.tolist() == [False, True, True]
    assert np.isnan(torso_rotations(TORSO[:3], positions[:, :3])).all()


def test_acceleration_of_a_parabola_is_constant_at_uneven_times():
    t = np.array([0.0, 0.03, 0.10, 0.11, 0.20])
    positions = np.zeros((5, 1, 3))
    positions[:, 0, 2] = 1.0 + 0.5 * t + 0.5 * 9.81 * t**2
    np.testing.assert_allclose(accelerations_m_s2(positions, t), [[[0, 0, 9.81]]] * 3, atol=1e-9)


def test_acceleration_is_missing_beside_a_gap_and_where_time_stands_still():
    t = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.5])
    positions = np.zeros((7, 1, 3))
    positions[1] = np.nan
    missing = np.isnan(accelerations_m_s2(positions, t)).all(axis=(1, 2))
    assert missing.tolist() == [True, True, False, False, True]
    assert accelerations_m_s2(positions[:2], t[:2]).shape == (0, 1, 3)


def test_acceleration_error_and_jitter_are_those_worked_out_by_hand():
    reference = np.zeros((4, 1, 3))
    estimate = np.zeros((4, 1, 3))
    estimate[:, 0, 0] = [0.0, 0.01, 0.0, 0.01]
    scores = score_plain(estimate, reference)
    assert scores.acceleration_error_m_s2 == pytest.approx(2.0)
    assert scores.jitter_m_s2 == pytest.approx(2.0)
    assert scores.reference_jitter_m_s2 == 0.0


def test_exchanged_knees_count_only_when_both_are_exchanged_and_the_reference_tells_them_apart():
    left, right = np.array([0.1, 0.0, 2.0]), np.array([-0.1, 0.0, 2.0])
    reference = np.array([[left, right]] * 4)
    reference[3] *= [0.5, 1, 1]
    estimate = np.array([[left, right], [right, left], [right, right], [right / 2, left / 2]])
    names = ("l_knee", "r_knee")
    assert swapped_limbs(names, estimate, reference)["knee"].tolist() == [False, True, False, False]
    scores = score_plain(estimate, reference, names)
    assert scores.swaps == {"knee": 1} and scores.swap_frames == 1


def test_a_frame_with_two_exchanged_limbs_is_one_swap_frame():
    names = ("l_knee", "r_knee", "l_ankle", "r_ankle", "head")
    reference = np.zeros((1, 5, 3))
    reference[0, :4, 0] = [0.1, -0.1, 0.1, -0.1]
    scores = score_plain(reference * [-1, 1, 1], reference, names)
    assert scores.swaps == {"knee": 1, "ankle": 1} and scores.swap_frames == 1


def test_scores_become_json():
    estimate = np.full((3, 2, 3), 0.01)
    estimate[:, 1] = np.nan
    content = score_plain(estimate, np.zeros((3, 2, 3)), ["head", "l_hand"]).to_dict()
    assert content["joints"]["head"]["mean_m"] == pytest.approx(0.01 * 3**0.5)
    assert len(content["accuracy"]) == len(content["thresholds_m"]) == 19
    assert json.loads(json.dumps(content))["swaps"] == {}


def test_distances_are_euclidean():
    assert joint_distances(np.array([[[3.0, 4.0, 0.0]]]), np.zeros((1, 1, 3))) == 5.0

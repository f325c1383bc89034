# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.bench.cases import Case
from kintrack.bench.scores import Errors, summary
from kintrack.joints import JOINT_NAMES

CASE = Case("alone", "00_drinking", 0.30, None)


def errors(distances, hidden):
    n, joints = 2, len(JOINT_NAMES)
    return Errors(
        CASE,
        np.broadcast_to(distances, (n, joints)).astype(float),
        np.broadcast_to(hidden, (n, joints)),
        np.array([0.3, np.nan]),
        np.array([True, False]),
    )


def test_visible_and_hidden_joints_are_told_apart():
    far = np.arange(len(JOINT_NAMES)) < 7
    found = summary([errors(np.where(far, 0.12, 0.03), far)])
    assert found["visible"]["mean_m"] == pytest.approx(0.03)
    assert found["hidden"]["mean_m"] == pytest.approx(0.12)
    assert found["all"]["mean_m"] == pytest.approx(0.06)
    assert found["joints"]["pelvis"]["mean_m"] == pytest.approx(0.12)


def test_the_curve_counts_joints_within_each_threshold():
    found = summary([errors(np.where(np.arange(len(JOINT_NAMES)) < 7, 0.12, 0.03), False)])
    at = dict(zip(np.round(found["thresholds_m"], 2), found["all"]["accuracy"], strict=True))
    assert at[0.02] == 0.0
    assert at[0.05] == pytest.approx(2 / 3)
    assert at[0.2] == 1.0


def test_a_joint_without_a_pose_is_beyond_every_threshold_but_not_in_the_mean():
    found = summary([errors(np.where(np.arange(len(JOINT_NAMES)) < 7, np.inf, 0.03), False)])
    assert found["all"]["mean_m"] == pytest.approx(0.03)
    assert found["all"]["posed"] == pytest.approx(2 / 3)
    assert found["all"]["accuracy"][-1] == pytest.approx(2 / 3)


def test_a_joint_without_truth_does_not_count():
    found = summary([errors(np.where(np.arange(len(JOINT_NAMES)) < 7, np.nan, 0.03), False)])
    assert found["all"]["joints"] == 2 * 14
    assert found["joints"]["pelvis"]["accuracy"] is None


def test_frames_without_the_person_do_not_count_in_the_hidden_share():
    assert summary([errors(0.0, False)])["hidden_share"] == pytest.approx(0.3)


def test_tracking_is_a_share_of_all_frames():
    assert summary([errors(0.0, False)])["tracking"] == 0.5

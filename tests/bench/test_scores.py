# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.bench.cases import Case
from kintrack.bench.scores import CHI2_95, Errors, summary, surprises
from kintrack.joints import JOINT_NAMES

CASE = Case("alone", "00_drinking", "30 cm", None)
SEVEN = np.arange(len(JOINT_NAMES)) < 7


def errors(distances, hidden, frames=2, **more):
    shape = (frames, len(JOINT_NAMES))
    return Errors(
        CASE,
        np.broadcast_to(distances, shape).astype(float),
        np.broadcast_to(hidden, shape),
        np.array([0.3] + [np.nan] * (frames - 1)),
        more.pop("status", np.array(["tracking"] + ["lost"] * (frames - 1))),
        more.pop("surprise", np.full(shape, np.nan)),
        more.pop("swapped", np.zeros(frames, dtype=bool)),
        **more,
    )


def test_visible_and_hidden_joints_are_told_apart():
    found = summary([errors(np.where(SEVEN, 0.12, 0.03), SEVEN)])
    assert found["visible"]["mean_m"] == pytest.approx(0.03)
    assert found["hidden"]["mean_m"] == pytest.approx(0.12)
    assert found["all"]["mean_m"] == pytest.approx(0.06)
    assert found["joints"]["pelvis"]["mean_m"] == pytest.approx(0.12)


def test_the_curve_counts_joints_within_each_threshold():
    found = summary([errors(np.where(SEVEN, 0.12, 0.03), False)])
    at = dict(zip(np.round(found["thresholds_m"], 2), found["all"]["accuracy"], strict=True))
    assert at[0.02] == 0.0
    assert at[0.05] == pytest.approx(2 / 3)
    assert at[0.2] == 1.0


def test_a_joint_without_a_pose_is_beyond_every_threshold_but_not_in_the_mean():
    found = summary([errors(np.where(SEVEN, np.inf, 0.03), False)])
    assert found["all"]["mean_m"] == pytest.approx(0.03)
    assert found["all"]["posed"] == pytest.approx(2 / 3)
    assert found["all"]["accuracy"][-1] == pytest.approx(2 / 3)


def test_a_joint_without_truth_does_not_count():
    found = summary([errors(np.where(SEVEN, np.nan, 0.03), False)])
    assert found["all"]["joints"] == 2 * 14
    assert found["joints"]["pelvis"]["accuracy"] is None


def test_limbs_leave_the_trunk_and_the_ends_out():
    limbs = np.array([name[2:] in ("elbow", "knee") for name in JOINT_NAMES])
    found = summary([errors(np.where(limbs, 0.06, 0.0), False)])
    assert found["limbs"]["mean_m"] == pytest.approx(0.02)
    assert found["limbs"]["joints"] == 2 * 12


def test_frames_without_the_person_do_not_count_in_the_hidden_share():
    assert summary([errors(0.0, False)])["hidden_share"] == pytest.approx(0.3)


def test_statuses_are_shares_of_all_frames():
    found = summary([errors(0.0, False)])["status"]
    assert found == {"initialising": 0.0, "tracking": 0.5, "lost": 0.5, "skipped": 0.0}


def test_the_surprise_of_a_joint_is_measured_in_its_own_ellipsoid():
    covariance = np.diag([0.01, 0.04, 0.09]) ** 2
    joints, truth = np.zeros((1, 2, 3)), np.array([[[0.02, 0, 0], [0, 0.04, 0.09]]])
    found = surprises(joints, np.broadcast_to(covariance, (1, 2, 3, 3)), truth)
    assert found == pytest.approx(np.array([[4.0, 2.0]]), rel=1e-6)
    unknown = np.full((1, 2, 3, 3), np.nan)
    assert np.isnan(surprises(joints, unknown, truth)).all()


def test_coverage_counts_joints_with_a_covariance_only():
    shape = (2, len(JOINT_NAMES))
    surprise = np.where(SEVEN, CHI2_95 + 1.0, 1.0) * np.ones(shape)
    surprise[1] = np.nan
    found = summary([errors(0.05, SEVEN, surprise=surprise)])
    assert found["visible"]["within_95"] == 1.0 and found["hidden"]["within_95"] == 0.0
    assert found["all"]["within_95"] == pytest.approx(2 / 3)
    assert summary([errors(0.05, SEVEN)])["all"]["within_95"] is None


def tracked(distances):
    """A frame per distance, all with status tracking."""
    column = np.array(distances, dtype=float)[:, None]
    status = np.full(len(distances), "tracking")
    return errors(column, False, frames=len(distances), status=status)


def test_a_person_is_found_where_it_tracks_and_is_right_not_merely_where_it_says_so():
    one = tracked([0.5, 0.3, 0.1, 0.1])
    assert one.locked_after == 3
    assert replace(one, status=np.array(["tracking"] * 2 + ["lost", "tracking"])).locked_after == 4
    assert tracked([0.5, np.inf]).locked_after is None


def test_hidden_joints_do_not_say_whether_a_person_was_found():
    one = tracked([0.1])
    far = replace(one, distances_m=np.where(SEVEN, 5.0, 0.1)[None], hidden=SEVEN[None])
    assert far.locked_after == 1
    assert replace(far, hidden=np.zeros_like(far.hidden)).locked_after is None


def test_recovery_is_counted_from_the_end_of_the_gap():
    one = replace(tracked([0.1, 0.1, 0.9, 0.9, 0.6, 0.1]), gap=range(2, 4))
    assert one.recovered_after == 2
    found = summary([one])
    assert found["held_before"] == [True] and found["recovered_after"] == [2]
    assert found["status_in_gap"]["tracking"] == 1.0
    assert "held_before" not in summary([tracked([0.1])])

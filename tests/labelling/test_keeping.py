# SPDX-License-Identifier: Apache-2.0
"""The drop rule names what is wrong, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from kintrack.errors import ConfigError
from kintrack.joints import JOINT_NAMES
from kintrack.labelling.disputes import disputes, part_iou
from kintrack.labelling.keeping import (
    REASONS,
    KeepingConfig,
    Opinion,
    Reason,
    fastest,
    objections,
    top_reasons,
    turning,
    unconfirmed,
)
from kintrack.labelling.measures import Coverage

SEEN = Coverage(
    person_px=5000,
    explained=0.99,
    unexplained_m2=0.002,
    supported=0.99,
    unsupported_m2=0.001,
    hidden=0.0,
    unread=0.0,
)
GOOD = Opinion("tracking", 0.01, SEEN, 1.0, 1.0, 1)


def kinds(opinion):
    return {reason.kind for reason in objections(opinion, KeepingConfig())}


def test_a_good_frame_is_kept():
    assert objections(GOOD, KeepingConfig()) == ()


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"status": "lost"}, "not tracking"),
        ({"residual_rms_m": 0.03}, "residual"),
        ({"residual_rms_m": float("nan")}, "residual"),
        ({"speed_m_s": 30.0}, "jump"),
        ({"turn_rad_s": 60.0}, "jump"),
        ({"limits": 12}, "limits"),
        ({"outside": 0.5}, "not whole"),
        ({"coverage": replace(SEEN, person_px=10)}, "too few pixels"),
        ({"coverage": replace(SEEN, explained=0.5)}, "unexplained"),
        ({"coverage": replace(SEEN, unexplained_m2=0.05)}, "unexplained"),
        ({"coverage": replace(SEEN, supported=0.5)}, "unsupported"),
        ({"coverage": replace(SEEN, unsupported_m2=0.05)}, "unsupported"),
        ({"coverage": replace(SEEN, hidden=0.5)}, "hidden"),
        ({"coverage": replace(SEEN, unread=0.5)}, "not whole"),
    ],
)
def test_each_fault_alone_is_named(change, kind):
    assert kinds(replace(GOOD, **change)) == {kind}
    assert kind in REASONS


def test_a_reason_gives_the_value_and_what_is_allowed():
    (reason,) = objections(replace(GOOD, residual_rms_m=0.031), KeepingConfig())
    assert "31 mm" in reason.text and "20 mm" in reason.text


def test_two_equal_opinions_do_not_differ_and_borders_alone_are_forgiven():
    labels = bands()
    joints = np.zeros((len(JOINT_NAMES), 3))
    assert disputes(labels, labels, joints, joints, KeepingConfig()) == ()
    shifted = np.roll(labels, 1, axis=1)
    assert disputes(labels, shifted, joints, joints, KeepingConfig()) == ()


def test_exchanged_arms_are_called_a_swap():
    labels = bands()
    other = labels.copy()
    other[labels == 3], other[labels == 4] = 4, 3
    joints = np.zeros((len(JOINT_NAMES), 3))
    l, r = JOINT_NAMES.index("l_wrist"), JOINT_NAMES.index("r_wrist")  # noqa: E741
    joints[l, 0], joints[r, 0] = 0.3, -0.3
    exchanged = joints.copy()
    exchanged[[l, r]] = joints[[r, l]]
    found = {reason.kind for reason in disputes(labels, other, joints, exchanged, KeepingConfig())}
    assert found == {"opinions differ", "swap"}


def test_parts_hardly_in_view_do_not_count():
    labels, other = bands(), bands()
    labels[labels == 6] = 0
    other[1:][other[1:] == 6] = 0
    iou = part_iou(labels, other, 0.02)
    assert np.isnan(iou[6]) and np.isnan(iou[0]) and np.nanmin(iou) == 1.0
    assert part_iou(labels, other, 0.0)[6] == 0


def test_a_jump_marks_the_frames_on_both_sides_of_it():
    positions = np.zeros((5, 2, 3))
    positions[3:, 1, 0] = 1.0
    speed = fastest(positions, np.arange(5) / 10)
    assert np.allclose(speed, [0, 0, 10, 10, 0])


def test_a_missing_pose_is_no_jump():
    positions = np.zeros((3, 2, 3))
    positions[1] = np.nan
    assert (fastest(positions, np.arange(3.0)) == 0).all()


def test_a_trunk_that_flips_round_turns_fast():
    Rs = np.stack([np.eye(3), np.eye(3), np.diag([-1.0, -1.0, 1.0])])
    assert np.allclose(turning(Rs, np.arange(3) / 30), [0, 30 * np.pi, 30 * np.pi])


def test_a_single_opinion_needs_two_that_agree_in_its_run():
    kept = [True, True, False, True, True, True]
    opinions = [1, 1, 2, 1, 2, 1]
    assert unconfirmed(kept, opinions) == [True, True, False, False, False, False]


def test_reasons_are_counted_by_frames_the_commonest_first():
    jump, limits = Reason("jump", "a"), Reason("limits", "b")
    assert top_reasons([(jump, jump), (limits, jump), ()]) == {"jump": 2, "limits": 1}


def test_a_threshold_out_of_range_is_refused():
    with pytest.raises(ConfigError, match="min_explained = 2"):
        KeepingConfig(min_explained=2)


def bands():
    """Six labels side by side, 40 x 120 px each."""
    return np.repeat(np.arange(1, 7, dtype=np.uint8), 40)[None].repeat(120, axis=0)

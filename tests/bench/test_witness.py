# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.bench.segmentation.witness import OWN, JointCounts, witness_summary
from segmentation.labels import LABELS

SIZE = (128, 106)
RIGHT_ARM, LEFT_ARM, TORSO = (LABELS.index(n) for n in ("right_arm", "left_arm", "torso"))


@pytest.fixture
def labels():
    found = np.zeros((106, 128), np.uint8)
    found[:, :30] = RIGHT_ARM
    found[:, 30:60] = TORSO
    found[:, 60:90] = LEFT_ARM
    return found


def counted(labels, joints, read=None):
    counts = JointCounts()
    read = np.ones(labels.shape, bool) if read is None else read
    pairs = {name: np.array(place, float) for name, place in joints.items()}
    return counts.add(labels, read, pairs, SIZE), witness_summary(counts.plain())


def test_a_joint_on_its_own_arm_counts_and_one_on_the_other_arm_is_mirrored(labels):
    (right, seen), found = counted(labels, {"r_elbow": (10, 50), "l_elbow": (11, 50)})
    assert (right, seen) == (1, 2)
    assert found["own"] == 0.5 and found["mirrored"] == 0.5 and found["background"] == 0.0


def test_a_shoulder_may_lie_on_arm_or_torso_but_an_elbow_only_on_the_arm(labels):
    _, found = counted(labels, {"r_shoulder": (40, 50), "r_elbow": (40, 50)})
    assert found["by_joint"]["r_shoulder"]["own"] == 1.0
    assert found["by_joint"]["r_elbow"]["own"] == 0.0 and found["other"] == 0.5


def test_one_pixel_beside_its_part_is_near_and_two_are_not(labels):
    _, found = counted(labels, {"r_elbow": (30, 50), "r_wrist": (31, 50)})
    assert found["own"] == 0.0 and found["near"] == 0.5


def test_joints_without_depth_are_told_apart(labels):
    read = np.ones(labels.shape, bool)
    read[50, 100] = False
    _, found = counted(labels, {"l_wrist": (100, 50), "l_elbow": (70, 50)}, read)
    assert found["without_reading"] == 1
    assert found["own"] == 0.5 and found["own_read"] == 1.0 and found["background"] == 0.5


def test_joints_outside_the_image_are_not_judged(labels):
    (right, seen), found = counted(labels, {"l_wrist": (128.2, 50), "r_wrist": (3, -1)})
    assert (right, seen) == (0, 0)
    assert found["outside"] == 2 and found["joints"] == 0 and found["own"] is None


def test_pixels_of_a_large_image_fall_into_the_right_cell():
    labels = np.zeros((106, 128), np.uint8)
    labels[52, 63] = LEFT_ARM
    counts = JointCounts()
    joints = {"l_wrist": np.array([639 * 63.5 / 128, 529 * 52.5 / 106])}
    assert counts.add(labels, np.ones(labels.shape, bool), joints, (640, 530)) == (1, 1)


def test_every_joint_has_known_parts_of_its_own_side():
    for name, parts in OWN.items():
        assert set(parts) < set(LABELS[1:])
        wrong = {"l_": "right", "r_": "left"}.get(name[:2])
        assert wrong is None or not any(part.startswith(wrong) for part in parts)

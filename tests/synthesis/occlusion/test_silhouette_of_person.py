# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SceneError
from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame
from synthesis.occlusion.silhouette import (
    Silhouette,
    hidden_joints,
    hidden_share,
    person_mask,
    silhouette,
)

CAMERA = PinholeCamera(40, 30, 40.0, 40.0, 20.0, 15.0)


def frame(depth, labels=None):
    return Frame(0, 0.0, CAMERA, depth, labels=labels)


def test_without_background_every_reading_is_the_person():
    depth = np.zeros((30, 40), np.float32)
    depth[5:25, 15:25] = 2.0
    assert np.array_equal(person_mask(frame(depth)), depth > 0)


def test_labels_say_who_the_person_is_before_a_background():
    depth = np.full((30, 40), 3.0, np.float32)
    labels = np.zeros((15, 20), np.uint8)
    labels[5:10, 5:10] = 2
    mask = person_mask(frame(depth, labels))
    assert mask.sum() == 100 and mask[12, 12] and not mask[2, 2]


def test_a_background_without_labels_is_an_error_that_says_what_to_do():
    with pytest.raises(SceneError, match="kintrack label"):
        person_mask(frame(np.full((30, 40), 3.0, np.float32)))


def test_nobody_in_the_image_gives_none():
    assert silhouette(frame(np.zeros((30, 40), np.float32))) is None
    assert silhouette(Frame(0, 0.0, CAMERA, None)) is None


def test_only_what_is_nearer_hides():
    person = Silhouette(np.ones((4, 4), bool), np.full((4, 4), 2.0))
    other = np.zeros((4, 4))
    other[:2], other[2] = 1.0, 3.0
    assert hidden_share(person, other) == 0.5


def test_a_joint_is_hidden_if_something_nearer_covers_its_pixel():
    other = np.zeros((30, 40))
    other[:, 20:] = 1.5
    joints = np.array([[0.3, 0.0, 2.0], [-0.3, 0.0, 2.0], [0.2, 0.0, 1.0], [9.0, 0.0, 2.0]])
    assert hidden_joints(joints, CAMERA, other).tolist() == [True, False, False, False]
    assert not hidden_joints(np.full((1, 3), np.nan), CAMERA, other).any()

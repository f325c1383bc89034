# SPDX-License-Identifier: Apache-2.0
"""Confusion and intersection over union."""

import numpy as np
import pytest
from training_data import CAMERA, figure

from kintrack.errors import DatasetError
from kintrack.geometry import PinholeCamera
from kintrack.sequence.frame import Frame
from segmentation.evaluate import confusion, evaluate, iou_of, labels_shown, scores_of, true_labels
from segmentation.labels import IGNORED
from segmentation.preprocess import (
    DEPTH_SCALE,
    HOLE,
    REFERENCE_DEPTH_M,
    REFERENCE_FOCAL_PX,
    letterbox,
    network_input,
)


def test_scores_are_those_counted_by_hand():
    truth = np.array([0, 0, 0, 1, 1, 2, 2, IGNORED], np.uint8)
    found = np.array([0, 0, 1, 1, 2, 2, 0, 5], np.uint8)
    scores = scores_of(confusion(truth, found))
    assert scores.pixel_accuracy == pytest.approx(4 / 7)
    assert scores.background_iou == pytest.approx(2 / 4)
    assert scores.non_background_iou == pytest.approx(2 / 5)
    assert scores.person_iou == pytest.approx(3 / 5)
    assert scores.part_iou["head"] == pytest.approx(1 / 3)
    assert scores.part_iou["torso"] == pytest.approx(1 / 3)
    assert np.isnan(scores.part_iou["left_leg"])
    assert scores.mean_part_iou == pytest.approx(1 / 3)
    assert scores.summary()["left_leg"] is None


def test_intersection_over_union_is_that_of_sets():
    rng = np.random.default_rng(0)
    truth, found = rng.integers(0, 7, (2, 3, 40, 50), dtype=np.uint8)
    iou = iou_of(confusion(truth, found))
    for label in range(7):
        a, b = truth == label, found == label
        assert iou[label] == pytest.approx((a & b).sum() / (a | b).sum())


def frames(labelled=True):
    for n in range(2):
        depth, color, labels = figure(n)
        depth[60:90, 60:90] = 0.0
        yield Frame(n, 0.1 * n, CAMERA, depth, color, labels if labelled else None)
    yield Frame(2, 0.2, CAMERA, None, problem="broken")


class Oracle:
    runtime = "oracle"

    def segment(self, frame):
        return np.where(true_labels(frame) == IGNORED, 0, true_labels(frame)).astype(np.uint8)


def test_whoever_knows_the_truth_scores_one():
    scores = scores_of(evaluate(Oracle(), [frames()]))
    assert scores.pixel_accuracy == scores.non_background_iou == scores.mean_part_iou == 1.0


def test_a_cell_without_reading_is_background_in_truth():
    frame = next(frames())
    truth = true_labels(frame)
    assert (frame.labels[60:90, 60:90] > 0).any() and (truth[41:59, 41:59] == 0).all()


def test_truth_is_the_label_of_the_reading_that_a_cell_of_the_input_shows(monkeypatch):
    monkeypatch.setattr(
        "segmentation.preprocess.add_relief", lambda plane, farthest, out: np.copyto(out, plane)
    )
    depth, _, labels = figure(0)
    rng = np.random.default_rng(0)
    depth = (depth + 1e-3 * rng.random(depth.shape)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.3] = 0.0
    labels[rng.random(labels.shape) < 0.1] = 0
    plane = network_input(depth, CAMERA.fx)[3]
    truth = true_labels(Frame(0, 0.0, CAMERA, depth, labels=labels))
    fit = letterbox(CAMERA.width, CAMERA.height)
    unit_m = REFERENCE_DEPTH_M * CAMERA.fx * fit.scale / REFERENCE_FOCAL_PX
    read = (plane < HOLE) & (truth != IGNORED)
    order = np.argsort(depth, axis=None)
    shown_m = unit_m * np.exp(DEPTH_SCALE * plane[read].astype(float))
    ranks = np.searchsorted(depth.reshape(-1)[order], shown_m * (1.0 - 1e-7))
    nearby = np.stack([order[np.clip(ranks + k, 0, len(order) - 1)] for k in range(-4, 5)])
    off = np.abs(depth.reshape(-1)[nearby] - shown_m)
    taken = nearby[off.argmin(axis=0), np.arange(len(shown_m))]
    assert read.sum() > 5000 and (truth[~read] % IGNORED == 0).all()
    assert (labels.reshape(-1)[taken] == truth[read]).mean() > 0.99


def test_right_labels_of_every_second_pixel_score_nearly_one():
    depth, _, labels = (np.repeat(np.repeat(plane, 4, 0), 4, 1) for plane in figure(0))
    rng = np.random.default_rng(0)
    depth = (depth + 1e-3 * rng.random(depth.shape)).astype(np.float32)
    camera = PinholeCamera(*(4 * v for v in (CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.fy,
                                             CAMERA.cx, CAMERA.cy)))  # fmt: skip
    truth = true_labels(Frame(0, 0.0, camera, depth, labels=labels))
    thinned = np.ascontiguousarray(labels[::2, ::2])
    scores = scores_of(confusion(truth, labels_shown(depth, thinned)))
    assert scores.non_background_iou > 0.97


def test_recordings_without_labels_cannot_be_evaluated():
    with pytest.raises(DatasetError, match="no frame with depth and labels"):
        evaluate(Oracle(), [frames(labelled=False)])
    with pytest.raises(DatasetError, match="frame 2 cannot be judged: broken"):
        true_labels([*frames()][2])

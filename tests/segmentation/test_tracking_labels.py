# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.geometry import PinholeCamera
from kintrack.segmenter import checked_labels
from kintrack.sequence.frame import Frame
from segmentation.labels import IGNORED
from segmentation.preprocess import letterbox
from segmentation.tracking import ImageSegmenter, TrueSegmenter, inside_bars


class Bars:
    """A network that says head in the bars and torso in the image."""

    runtime = "none"

    def segment(self, frame):
        labels = np.ones((106, 128), dtype=np.uint8)
        fit = letterbox(frame.camera.width, frame.camera.height)
        labels[fit.top : fit.top + fit.rows, fit.left : fit.left + fit.columns] = 2
        return labels


def frame(width, height, labels=None):
    camera = PinholeCamera(width, height, 300.0, 300.0, width / 2, height / 2)
    return Frame(0, 0.0, camera, np.full((height, width), 2.0, np.float32), labels=labels)


@pytest.mark.parametrize("size", [(512, 424), (320, 240), (640, 480), (240, 320)])
def test_the_bars_are_cut_off_and_what_is_left_covers_the_image(size):
    shown = frame(*size)
    labels = checked_labels(ImageSegmenter(Bars()), shown)
    assert (labels == 2).all()
    assert np.array_equal(labels, inside_bars(Bars().segment(shown), shown))


@pytest.mark.parametrize("size", [(512, 424), (320, 240)])
def test_true_labels_come_at_the_networks_size_without_ignored_cells(size):
    truth = np.zeros((size[1], size[0]), dtype=np.uint8)
    truth[: size[1] // 2] = 4
    labels = checked_labels(TrueSegmenter(), frame(*size, labels=truth))
    assert IGNORED not in labels
    assert (labels[: len(labels) // 2] == 4).all() and not labels[len(labels) // 2 + 1 :].any()


def test_a_frame_without_true_labels_shows_nobody():
    assert not checked_labels(TrueSegmenter(), frame(320, 240)).any()

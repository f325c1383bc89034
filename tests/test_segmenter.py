# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SegmenterError
from kintrack.geometry import PinholeCamera
from kintrack.segmenter import checked_labels
from kintrack.sequence.frame import Frame

CAMERA = PinholeCamera(320, 240, 286.0, 286.0, 159.5, 119.5)
FRAME = Frame(7, 0.0, CAMERA, np.ones((240, 320), dtype=np.float32))


class Returns:
    def __init__(self, labels):
        self.labels = labels

    def segment(self, frame, region=None):
        return self.labels


@pytest.mark.parametrize("shape", [(96, 128), (240, 320), (106, 142), (2, 96, 128)])
def test_a_map_of_the_whole_image_passes_in_any_size(shape):
    labels = np.full(shape, 6, dtype=np.uint8)
    assert checked_labels(Returns(labels), FRAME) is labels


@pytest.mark.parametrize(
    ("labels", "said"),
    [
        (np.zeros((106, 128), np.uint8), "128 x 106 labels.*320 x 240"),
        (np.zeros((128, 96), np.uint8), "96 x 128"),
        (np.zeros((3, 4), np.uint8), "at least 16"),
        (np.full((96, 128), np.nan), "float64"),
        (np.zeros((96, 128, 1), np.uint8), r"\(96, 128, 1\)"),
        (np.zeros((1, 96, 128), np.uint8), r"\(1, 96, 128\)"),
        (np.full((96, 128), 7, np.uint8), "label 7: 0 to 6"),
        (None, "NoneType"),
    ],
)
def test_anything_else_is_refused_with_what_it_was(labels, said):
    with pytest.raises(SegmenterError, match=said) as caught:
        checked_labels(Returns(labels), FRAME)
    assert "Returns returned for frame 7" in str(caught.value)

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.labelling import labels_of_pixels
from kintrack.geometry import PinholeCamera
from kintrack.segmenter import Region, checked_labels
from kintrack.sequence.frame import Frame
from segmentation.labels import IGNORED
from segmentation.preprocess import HOLE
from segmentation.runtime import DOUBT, FAINT_DOUBT, guesses_of, labels_of
from segmentation.tracking import ImageSegmenter, TrueSegmenter


class Patches:
    """A network that takes what is nearer than the rest for the torso, and holes for the head."""

    runtime = "none"

    def __init__(self):
        self.seen = []

    def logits_of(self, image):
        self.seen.append(image)
        D, read = image[3], image[3] < HOLE
        middle = 0.5 * (D[read].min() + D[read].max())
        labels = np.where(read, np.where(D < middle, 2, 0), 1)
        return 9.0 * (np.arange(7)[:, None, None] == labels).astype(np.float32)


def frame(width, height, labels=None):
    camera = PinholeCamera(width, height, 300.0, 300.0, width / 2, height / 2)
    return Frame(0, 0.0, camera, np.full((height, width), 2.0, np.float32), labels=labels)


def person(width, height):
    """A frame with somebody 2 m away before a wall at 5 m, left of the middle."""
    shown = frame(width, height)
    depth = np.full((height, width), 5.0, np.float32)
    depth[height // 4 : 3 * height // 4, width // 4 : width // 2] = 2.0
    return replace(shown, depth_m=depth)


@pytest.mark.parametrize("size", [(512, 424), (320, 240), (640, 480), (240, 320)])
@pytest.mark.parametrize("closer", [False, True])
def test_labels_cover_the_image_without_the_pictures_bars(size, closer):
    shown = person(*size)
    labels, second = checked_labels(ImageSegmenter(Patches(), closer), shown)
    assert np.array_equal(second, labels)
    right = labels_of_pixels(labels, shown.depth_m) == np.where(shown.depth_m < 3, 2, 0)
    assert right.mean() > 0.97 and 1 not in labels


def test_the_second_look_is_a_closer_one_and_sharper():
    network, shown = Patches(), replace(person(512, 424))
    labels, _ = checked_labels(ImageSegmenter(network), shown)
    whole, closer = network.seen
    assert closer[3].min() < whole[3].min() - 0.3
    off = labels_of_pixels(labels, shown.depth_m) != np.where(shown.depth_m < 3, 2, 0)
    once = labels_of_pixels(ImageSegmenter(Patches(), False).segment(shown)[0], shown.depth_m)
    assert off.sum() < (once != np.where(shown.depth_m < 3, 2, 0)).sum()


def test_a_known_region_takes_one_look_and_is_blind_to_all_else():
    network, shown = Patches(), person(512, 424)
    shown.depth_m[:, -20:] = 2.0
    labels, _ = checked_labels(ImageSegmenter(network), shown, Region((192.0, 212.0), 2.0))
    assert len(network.seen) == 1
    assert labels[106, 96] == 2 and not labels[:, -10:].any()


def test_somebody_whom_the_image_shows_larger_than_a_window_would_gets_one_look():
    network, shown = Patches(), person(512, 424)
    shown.depth_m[shown.depth_m < 3.0] = 1.0
    first, _ = checked_labels(ImageSegmenter(network), shown)
    known, _ = checked_labels(ImageSegmenter(network), shown, Region((192.0, 212.0), 1.0))
    assert len(network.seen) == 2 and np.array_equal(known, first)


def test_a_region_off_the_image_is_as_good_as_none():
    network = Patches()
    checked_labels(ImageSegmenter(network), person(512, 424), Region((5000.0, 0.0), 2.0))
    assert len(network.seen) == 2


@pytest.mark.parametrize("size", [(512, 424), (320, 240)])
def test_true_labels_come_as_fine_as_a_networks_without_ignored_ones(size):
    truth = np.zeros((size[1], size[0]), dtype=np.uint8)
    truth[: size[1] // 2] = 4
    truth[0] = IGNORED
    labels = checked_labels(TrueSegmenter(), frame(*size, labels=truth))
    assert labels.shape == ((212, 256) if size[0] == 512 else (240, 320))
    assert not labels[0].any()
    assert (labels[1 : len(labels) // 2] == 4).all() and not labels[len(labels) // 2 :].any()


def test_a_frame_without_true_labels_shows_nobody():
    assert not checked_labels(TrueSegmenter(), frame(320, 240)).any()


def test_where_a_network_wavers_it_names_both_labels():
    logits = np.zeros((7, 1, 4), dtype=np.float32)
    logits[:, 0] = -20.0
    logits[[2, 3], 0, 0] = 5.0, 5.0 - 0.9 * DOUBT
    logits[[2, 3], 0, 1] = 5.0, 5.0 - 1.1 * DOUBT
    logits[[0, 4], 0, 2] = 5.0, 5.0 - 0.9 * FAINT_DOUBT
    logits[[0, 4], 0, 3] = 5.0, 5.0 - 1.1 * FAINT_DOUBT
    first, second = guesses_of(logits)
    assert first[0].tolist() == [2, 2, 0, 0] and second[0].tolist() == [3, 2, 4, 0]
    assert np.array_equal(first, labels_of(logits))

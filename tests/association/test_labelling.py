# SPDX-License-Identifier: Apache-2.0
import numpy as np

from kintrack.association.labelling import labels_of_pixels


def test_a_pixel_takes_the_label_of_the_cell_that_holds_its_centre():
    labels = np.arange(6, dtype=np.uint8).reshape(2, 3)
    found = labels_of_pixels(labels, np.ones((4, 9)))
    assert np.array_equal(found, np.repeat(np.repeat(labels, 2, axis=0), 3, axis=1))


def test_a_map_finer_than_the_image_is_sampled():
    labels = np.arange(6, dtype=np.uint8)[None].repeat(16, axis=0).repeat(4, axis=1)
    assert np.array_equal(labels_of_pixels(labels, np.ones((4, 6))), labels[::4, 2::4])


def test_a_pixel_without_reading_is_background():
    depth = np.ones((4, 4))
    depth[1, 2] = 0.0
    found = labels_of_pixels(np.full((4, 4), 3, dtype=np.uint8), depth)
    assert found[1, 2] == 0 and (found == 3).sum() == 15

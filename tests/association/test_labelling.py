# SPDX-License-Identifier: Apache-2.0
import numpy as np

from kintrack.association.labelling import labels_of_pixels, spread_labels
from kintrack.association.observation import observe


def test_a_pixel_takes_the_label_of_the_cell_that_holds_its_centre():
    labels = np.arange(6, dtype=np.uint8).reshape(2, 3)
    found = labels_of_pixels(labels, np.ones((4, 9)))
    assert np.array_equal(found, np.repeat(np.repeat(labels, 2, axis=0), 3, axis=1))


def test_a_map_finer_than_the_image_is_sampled():
    labels = np.arange(6, dtype=np.uint8)[None].repeat(16, axis=0).repeat(4, axis=1)
    assert np.array_equal(labels_of_pixels(labels, np.ones((4, 6))), labels[::4, 2::4])


def test_of_a_map_of_the_whole_image_a_thinned_image_takes_its_own_pixels():
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 7, (424, 513)).astype(np.uint8)
    for step in (2, 3):
        depth = np.ones((424, 513))[::step, ::step]
        assert (labels_of_pixels(labels, depth) == labels[::step, ::step]).all()


def test_a_pixel_without_reading_is_background():
    depth = np.ones((4, 4))
    depth[1, 2] = 0.0
    found = labels_of_pixels(np.full((4, 4), 3, dtype=np.uint8), depth)
    assert found[1, 2] == 0 and (found == 3).sum() == 15


def test_what_is_left_of_a_piece_takes_the_label_of_what_is_nearest_and_holes_take_none():
    depth = np.full((5, 11), 2.0)
    depth[0] = 0.0
    part = np.zeros((5, 11), dtype=np.uint8)
    part[1:, :4], part[1:, 7:] = 3, 6
    found = spread_labels(part, depth)
    assert (found[0] == 0).all()
    assert (found[1:, :5] == 3).all() and (found[1:, 6:] == 6).all()
    assert set(found[1:, 5]) <= {3, 6}


def test_a_thing_before_a_person_and_a_floor_at_her_feet_take_no_label():
    """Both touch her in the image; the one is nearer, of the other too little is labelled."""
    depth = np.full((30, 20), 2.0)
    depth[5:12] = 1.7
    part = np.full((30, 20), 2, dtype=np.uint8)
    part[5:12] = 0
    part[20:, 3:] = 0
    found = spread_labels(part, depth)
    assert (found[5:12] == 0).all()
    assert np.array_equal(found[12:], part[12:])
    assert (found[:5] == 2).all()


def test_where_nothing_is_labelled_nothing_is_spread():
    assert not spread_labels(np.zeros((4, 6), dtype=np.uint8), np.ones((4, 6))).any()


def test_only_in_an_image_of_a_person_alone_is_everything_the_person(scene):
    depth = scene.depth(scene.place())
    labels = np.where(depth > 0, 2, 0).astype(np.uint8)
    labels[np.flatnonzero(labels.any(axis=1))[:40]] = 0
    bare = observe(scene.frame(depth), 320, labels=labels)
    assert bare.labels[bare.points_camera[..., 2] > 0].all()
    walled = observe(scene.frame(np.where(depth > 0, depth, 4.0).astype(np.float32)), 320,
                     labels=labels)  # fmt: skip
    assert 0 < (walled.labels > 0).sum() == (labels > 0).sum() < (bare.labels > 0).sum()

# SPDX-License-Identifier: Apache-2.0
"""Changes to samples."""

from dataclasses import fields, replace

import numpy as np
import pytest
from training_data import CAMERA, PAINT, figure, picture, squares

from segmentation.augment import insertion
from segmentation.augment.bank import BankConfig, load_bank
from segmentation.augment.color import recolored
from segmentation.augment.geometry import Warp, around, draw_around, draw_warp, warped, whole
from segmentation.augment.insertion import insert, person_of, put_behind, without_background
from segmentation.augment.noise import SensorFaults, spoilt
from segmentation.augment.sample import AugmentConfig, Bank, augmented, changed, plain_sample
from segmentation.labels import IGNORED, MIRRORED
from segmentation.picture import Picture, reduced
from segmentation.preprocess import HOLE, network_input

OFF = {f.name: 0.0 for f in fields(AugmentConfig) if f.type in ("float",)}
NO_FAULTS = SensorFaults(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, np.inf, (0, 0))


def config(**values):
    return AugmentConfig(**{**OFF, **values})


def room():
    depth = np.linspace(5.0, 3.0, 159, dtype=np.float32)[:, None].repeat(192, 1)
    color = np.full((159, 192, 3), 7, np.uint8)
    return Picture(depth, color, np.zeros((159, 192), np.uint8), 137.0)


def agrees(view):
    """Share of the person's pixels that have the depth and the colour of their own part."""
    person = person_of(view.labels)
    part = np.rint((view.depth_m - view.depth_m[view.labels == 2].mean()) / 0.01) + 2
    right = part[person] == view.labels[person]
    if view.color is not None:
        off = np.abs(view.color.astype(int) - PAINT[view.labels % len(PAINT)]).max(axis=2)
        right &= off[person] < 60
    return right.mean()


@pytest.mark.parametrize("seed", range(6))
def test_depth_labels_and_colour_stay_together_under_zoom_shift_and_roll(seed):
    rng = np.random.default_rng(seed)
    one = picture(seed)
    rows, columns = np.nonzero(one.labels == 2)
    warp = draw_warp(one, rng, (0.9, 1.8), 10.0, (columns.mean(), rows.mean()))
    view = warped(one, replace(warp, mirrored=False))
    assert (view.labels == 2).sum() > 50
    assert agrees(view) > 0.9


@pytest.fixture
def level(monkeypatch):
    """The depth plane without relief, which a half cell's shift moves along."""
    monkeypatch.setattr(
        "segmentation.preprocess.add_relief", lambda plane, farthest, out: np.copyto(out, plane)
    )


def test_a_picture_as_it_is_gives_the_input_that_the_whole_frame_gives(level):
    for size in ((512, 424), (640, 480), (320, 240)):
        rng = np.random.default_rng(1)
        v, u = np.mgrid[: size[1], : size[0]] / size[0]
        depth = (2.0 + 0.7 * u + 0.4 * v + (np.abs(u - 0.5) < 0.1)).astype(np.float32)
        color = rng.integers(0, 255, (*depth.shape, 3), dtype=np.uint8)
        labels = np.zeros(depth.shape, np.uint8)
        mine = plain_sample(reduced(depth, color, labels, 0.7 * size[0])).image
        true = network_input(depth, 0.7 * size[0], color)
        assert ((mine == HOLE) == (true == HOLE)).all()
        assert np.quantile(np.abs(mine[3] - true[3]), 0.95) < 0.02


def test_mirroring_swaps_left_and_right():
    one = picture(3)
    plain, mirror = (warped(one, Warp(2 / 3, (95.5, 79.0), 0.0, m)) for m in (False, True))
    expected = MIRRORED[plain.labels[:, ::-1]]
    assert (mirror.labels == expected).mean() > 0.99
    assert (mirror.labels == 3).sum() > 50
    torso, arm = (np.nonzero(plain.labels == k)[1].mean() for k in (2, 3))
    torso_m, arm_m = (np.nonzero(mirror.labels == k)[1].mean() for k in (2, 3))
    assert (arm < torso) == (arm_m < torso_m)


def test_zooming_in_looks_like_coming_nearer(level):
    """Metres per pixel at twice the zoom are those at half the distance."""
    depth, color, labels = figure(0)
    far, near = (Picture(k * depth, color, labels, CAMERA.fx) for k in (1.0, 0.5))
    zoomed = warped(far, Warp(2 * 2 / 3, (95.5, 79.0)))
    D = network_input(zoomed.depth_m, zoomed.focal_px)[3]
    D_near = network_input(*(lambda p: (p.depth_m, p.focal_px))(warped(near, whole(near))))[3]
    for label in (2, 5):
        seen, expected = zoomed.labels == label, plain_sample(near).labels == label
        if seen.sum() > 20:
            assert np.median(D[seen]) == pytest.approx(np.median(D_near[expected]), abs=1e-3)
    assert (zoomed.labels == 2).sum() > 20


@pytest.mark.parametrize("column", range(90, 96))
def test_a_cell_that_an_outline_halves_is_whose_reading_it_takes(column):
    depth, labels = np.full((159, 192), 3.0, np.float32), np.zeros((159, 192), np.uint8)
    depth[:, column:], labels[:, column:] = 2.0, 3
    depth[:, column + 40 :], labels[:, column + 40 :] = 1.0, 0
    one = Picture(depth, None, labels, 137.0)
    for warp in (whole(one), around(one, np.flatnonzero(labels))):
        view = warped(one, warp)
        assert ((view.labels == 3) == (view.depth_m == 2.0)).all()


def test_bars_are_ignored_holes_without_colour():
    one = picture(0)
    warp = Warp(2 / 3, (95.5, 79.0), window=(128, 72))
    sample = plain_sample(one)
    assert (sample.labels != IGNORED).all()
    view = warped(one, warp)
    bar = np.ones((106, 128), bool)
    bar[17:89] = False
    assert ((view.labels == IGNORED) == bar).all() and (view.depth_m[bar] == 0).all()
    image = augmented(one, config(zoomed=1.0), Bank(), np.random.default_rng(1))
    ignored = image.labels == IGNORED
    assert (image.image[:3, ignored] == 0).all() and (image.image[3, ignored] == HOLE).all()


@pytest.mark.parametrize("seed", range(8))
def test_an_inserted_thing_hides_only_what_is_farther_and_is_background(seed):
    before = warped(picture(seed), whole(picture(seed)))
    after = insert(before, squares(), 0.5, np.random.default_rng(seed))
    new = after.depth_m != before.depth_m
    assert (after.depth_m[new] < before.depth_m[new]).all()
    assert (after.labels[new] == 0).all() and (after.color[new] == 255).all()
    assert (after.labels[~new] == before.labels[~new]).all()
    assert (after.color[~new] == before.color[~new]).all()
    hidden = (person_of(before.labels) & new).sum() / person_of(before.labels).sum()
    assert hidden <= 0.5


def test_what_she_holds_touches_her_and_is_no_larger_than_what_people_hold(monkeypatch):
    monkeypatch.setattr(insertion, "BEFORE", 0.0)
    monkeypatch.setattr(insertion, "HELD", 1.0)
    before = warped(picture(0), whole(picture(0)))
    person = person_of(before.labels)
    shown, gaps_m = 0, []
    for seed in range(40):
        after = insert(before, squares(), 0.5, np.random.default_rng(seed))
        new = after.depth_m != before.depth_m
        if not (new & person).any():
            continue
        shown += 1
        gaps_m.append((before.depth_m - after.depth_m)[new & person].min())
        rows, columns = np.nonzero(new)
        side_m = max(np.ptp(rows), np.ptp(columns)) * after.depth_m[new].min() / before.focal_px
        assert side_m < 1.6 * insertion.HELD_SIDE_M[1]
    assert shown > 15 and max(gaps_m) < 0.1


def test_most_tries_insert_something_and_some_of_it_hides_the_person():
    before = warped(picture(0), whole(picture(0)))
    person = person_of(before.labels)
    hidden = []
    for seed in range(40):
        after = insert(before, squares(), 0.5, np.random.default_rng(seed))
        hidden.append(((after.labels == 0) & person).sum() / person.sum())
    assert np.mean(np.array(hidden) > 0.05) > 0.4 and max(hidden) > 0.2


def test_a_person_in_another_room_keeps_her_pixels_and_gets_its_walls():
    view = warped(picture(2), whole(picture(2)))
    wall = warped(room(), whole(room()))
    out = put_behind(view, wall, 0.4, np.random.default_rng(0))
    person = person_of(out.labels)
    assert (out.depth_m[person] == view.depth_m[person]).all()
    assert (out.color[person] == view.color[person]).all()
    assert (out.color[~person] == 7).all() and (out.depth_m[~person] > 2.9).all()
    assert person.sum() > 0.6 * person_of(view.labels).sum()


def test_a_bar_stays_a_bar_in_another_room():
    view = warped(picture(2), Warp(2 / 3, (95.5, 79.0), window=(128, 72)))
    out = put_behind(view, warped(room(), whole(room())), 0.4, np.random.default_rng(0))
    bar = view.labels == IGNORED
    assert bar.sum() == 34 * 128 and (out.labels[bar] == IGNORED).all()
    assert (out.depth_m[bar] == 0).all()


def test_who_is_too_near_for_a_closer_look_is_seen_in_the_picture_as_it_is():
    depth, color, labels = figure(0)
    person = np.flatnonzero(labels)
    near, far = (Picture(k * depth, color, labels, CAMERA.fx) for k in (0.2, 1.5))
    rng = np.random.default_rng(0)
    assert around(near, person) == draw_around(near, person, rng, 6.0) == whole(near)
    assert around(far, person).zoom > whole(far).zoom
    assert draw_around(far, person, rng, 6.0) != whole(far)


def test_a_removed_background_leaves_the_person_alone():
    view = without_background(warped(picture(2), whole(picture(2))))
    assert ((view.depth_m > 0) == person_of(view.labels)).all() and view.color is None


@pytest.mark.parametrize("bank", [Bank(), Bank(rooms=(room(),))])
def test_nobody_means_no_person_anywhere(bank):
    for seed in range(5):
        view = changed(picture(seed), config(nobody=1.0), bank, np.random.default_rng(seed))
        assert not person_of(view.labels).any() and (view.depth_m > 0).mean() > 0.3


def test_a_hole_stays_a_hole_and_noise_grows_with_the_square_of_depth():
    depth = np.full((106, 128), 3.0, np.float32)
    depth[:40] = 1.5
    depth[:, :5] = 0.0
    out = spoilt(depth, NO_FAULTS._replace(noise=0.002), np.random.default_rng(0))
    assert ((out == 0) == (depth == 0)).all()
    near, far = (out[:38, 6:] - 1.5).std(), (out[42:, 6:] - 3.0).std()
    assert near == pytest.approx(0.002 * 1.5**2, rel=0.1)
    assert far == pytest.approx(0.002 * 3.0**2, rel=0.1)


@pytest.mark.parametrize(
    ("fault", "share"),
    [({"specks": 0.1}, 0.1), ({"patches": 0.2}, 0.2), ({"border": (5, 3)}, 8 / 128),
     ({"farthest_m": 2.0}, 0.5), ({"edge": 1.0}, 2 / 106)],
)  # fmt: skip
def test_a_fault_loses_as_many_readings_as_it_says(fault, share):
    depth = np.full((106, 128), 3.0, np.float32)
    depth[:53] = 1.5
    out = spoilt(depth, NO_FAULTS._replace(**fault), np.random.default_rng(0))
    assert (out == 0).mean() == pytest.approx(share, abs=0.02)
    assert (out[out > 0] == depth[out > 0]).all()


def test_quantised_depth_takes_few_values():
    depth = np.linspace(2.9, 3.1, 106 * 128, dtype=np.float32).reshape(106, 128)
    out = spoilt(depth, NO_FAULTS._replace(step=0.003), np.random.default_rng(0))
    assert np.abs(out - depth).max() < 0.02 and (np.diff(out.reshape(-1)) == 0).mean() > 0.1


def test_lost_readings_are_background():
    view = changed(picture(1), config(spoilt=1.0), Bank(), np.random.default_rng(3))
    assert (view.labels[view.depth_m == 0] % IGNORED == 0).all()


def test_colours_change_but_not_beyond_recognition():
    color = picture(0).color
    outs = [recolored(color, np.random.default_rng(seed)) for seed in range(10)]
    assert all((out != color).any() for out in outs)
    grey = [np.corrcoef(out.mean(axis=2).ravel(), color.mean(axis=2).ravel())[0, 1] for out in outs]
    assert np.median(grey) > 0.9


def test_dropped_colour_leaves_empty_planes_and_depth_as_it_was():
    with_color, without = (
        augmented(picture(0), config(depth_only=p), Bank(), np.random.default_rng(0))
        for p in (0.0, 1.0)
    )
    assert (without.image[:3] == 0).all() and (with_color.image[:3] != 0).any()
    assert (without.image[3] == with_color.image[3]).all()


def test_the_same_generator_gives_the_same_sample_and_another_does_not():
    bank = Bank(squares(), (room(),))
    first, again, other = (
        augmented(picture(0), AugmentConfig(), bank, np.random.default_rng(s)) for s in (4, 4, 5)
    )
    assert (first.image == again.image).all() and (first.labels == again.labels).all()
    assert (first.image != other.image).any()


def test_every_sample_is_a_network_input_with_known_labels():
    bank = Bank(squares(), (room(),))
    for seed in range(60):
        one = picture(seed, colored=seed % 2 == 0)
        sample = augmented(one, AugmentConfig(), bank, np.random.default_rng(seed))
        assert sample.image.shape == (4, 106, 128) and sample.image.dtype == np.float32
        assert np.isfinite(sample.image).all()
        assert np.isin(sample.labels, [*range(7), IGNORED]).all()


def test_things_and_rooms_are_rendered_once(tmp_path):
    pytest.importorskip("embreex")
    path, calls = tmp_path / "bank.safetensors", []
    bank = load_bank(path, BankConfig(4, 1), lambda *done: calls.append(done))
    assert len(bank.cutouts) == 4 and len(bank.rooms) == 1 and calls[-1] == (5, 5)
    seen = np.isfinite(bank.cutouts.relief_m).mean(axis=(1, 2))
    assert (seen > 0.01).all() and (bank.rooms[0].depth_m > 0).mean() > 0.3
    again = load_bank(path, BankConfig(4, 1), lambda *done: pytest.fail("rendered again"))
    assert (again.cutouts.color == bank.cutouts.color).all()

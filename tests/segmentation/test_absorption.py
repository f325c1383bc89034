# SPDX-License-Identifier: Apache-2.0
"""Dark surfaces that return no depth."""

import numpy as np
import pytest

from segmentation.augment import absorption
from segmentation.augment.absorption import MOST_DARK, absorbed
from segmentation.augment.sample import AugmentConfig, Bank, changed
from segmentation.labels import IGNORED
from segmentation.picture import Picture

TRUNK, LEG, HEAD = 2, 5, 1
SEEDS = range(20)


def sitter(color=True):
    """Somebody on a bench 3 m away that is wider than she, before a wall at 5 m."""
    depth = np.full((106, 128), 5.0, np.float32)
    labels = np.zeros((106, 128), np.uint8)
    depth[50:90, 20:110] = 3.1
    for rows, label in ((slice(20, 32), HEAD), (slice(32, 60), TRUNK), (slice(60, 90), LEG)):
        depth[rows, 56:72], labels[rows, 56:72] = 3.0, label
    paint = np.full((106, 128, 3), 200, np.uint8) if color else None
    return Picture(depth, paint, labels, 90.0)


def lost_of(monkeypatch, chances, picture=None, seed=0):
    """What is lost of a picture when each surface has one of these chances, and the picture."""
    picture = sitter() if picture is None else picture
    for name in ("DARKEST", "TROUSERS", "HAIR", "SEAT"):
        monkeypatch.setattr(absorption, name, chances.get(name, 0.0))
    out = absorbed(picture, np.random.default_rng(seed))
    return (picture.depth_m > 0) & (out.depth_m == 0), out


def test_what_is_darkest_loses_its_depth_and_what_is_bright_keeps_it(monkeypatch):
    depth = np.full((106, 128), 3.0, np.float32)
    color = np.full((106, 128, 3), 230, np.uint8)
    color[:32] = 10
    one = Picture(depth, color, np.zeros((106, 128), np.uint8), 90.0)
    lost = np.stack([lost_of(monkeypatch, {"DARKEST": 1.0}, one, n)[0] for n in SEEDS])
    shares = lost.mean(axis=(1, 2))
    assert 0.5 * MOST_DARK < shares.max() < MOST_DARK + 0.01
    assert not lost[:, 40:].any() and lost[:, :28].any()


@pytest.mark.parametrize(("name", "label"), [("TROUSERS", LEG), ("HAIR", HEAD)])
def test_a_part_is_lost_alone_and_gets_dark(monkeypatch, name, label):
    shares = []
    for seed in SEEDS:
        lost, out = lost_of(monkeypatch, {name: 1.0}, seed=seed)
        own = sitter().labels == label
        assert not lost[~own].any()
        assert (out.color[lost] <= 100).all() and (out.color[~lost] == 200).all()
        shares.append(lost[own].mean())
    assert min(shares) > 0.3 and max(shares) == 1.0


def test_the_seat_around_her_is_lost_and_neither_she_nor_the_wall(monkeypatch):
    lost = np.stack([lost_of(monkeypatch, {"SEAT": 1.0}, seed=seed)[0] for seed in SEEDS])
    one = sitter()
    assert not lost[:, (one.labels > 0) | (one.depth_m == 5.0)].any()
    assert lost.any(axis=(1, 2)).all()


def test_a_picture_without_colour_or_person_or_depth_is_survived():
    rng = np.random.default_rng(0)
    bare = sitter(color=False)
    assert any((absorbed(bare, rng).depth_m != bare.depth_m).any() for _ in SEEDS)
    nobody = bare._replace(labels=np.zeros_like(bare.labels))
    assert all((absorbed(nobody, rng).depth_m == nobody.depth_m).all() for _ in SEEDS)
    nothing = sitter()._replace(depth_m=np.zeros((106, 128), np.float32))
    assert not absorbed(nothing, rng).depth_m.any()


def test_what_is_lost_becomes_background_and_its_source_stays():
    one = sitter()
    off = dict.fromkeys(("region", "zoomed", "cut", "mirrored", "inserted", "nobody", "other_room",
                         "background_removed", "depth_only", "recolored", "spoilt",
                         "focal_spread", "roll_deg"), 0.0)  # fmt: skip
    config = AugmentConfig(**off, absorbed=1.0)
    views = [changed(one, config, Bank(), np.random.default_rng(seed)) for seed in SEEDS]
    assert any((view.depth_m == 0).any() for view in views)
    for view in views:
        assert (view.labels[view.depth_m == 0] % IGNORED == 0).all()
    assert (one.depth_m > 0).all() and (one.color == 200).all()

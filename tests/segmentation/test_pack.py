# SPDX-License-Identifier: Apache-2.0
"""Recordings packed for training, and their division."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest
from training_data import CAMERA, figure, record

from kintrack.errors import DatasetError
from kintrack.sequence.frame import Frame
from segmentation import pack as module
from segmentation import pack_files
from segmentation.dataset import Pictures, everything, split
from segmentation.pack import pack
from segmentation.pack_files import DEPTH_UNIT_M, open_pack, picture
from segmentation.picture import checked, reduced


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    root = tmp_path_factory.mktemp("packed") / "data"
    for n in range(4):
        record(root / f"r{n}", frames=3, seed=n, colored=n != 2)
    pack(root, root / ".pack")
    return root


@pytest.fixture
def root(original, tmp_path):
    return shutil.copytree(original, tmp_path / "data")


def raw(root):
    return {path.name: path.read_bytes() for path in sorted((root / ".pack").iterdir())}


def test_pictures_hold_what_the_recordings_show(original):
    entries, planes = open_pack(original / ".pack")
    assert [entry.name for entry in entries] == ["r0", "r1", "r2", "r3"]
    for n, entry in enumerate(entries):
        for k in range(3):
            depth, color, labels = figure(10 * n + k)
            one = picture(entry, planes, k)
            assert np.abs(one.depth_m - depth).max() <= 0.001
            assert (one.labels == labels).all()
            assert one.color is None if n == 2 else np.abs(one.color - color.astype(int)).mean() < 4
            assert entry.person_shares[k] == pytest.approx((labels > 0).mean(), abs=1e-4)


def test_packing_again_opens_no_recording(root, monkeypatch):
    before = raw(root)
    monkeypatch.setattr(module, "open_sequence", None)
    pack(root, root / ".pack")
    assert raw(root) == before


@pytest.mark.parametrize("cut", ["index", "pictures"])
def test_a_packing_that_was_stopped_goes_on_to_the_same_bytes(root, cut):
    before = raw(root)
    lines = (root / ".pack/sequences.jsonl").read_text().splitlines(keepends=True)
    if cut == "index":
        (root / ".pack/sequences.jsonl").write_text("".join(lines[:2]) + lines[2][:40])
    else:
        with (root / ".pack/depth.raw").open("ab") as file:
            file.truncate(1000)
    pack(root, root / ".pack")
    assert raw(root) == before


def test_a_recording_that_has_changed_is_packed_again(root):
    shutil.rmtree(root / "r1")
    record(root / "r1", frames=2, seed=7)
    entries = pack(root, root / ".pack")
    assert [entry.frames for entry in entries] == [3, 2, 3, 3]
    assert (picture(entries[1], open_pack(root / ".pack")[1], 0).labels == figure(70)[2]).all()


def test_depth_is_a_reading_that_was_there_and_labels_are_the_most_frequent():
    rng = np.random.default_rng(0)
    depth = rng.uniform(1, 3, (424, 512)).astype(np.float32)
    depth[rng.random(depth.shape) < 0.6] = 0.0
    one = reduced(depth, None, np.zeros((106, 128), np.uint8) + np.uint8(2), 365.0)
    assert one.depth_m.shape == (159, 192) and one.focal_px == pytest.approx(365 * 0.375)
    assert np.isin(one.depth_m, depth).all()
    assert ((one.labels == 2) == (one.depth_m > 0)).all()
    assert 0.2 < (one.depth_m == 0).mean() < 0.9


def test_depth_and_label_of_a_cell_are_of_one_surface():
    v, u = np.mgrid[:240, :320]
    disc = np.hypot(u - 160.3, v - 121.7) < 50
    depth, labels = np.where(disc, 2.0, 3.0).astype(np.float32), np.where(disc, 3, 0)
    depth[np.random.default_rng(0).random(depth.shape) < 0.2] = 0.0
    one = reduced(depth, None, labels.astype(np.uint8), 280.0)
    assert ((one.labels == 3) == (one.depth_m == 2.0)).all() and (one.labels == 3).sum() > 2000


def test_a_label_that_is_none_is_named_with_its_file(root):
    path = sorted((root / "r3/labels").glob("*.png"))[1]
    cv2.imwrite(str(path), np.full((159, 192), 9, np.uint8))
    with pytest.raises(DatasetError, match=rf"{path.name} holds the value 9; allowed: 0 to 6"):
        pack(root, root / ".pack")


def test_a_frame_whose_depth_is_broken_is_left_out_and_counted(root):
    path = sorted((root / "r3/depth").glob("*.png"))[1]
    path.write_bytes(path.read_bytes()[:100])
    shutil.rmtree(root / ".pack")
    entry = pack(root, root / ".pack")[3]
    assert (entry.frames, entry.skipped) == (2, 1)


@pytest.mark.parametrize(("value", "word"), [(np.nan, "nan"), (-1.0, "-1.0"), (np.inf, "inf")])
def test_depth_that_is_no_number_is_named(value, word):
    depth, _, labels = figure(0)
    depth[5, 5] = value
    with pytest.raises(DatasetError, match=rf"somewhere, frame 3: depth = {word} m"):
        checked(Frame(3, 0.0, CAMERA, depth, labels=labels), "somewhere")


def test_a_folder_without_labels_says_how_to_make_them(tmp_path):
    record(tmp_path / "a", labelled=False)
    with pytest.raises(DatasetError, match="none of 1 recordings.*kintrack label"):
        pack(tmp_path, tmp_path / ".pack")


def test_a_folder_without_recordings_is_named(tmp_path):
    with pytest.raises(DatasetError, match="holds no recording"):
        pack(tmp_path, tmp_path / ".pack")
    with pytest.raises(DatasetError, match="nothing is no folder"):
        pack(tmp_path / "nothing", tmp_path / ".pack")


def test_a_pack_of_another_version_is_named(root):
    path = root / ".pack/pack.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"version": 0}))
    with pytest.raises(DatasetError, match="no whole pack.*'version': 0"):
        open_pack(root / ".pack")


def recordings(pictures: Pictures):
    return set(pictures.where[:, 1].tolist())


def test_no_recording_both_trains_and_validates(original):
    both = split([original / ".pack"], 0.3)
    assert not recordings(both.train) & recordings(both.validation)
    assert len(both.train) + len(both.validation) == len(everything([original / ".pack"])) == 12
    assert len(both.validation) >= 3


def rewritten(root, facts):
    entries, _ = open_pack(root / ".pack")
    lines = [pack_files._line(replace(e, facts=f)) for e, f in zip(entries, facts, strict=True)]
    (root / ".pack/sequences.jsonl").write_text("".join(lines))
    return [root / ".pack"]


def test_no_person_both_trains_and_validates(root):
    packs = rewritten(root, [{"person": p} for p in (5, 8, 5, 8)])
    assert recordings(split(packs, 0.01).train) in ({0, 2}, {1, 3})


def test_a_part_that_validates_does_so_as_a_whole(root):
    parts = ("train", 1), ("test", 1), ("train", 1), ("test", 2)
    packs = rewritten(root, [{"part": part, "person": person} for part, person in parts])
    both = split(packs, 0.01, "test")
    assert recordings(both.validation) == {1, 3} and recordings(both.train) == {0, 2}


def test_one_recording_alone_cannot_be_divided(tmp_path):
    record(tmp_path / "a")
    pack(tmp_path, tmp_path / ".pack")
    with pytest.raises(DatasetError, match="there is 1"):
        split([tmp_path / ".pack"], 0.1)


def test_packed_depth_reaches_beyond_every_sensor():
    assert 65535 * DEPTH_UNIT_M > 16

# SPDX-License-Identifier: Apache-2.0
import errno
import json
import shutil
from collections import namedtuple
from dataclasses import replace

import numpy as np
import pytest

from kintrack.errors import DatasetError
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.occlusion import read_occlusion
from kintrack.sequence.reference import read_reference_joints
from kintrack.sequence.write import SequenceWriter
from synthesis.dataset import build as building
from synthesis.dataset.build import MANIFEST, build_dataset, pending, sequences
from synthesis.dataset.pictures import write_sheet
from synthesis.dataset.record import TAKE_FILE, partial_of, record
from synthesis.takes import Take

TAKE = Take(
    name="0",
    part="train",
    seed=(1, 2),
    person=3,
    action="waving",
    sensor="kinect_v1_320",
    frames=2,
    barrier=True,
)
TAKES = (TAKE, replace(TAKE, name="1", seed=(1, 3), person=4, room=False, barrier=False))
FACTS = {"recipe": "test", "seed": 1}


def content(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dataset") / "set"
    build_dataset(folder, TAKES, FACTS, workers=2)
    return folder


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    root = tmp_path_factory.mktemp("recorded")
    for take in TAKES:
        record(take, root)
    return root


def test_a_take_is_a_sequence_with_its_truth(recorded):
    sequence = open_sequence(recorded / "train" / "0")
    frames = list(sequence)
    assert len(frames) == 2 and all(f.problem is None for f in frames)
    assert frames[0].color is not None and set(np.unique(frames[0].labels)) > {0, 2}
    names, joints = read_reference_joints(sequence.root / "reference_joints.csv")
    assert names == JOINT_NAMES and joints.shape == (2, 21, 3) and np.isfinite(joints).all()
    shares, hidden = read_occlusion(sequence.root / "occlusion.csv")
    assert len(shares) == 2 and 0.05 < shares[0] < 0.9 and hidden.any()


def test_a_person_alone_is_hidden_by_nothing(recorded):
    shares, hidden = read_occlusion(recorded / "train" / "1" / "occlusion.csv")
    assert np.all(shares < 0.01) and not hidden.any()
    depth = open_sequence(recorded / "train" / "1").frame(0).depth_m
    assert 0.005 < (depth > 0).mean() < 0.3


def test_processes_write_the_same_bytes_as_this_one(built, recorded):
    made = content(built)
    assert {k: v for k, v in made.items() if k != MANIFEST} == content(recorded)


def test_a_second_build_makes_nothing_again(built, monkeypatch):
    monkeypatch.setattr(building, "record", None)
    before = content(built)
    build_dataset(built, TAKES, FACTS)
    assert content(built) == before


def test_a_build_goes_on_where_it_was_killed(built, tmp_path):
    folder = tmp_path / "set"
    shutil.copytree(built, folder)
    shutil.rmtree(folder / "train" / "1")
    left_over = partial_of(folder, TAKES[1])
    left_over.mkdir()
    (left_over / "depth.txt").write_text("# half\n")
    assert pending(folder, TAKES) == [TAKES[1]]
    build_dataset(folder, TAKES, FACTS, workers=1)
    assert content(folder) == content(built)


def test_a_full_disk_is_named_and_leaves_earlier_takes_alone(recorded, tmp_path, monkeypatch):
    shutil.copytree(recorded / "train" / "0", tmp_path / "train" / "0")
    before = content(tmp_path)

    def full(self, name, image):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(SequenceWriter, "_image", full)
    with pytest.raises(DatasetError, match="No space left.*intact"):
        record(TAKES[1], tmp_path)
    assert content(tmp_path) == before


def test_too_small_a_disk_is_refused_before_any_work(tmp_path, monkeypatch):
    usage = namedtuple("usage", "total used free")
    monkeypatch.setattr(building.shutil, "disk_usage", lambda path: usage(10**9, 10**9, 1000))
    with pytest.raises(DatasetError, match=r"GB are needed, 0\.0 GB are free"):
        build_dataset(tmp_path / "set", TAKES, FACTS)
    assert not (tmp_path / "set" / MANIFEST).exists()


def test_another_dataset_in_the_folder_is_refused(built, tmp_path):
    with pytest.raises(DatasetError, match="another dataset"):
        build_dataset(built, TAKES, {"recipe": "test", "seed": 2})
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(DatasetError, match="not empty"):
        build_dataset(tmp_path, TAKES, FACTS)


def test_another_take_of_the_same_name_is_refused(built):
    with pytest.raises(DatasetError, match="another take"):
        pending(built, [replace(TAKE, person=5)])


def test_the_manifest_lists_every_take(built):
    manifest = json.loads((built / MANIFEST).read_text())
    assert manifest["recipe"] == "test" and len(manifest["takes"]) == 2
    assert [path.name for path in sequences(built)] == ["0", "1"]
    assert json.loads((built / "train" / "0" / TAKE_FILE).read_text())["take"]["person"] == 3


def test_a_folder_without_manifest_is_no_dataset(tmp_path):
    with pytest.raises(DatasetError, match=MANIFEST):
        sequences(tmp_path)


def test_frames_can_be_looked_at(built, tmp_path):
    write_sheet(built, tmp_path / "sheet.png", count=3)
    assert (tmp_path / "sheet.png").stat().st_size > 10_000

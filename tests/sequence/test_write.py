# SPDX-License-Identifier: Apache-2.0
import os
import re

import numpy as np
import pytest

from kintrack.errors import ResultError, SequenceError
from kintrack.sequence import open_sequence
from kintrack.sequence.reference import read_reference_joints
from kintrack.sequence.write import SequenceWriter

from .small_recordings import CAMERA

DEPTH_M = np.linspace(1.0, 4.0, 48).reshape(6, 8)


def test_what_is_written_is_read_back(tmp_path):
    root = tmp_path / "made" / "here"
    writer = SequenceWriter(root, CAMERA, joint_names=("pelvis", "head"))
    color = np.full((6, 8, 3), (200, 100, 50), np.uint8)
    labels = np.full((3, 4), 2, np.uint8)
    joints_m = np.array([[0.1, 0.2, 3.0], [np.nan, 0.0, 0.0]])
    writer.write(0.0, DEPTH_M)
    writer.write(0.1, DEPTH_M + 1, color=color, labels=labels, joint_positions_m=joints_m)
    plain, full = open_sequence(root)
    assert len(writer) == 2
    assert plain.color is None and plain.labels is None
    np.testing.assert_allclose(full.depth_m, DEPTH_M + 1, atol=0.00051)
    np.testing.assert_allclose(full.color.astype(int), color, atol=4)
    np.testing.assert_array_equal(full.labels, labels)
    names, positions_m = read_reference_joints(root / "reference_joints.csv")
    assert names == ("pelvis",)
    np.testing.assert_allclose(positions_m[1], [[0.1, 0.2, 3.0]])


def test_every_finished_frame_can_be_read_while_the_writer_lives(tmp_path):
    writer = SequenceWriter(tmp_path, CAMERA)
    for n in range(3):
        writer.write(n / 30, DEPTH_M)
        assert [frame.problem for frame in open_sequence(tmp_path)] == [None] * (n + 1)


def test_a_frame_whose_writing_broke_off_is_not_listed(tmp_path, monkeypatch):
    writer = SequenceWriter(tmp_path, CAMERA)
    writer.write(0.0, DEPTH_M)

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", full_disk)
    with pytest.raises(ResultError, match=re.escape(str(tmp_path)) + ".*No space left"):
        writer.write(0.1, DEPTH_M)
    assert len(open_sequence(tmp_path)) == 1


def test_nan_depth_is_written_as_no_reading(tmp_path):
    depth_m = DEPTH_M.copy()
    depth_m[2, 3] = np.nan
    SequenceWriter(tmp_path, CAMERA).write(0.0, depth_m)
    assert open_sequence(tmp_path).frame(0).depth_m[2, 3] == 0


def test_time_stamps_must_increase(tmp_path):
    writer = SequenceWriter(tmp_path, CAMERA)
    writer.write(0.5, DEPTH_M)
    for stamp in (0.5, 0.4, 0.5 + 1e-8):
        with pytest.raises(ResultError, match=f"time stamp {stamp!r} s does not come after 0.5 s"):
            writer.write(stamp, DEPTH_M)


@pytest.mark.parametrize(
    ("name", "array"),
    [("color", np.zeros((6, 8), np.uint8)), ("joint_positions_m", np.zeros((3, 3)))],
)
def test_arrays_of_a_wrong_shape_are_refused(tmp_path, name, array):
    writer = SequenceWriter(tmp_path, CAMERA)
    with pytest.raises(ResultError, match=f"{name} of frame 0 has shape .*; allowed: "):
        writer.write(0.0, DEPTH_M, **{name: array})
    with pytest.raises(ResultError, match=r"depth_m of frame 0 has shape \(8, 6\)"):
        writer.write(0.0, DEPTH_M.T)


def test_a_folder_with_files_is_refused_unless_it_may_be_overwritten(tmp_path):
    writer = SequenceWriter(tmp_path, CAMERA)
    writer.write(0.0, DEPTH_M, labels=np.ones((6, 8), np.uint8))
    writer.write(0.1, DEPTH_M)
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ResultError, match=re.escape(f"{tmp_path} is not empty")):
        SequenceWriter(tmp_path, CAMERA)
    SequenceWriter(tmp_path, CAMERA, overwrite=True).write(7.0, DEPTH_M)
    (frame,) = open_sequence(tmp_path)
    assert frame.timestamp_s == 7.0 and frame.labels is None
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_path_below_a_file_cannot_be_written(tmp_path):
    (tmp_path / "file").touch()
    root = tmp_path / "file" / "sequence"
    with pytest.raises(ResultError, match=re.escape(f"cannot write the sequence folder {root}")):
        SequenceWriter(root, CAMERA)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_cannot_be_written(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(ResultError, match="cannot write the sequence folder .*Permission denied"):
        SequenceWriter(tmp_path / "sequence", CAMERA)


def test_unknown_joints_and_a_bad_depth_scale_are_refused(tmp_path):
    with pytest.raises(ResultError, match="unknown joint 'tail'; allowed: pelvis, spine"):
        SequenceWriter(tmp_path, CAMERA, joint_names=("tail",))
    with pytest.raises(SequenceError, match="depth_scale_m = 0; allowed"):
        SequenceWriter(tmp_path, CAMERA, 0)

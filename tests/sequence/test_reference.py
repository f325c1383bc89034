# SPDX-License-Identifier: Apache-2.0
import re

import numpy as np
import pytest

from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.reference import (
    read_reference_joints,
    read_reference_pixels,
    write_reference_joints,
)

HEADER = "frame,joint,x_m,y_m,z_m\n"


@pytest.fixture
def path(tmp_path):
    return tmp_path / "reference_joints.csv"


def test_written_joints_are_read_back_with_nan_where_missing(path):
    positions_m = np.random.default_rng(0).normal(size=(4, len(JOINT_NAMES), 3))
    positions_m[2, 5] = np.nan
    write_reference_joints(path, JOINT_NAMES, positions_m)
    names, read_m = read_reference_joints(path)
    assert names == JOINT_NAMES
    np.testing.assert_allclose(read_m, positions_m, atol=1e-6)


def test_joints_come_in_the_reporting_order_whatever_the_files(path):
    path.write_text(HEADER + "2,r_foot,1,2,3\n2,pelvis,4,5,6\n0,pelvis,7,8,9\n")
    names, positions_m = read_reference_joints(path)
    assert names == ("pelvis", "r_foot")
    assert positions_m.shape == (3, 2, 3)
    assert positions_m[2].tolist() == [[4, 5, 6], [1, 2, 3]]
    assert positions_m[0, 0].tolist() == [7, 8, 9]
    assert np.isnan(positions_m[1]).all() and np.isnan(positions_m[0, 1]).all()


def test_a_file_without_rows_gives_no_frames(path):
    path.write_text(HEADER)
    names, positions_m = read_reference_joints(path)
    assert names == () and positions_m.shape == (0, 0, 3)


def test_missing_columns_are_named(path):
    path.write_text("frame,joint,x_m,z_m\n0,head,1,2\n")
    with pytest.raises(ResultError, match="column y_m is missing; needed: frame, joint, x_m, y_m"):
        read_reference_joints(path)


def test_an_unknown_joint_is_refused_with_file_line_and_the_known_ones(path):
    path.write_text(HEADER + "0,head,1,2,3\n0,nose,1,2,3\n")
    message = re.escape(f"{path}, line 3: unknown joint 'nose'; allowed: pelvis, spine")
    with pytest.raises(ResultError, match=message):
        read_reference_joints(path)
    with pytest.raises(ResultError, match="unknown joint 'nose'"):
        write_reference_joints(path, ["nose"], np.zeros((1, 1, 3)))


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("0,head,1,two,3", "y_m = 'two'; allowed: a number"),
        ("0,head,1,2", "z_m = None; allowed: a number"),
        ("0,head,,2,3", "x_m = ''; allowed: a number"),
        ("-1,head,1,2,3", "frame = '-1'; allowed: a whole number"),
        ("first,head,1,2,3", "frame = 'first'; allowed: a whole number"),
    ],
)
def test_values_that_are_no_numbers_are_refused_with_file_and_line(path, row, message):
    path.write_text(HEADER + row + "\n")
    with pytest.raises(ResultError, match=re.escape(f"{path}, line 2: {message}")):
        read_reference_joints(path)


def test_a_joint_that_appears_twice_in_a_frame_is_refused(path):
    path.write_text(HEADER + "4,head,1,2,3\n4,head,1,2,3\n")
    with pytest.raises(ResultError, match="line 3: joint head of frame 4 appears twice"):
        read_reference_joints(path)


def test_a_missing_file_and_a_folder_that_cannot_be_written_are_named(path):
    with pytest.raises(ResultError, match=re.escape(f"cannot read {path}")):
        read_reference_joints(path)
    below = path.parent / "nowhere" / "joints.csv"
    with pytest.raises(ResultError, match=re.escape(f"cannot write {below}: No such file")):
        write_reference_joints(below, ["head"], np.zeros((1, 1, 3)))


def test_image_joints_may_have_any_name_and_are_unseen_where_missing(path):
    path.write_text("frame,joint,u_px,v_px,visibility\n1,nose,3.5,4.5,0.9\n2,l_hip,1,2,0.25\n")
    names, pixels, visibility = read_reference_pixels(path)
    assert names == ("nose", "l_hip")
    assert pixels[1, 0].tolist() == [3.5, 4.5]
    assert np.isnan(pixels[0]).all() and np.isnan(pixels[2, 0]).all()
    assert visibility.tolist() == [[0, 0], [0.9, 0], [0, 0.25]]


def test_image_joints_without_visibility_are_refused(path):
    path.write_text("frame,joint,u_px,v_px\n1,nose,3.5,4.5\n")
    with pytest.raises(ResultError, match="column visibility is missing"):
        read_reference_pixels(path)

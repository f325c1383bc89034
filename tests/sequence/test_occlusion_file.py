# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.occlusion import OCCLUSION_HEADER, occlusion_row, read_occlusion


def written(tmp_path, *rows):
    path = tmp_path / "occlusion.csv"
    path.write_text(OCCLUSION_HEADER + "".join(rows))
    return path


def test_what_is_written_reads_back(tmp_path):
    path = written(
        tmp_path, occlusion_row(0, 0.25, ["l_knee", "r_foot"]), occlusion_row(2, float("nan"), [])
    )
    shares, hidden = read_occlusion(path)
    assert np.array_equal(shares, [0.25, np.nan, np.nan], equal_nan=True)
    assert [JOINT_NAMES[j] for j in np.flatnonzero(hidden[0])] == ["l_knee", "r_foot"]
    assert not hidden[1:].any()


@pytest.mark.parametrize("row", ["0,x,\n", "0\n", "-1,0.1,\n", "0,1.5,\n", "0,0.1,elbow\n"])
def test_a_malformed_line_is_named(tmp_path, row):
    with pytest.raises(ResultError, match="line 2"):
        read_occlusion(written(tmp_path, row))


def test_another_table_is_refused(tmp_path):
    path = tmp_path / "occlusion.csv"
    path.write_text("frame,share\n")
    with pytest.raises(ResultError, match="first line"):
        read_occlusion(path)

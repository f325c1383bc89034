# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SequenceError
from kintrack.sequence import open_sequence
from kintrack.sequence.index import associate

from .small_recordings import CAMERA, OURS, save_json, save_recording

NO_SCALE = {key: value for key, value in OURS.items() if key != "depth_scale_m"}


@pytest.fixture
def root(tmp_path):
    return save_recording(tmp_path / "desk", [5.0, 5.033, 5.066], rgb_times_s=[5.010, 5.052, 5.090])


def test_depth_is_in_5000ths_of_a_metre_unless_the_camera_file_tells_otherwise(root, tmp_path):
    plain = open_sequence(root, camera=save_json(tmp_path / "plain.json", NO_SCALE))
    assert plain.camera == CAMERA
    assert plain.frame(0).depth_m[1, 1] == pytest.approx(0.4)
    told = open_sequence(root, camera=save_json(tmp_path / "told.json", OURS))
    assert told.frame(0).depth_m[1, 1] == pytest.approx(2.0)
    given = open_sequence(root, camera=tmp_path / "told.json", depth_scale_m=0.0001)
    assert given.frame(0).depth_m[1, 1] == pytest.approx(0.2)


def test_colour_within_20_ms_belongs_to_depth(root, tmp_path):
    reader = open_sequence(root, camera=save_json(tmp_path / "c.json", NO_SCALE))
    colors = [frame.color for frame in reader]
    assert [None if c is None else c[0, 0, 0] for c in colors] == [40, None, 41]


def test_colour_index_may_repeat_a_time_stamp(root, tmp_path):
    (root / "rgb.txt").write_text("5.0 rgb/000000.png\n5.0 rgb/000001.png\n")
    reader = open_sequence(root, camera=save_json(tmp_path / "c.json", NO_SCALE))
    assert reader.frame(0).color[0, 0, 0] == 40


def test_without_a_camera_the_message_says_how_to_give_one(root):
    with pytest.raises(SequenceError, match="--camera camera.json") as caught:
        open_sequence(root)
    message = str(caught.value)
    assert str(root) in message and '"fx": 525.0' in message
    assert "freiburg1: fx 517.3, fy 516.5, cx 318.6, cy 255.3" in message


def test_depth_out_of_order_is_refused(root, tmp_path):
    (root / "depth.txt").write_text("5.1 depth/000000.png\n5.0 depth/000001.png\n")
    with pytest.raises(SequenceError, match=r"line 2: time stamp 5\.0 s does not come after 5\.1"):
        open_sequence(root, camera=save_json(tmp_path / "c.json", NO_SCALE))


def test_a_missing_depth_image_is_a_bad_frame(root, tmp_path):
    (root / "depth/000000.png").unlink()
    reader = open_sequence(root, camera=save_json(tmp_path / "c.json", NO_SCALE))
    assert [frame.problem is None for frame in reader] == [False, True, True]


def test_association_is_one_to_one_and_closest_first():
    times_s = np.array([0.0, 0.01, 0.02])
    assert associate(times_s, np.array([0.012]), 0.02) == [None, 0, None]
    assert associate(times_s, np.array([0.019, 0.012]), 0.02) == [None, 1, 0]
    assert associate(times_s, np.array([]), 0.02) == [None, None, None]


def test_association_agrees_with_comparing_every_pair():
    rng = np.random.default_rng(3)
    times_s, others_s = np.sort(rng.uniform(0, 2, 60)), rng.uniform(0, 2, 50)
    gaps_s = np.abs(times_s[:, None] - others_s[None, :])
    expected = [None] * 60
    while gaps_s.min() < 0.02:
        i, j = np.unravel_index(np.argmin(gaps_s), gaps_s.shape)
        expected[i] = j
        gaps_s[i, :] = gaps_s[:, j] = np.inf
    assert associate(times_s, others_s, 0.02) == expected

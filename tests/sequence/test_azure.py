# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import SequenceError
from kintrack.sequence import open_sequence

from .small_recordings import CAMERA, OPEN3D, OURS, depth_units, save_image, save_json


@pytest.fixture
def root(tmp_path):
    root = tmp_path / "kinect"
    for n in (1, 2, 10):
        save_image(root / f"depth/{n}.png", depth_units(1000 + n))
        save_image(root / f"color/{n}.jpg", np.full((6, 8, 3), 40 + n, np.uint8))
    save_json(root / "intrinsic.json", OPEN3D | {"depth_scale": 1000.0})
    return root


def greys(reader):
    return [None if f.color is None else int(f.color[0, 0, 0]) for f in reader]


def test_frames_come_in_the_order_of_their_names_with_times_from_the_rate(root):
    reader = open_sequence(root, fps=10)
    frames = list(reader)
    assert reader.camera == CAMERA
    assert [frame.timestamp_s for frame in frames] == [0.0, 0.1, 0.2]
    np.testing.assert_allclose([f.depth_m[1, 1] for f in frames], [1.001, 1.002, 1.010])
    assert greys(reader) == [41, 42, 50]


def test_the_default_rate_is_30_frames_a_second(root):
    assert open_sequence(root).frame(1).timestamp_s == pytest.approx(1 / 30)


def test_a_rate_of_zero_is_refused(root):
    with pytest.raises(SequenceError, match="fps = 0; allowed: a finite number above 0"):
        open_sequence(root, fps=0)


def test_without_a_depth_scale_the_caller_must_give_one(root):
    save_json(root / "intrinsic.json", OPEN3D)
    with pytest.raises(SequenceError, match=r"intrinsic\.json does not tell .*--depth-scale-m"):
        open_sequence(root)
    assert open_sequence(root, depth_scale_m=0.002).frame(0).depth_m[1, 1] == pytest.approx(2.002)


def test_a_camera_file_of_ours_may_replace_the_intrinsics(root, tmp_path):
    path = save_json(tmp_path / "camera.json", OURS | {"fx": 20.0})
    assert open_sequence(root, camera=path).camera.fx == 20.0


def test_colour_is_optional(root):
    for path in (root / "color").iterdir():
        path.unlink()
    (root / "color").rmdir()
    assert greys(open_sequence(root)) == [None, None, None]


def test_a_depth_image_whose_colour_is_missing_goes_without(root):
    (root / "color/2.jpg").unlink()
    assert greys(open_sequence(root)) == [41, None, 50]


def test_colour_with_other_names_is_paired_by_position_if_there_are_as_many(root):
    for path in list((root / "color").iterdir()):
        path.rename(path.with_name(f"c{path.name}"))
    assert greys(open_sequence(root)) == [41, 42, 50]
    (root / "color/c2.jpg").unlink()
    with pytest.raises(SequenceError, match="2 images in color/ cannot be paired with 3 in depth/"):
        open_sequence(root)


def test_a_folder_without_depth_images_is_refused(root):
    for path in (root / "depth").iterdir():
        path.unlink()
    with pytest.raises(SequenceError, match="depth holds no PNG"):
        open_sequence(root)


def test_a_bad_frame_is_data(root):
    save_image(root / "depth/2.png", np.zeros((6, 8), np.uint16))
    problems = [frame.problem for frame in open_sequence(root)]
    assert problems[0] is None and problems[2] is None
    assert "no depth reading" in problems[1]

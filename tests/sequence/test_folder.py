# SPDX-License-Identifier: Apache-2.0
import re
from pathlib import Path

import numpy as np
import pytest

from kintrack.errors import SequenceError
from kintrack.sequence import open_sequence
from kintrack.sequence.folder import open_folder
from kintrack.sequence.reference import read_reference_joints, read_reference_pixels

from .small_recordings import CAMERA, OURS, depth_units, save_image, save_json, save_recording

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
REAL = ["bonn_tablet", "bonn_three", "sofa", "utd_mhad", "uva_turn"]


@pytest.fixture
def root(tmp_path):
    save_recording(tmp_path / "walk", [0.0, 0.1, 0.2])
    save_json(tmp_path / "walk" / "camera.json", OURS)
    return tmp_path / "walk"


def test_a_depth_only_folder_opens_and_gives_its_frames(root):
    reader = open_sequence(root)
    frames = list(reader)
    assert (reader.name, reader.root, reader.camera, len(reader)) == ("walk", root, CAMERA, 3)
    assert [frame.index for frame in frames] == [0, 1, 2]
    assert [frame.timestamp_s for frame in frames] == [0.0, 0.1, 0.2]
    assert all(f.problem is None and f.color is None and f.labels is None for f in frames)
    np.testing.assert_allclose([f.depth_m[1, 1] for f in frames], [2.0, 2.001, 2.002])


def test_a_recording_can_be_read_twice_and_in_any_order(root):
    reader = open_sequence(root)
    assert len(list(reader)) == len(list(reader)) == 3
    assert reader.frame(2).depth_m[1, 1] == pytest.approx(2.002)


@pytest.mark.parametrize("index", [-1, 3])
def test_a_frame_that_does_not_exist_is_refused(root, index):
    with pytest.raises(SequenceError, match=f"frame {index} of .*allowed are 0 to 2"):
        open_sequence(root).frame(index)


def test_colour_goes_to_the_nearest_depth_within_half_a_period(tmp_path):
    root = save_recording(tmp_path / "r", [0.0, 0.1, 0.2], rgb_times_s=[0.04, 0.11, 0.251])
    save_json(root / "camera.json", OURS)
    colors = [frame.color for frame in open_sequence(root)]
    assert [None if c is None else c[0, 0, 0] for c in colors] == [40, 41, None]


def test_a_broken_colour_image_costs_only_the_colour(tmp_path, caplog):
    root = save_recording(tmp_path / "r", [0.0, 0.1], rgb_times_s=[0.0, 0.1])
    save_json(root / "camera.json", OURS)
    (root / "rgb/000001.png").unlink()
    frame = open_sequence(root).frame(1)
    assert frame.problem is None and frame.color is None and frame.depth_m is not None
    assert "rgb/000001.png cannot be read" in caplog.text


def test_labels_belong_to_the_depth_image_of_the_same_stem(root):
    save_image(root / "labels/000001.png", np.full((3, 4), 5, np.uint8))
    labels = [frame.labels for frame in open_sequence(root)]
    assert labels[0] is None and labels[2] is None
    assert labels[1].tolist() == [[5] * 4] * 3


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (lambda path: path.unlink(), "cannot be read: No such file"),
        (lambda path: path.write_bytes(path.read_bytes()[:40]), "is truncated"),
        (lambda path: save_image(path, np.ones((6, 8), np.uint8)), "8-bit, 1 channel"),
        (lambda path: save_image(path, np.ones((3, 4), np.uint16)), "4x3 px; allowed: .*8x6 px"),
        (lambda path: save_image(path, depth_units(0)), "no depth reading in .*000001.png"),
        (
            lambda path: save_image(path.parents[1] / "labels/000001.png", depth_units()),
            "label image .* is 16-bit",
        ),
    ],
)
def test_a_bad_frame_is_data_and_the_stream_goes_on(root, spoil, problem):
    spoil(root / "depth/000001.png")
    first, bad, last = open_sequence(root)
    assert first.problem is None and last.problem is None
    assert (bad.index, bad.timestamp_s, bad.depth_m, bad.color) == (1, 0.1, None, None)
    assert re.search(problem, bad.problem)


@pytest.mark.parametrize("second", ["0.300000", "0.200000"])
def test_time_stamps_that_do_not_increase_are_refused_at_opening(root, second):
    (root / "depth.txt").write_text(f"# t\n{second} depth/000000.png\n0.2 depth/000001.png\n")
    message = rf"depth\.txt, line 3: time stamp 0\.2 s does not come after {float(second)} s"
    with pytest.raises(SequenceError, match=message):
        open_sequence(root)


@pytest.mark.parametrize("line", ["soon depth/1.png", "0.3", "nan depth/1.png", "\0\0", "1 d\0"])
def test_an_index_line_that_cannot_be_parsed_is_refused_at_opening(root, line):
    (root / "depth.txt").write_text(f"0.1 depth/000000.png\n{line}\n")
    with pytest.raises(SequenceError, match=r"depth\.txt, line 2: .* is not 'timestamp_s file'"):
        open_sequence(root)


def test_an_index_without_frames_is_refused(root):
    (root / "depth.txt").write_text("# timestamp_s filename\n")
    with pytest.raises(SequenceError, match=r"depth\.txt lists no frame"):
        open_sequence(root)


def test_file_names_may_contain_spaces_and_tabs_may_separate(root):
    (root / "depth/000001.png").rename(root / "depth/one more.png")
    (root / "depth.txt").write_text("0.1\tdepth/000000.png\n0.2 depth/one more.png\n")
    assert [frame.problem for frame in open_sequence(root)] == [None, None]


def test_the_depth_unit_is_never_guessed(root):
    save_json(root / "camera.json", {k: v for k, v in OURS.items() if k != "depth_scale_m"})
    with pytest.raises(SequenceError, match=r"camera\.json: key 'depth_scale_m' is missing"):
        open_sequence(root)
    reader = open_sequence(root, depth_scale_m=0.01)
    assert reader.frame(0).depth_m[1, 1] == pytest.approx(20.0)
    with pytest.raises(SequenceError, match=r"depth_scale_m = 0\.0; allowed"):
        open_sequence(root, depth_scale_m=0.0)


def test_a_folder_without_its_camera_file_is_refused_by_name(root):
    (root / "camera.json").unlink()
    with pytest.raises(SequenceError, match=r"walk/camera\.json cannot be read"):
        open_sequence(root, format="folder")
    with pytest.raises(SequenceError, match=r"folder needs camera\.json \(missing\) and depth"):
        open_sequence(root)


def test_the_reference_joints_are_found_where_present(root):
    assert open_folder(root).reference_joints_path is None
    (root / "reference_joints.csv").write_text("frame,joint,x_m,y_m,z_m\n")
    assert open_folder(root).reference_joints_path == root / "reference_joints.csv"


@pytest.mark.parametrize("format", ["auto", "folder"])
def test_an_empty_folder_is_refused_with_what_each_format_needs(tmp_path, format):
    with pytest.raises(SequenceError, match=r"camera\.json") as caught:
        open_sequence(tmp_path, format=format)
    if format == "auto":
        assert "is empty" in str(caught.value)
        assert "tum needs depth.txt (missing) and rgb.txt (missing)" in str(caught.value)
        assert "azure needs intrinsic.json (missing) and depth/ (missing)" in str(caught.value)


def test_a_path_that_is_no_folder_is_refused(tmp_path):
    with pytest.raises(SequenceError, match="does not exist; needed: a sequence folder"):
        open_sequence(tmp_path / "nowhere")
    (tmp_path / "film.mp4").touch()
    with pytest.raises(SequenceError, match=r"film\.mp4 is a file; needed: a sequence folder"):
        open_sequence(tmp_path / "film.mp4")
    with pytest.raises(SequenceError, match="is of no known format. Formats: folder needs"):
        open_sequence(tmp_path)


def test_an_unknown_format_is_refused_with_the_known_ones(root):
    with pytest.raises(SequenceError, match="format = 'bag'; allowed: auto, folder, tum, azure"):
        open_sequence(root, format="bag")


def test_a_frame_rate_is_refused_where_there_are_time_stamps(root):
    with pytest.raises(SequenceError, match="fps = 30 does not apply.*'folder', has time stamps"):
        open_sequence(root, fps=30)


@pytest.mark.skipif(not DATA.is_dir(), reason=f"development recordings are not at {DATA}")
@pytest.mark.parametrize("name", REAL)
def test_real_recordings_open_and_their_frames_are_good(name):
    roots = sorted(path.parent for path in (DATA / name).rglob("camera.json"))
    assert roots
    for root in roots:
        reader = open_folder(root)
        for frame in map(reader.frame, (0, len(reader) // 2, len(reader) - 1)):
            assert frame.problem is None
            assert 0.3 < np.median(frame.depth_m[frame.depth_m > 0]) < 8.0
            assert (frame.color is None) == (name == "utd_mhad")
        if reader.reference_joints_path:
            joint_names, positions_m = read_reference_joints(reader.reference_joints_path)
            assert positions_m.shape == (len(reader), len(joint_names), 3)
            assert np.isfinite(positions_m).all()
        else:
            _, pixels, visibility = read_reference_pixels(root / "reference_mediapipe.csv")
            assert len(pixels) <= len(reader)
            assert 0 <= visibility.min() and visibility.max() <= 1

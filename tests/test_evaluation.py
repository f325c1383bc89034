# SPDX-License-Identifier: Apache-2.0
import io
import json

import cv2
import numpy as np
import pytest
from rich.console import Console

from kintrack.errors import ResultError
from kintrack.evaluation import evaluate, plot_evaluation, print_evaluation, write_evaluation
from kintrack.result import FrameResult, Track
from kintrack.sequence.reference import write_reference_joints

NAMES = ("pelvis", "l_knee", "r_knee", "l_foot")
PERSON = np.array([[0, 0, 2], [0.2, 0.4, 2], [-0.2, 0.4, 2], [0.2, 0.9, 2]], dtype=float)


def save_track(folder, positions, statuses=None, names=NAMES):
    folder.mkdir(parents=True, exist_ok=True)
    frames = [
        FrameResult(
            timestamp_s=index / 30,
            status=statuses[index] if statuses else "tracking",
            q=np.zeros(7),
            joint_positions_camera_m=joints,
            joint_covariances_m2=np.zeros((len(names), 3, 3)),
            joint_visible=np.ones(len(names)),
            residual_rms_m=0.01,
            inliers=100,
            milliseconds=20.0,
        )
        for index, joints in enumerate(positions)
    ]
    Track.from_frames(names, frames).save(folder / "track.npz")
    return folder


def save_reference(folder, positions, names=NAMES):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "reference_joints.csv"
    write_reference_joints(path, names, np.array(positions, dtype=float))
    return folder


@pytest.fixture
def five_frames(tmp_path):
    """A result 1 cm off while tracking, 30 cm off while lost, and its reference."""
    offsets = np.zeros((5, 1, 3))
    offsets[:, 0, 2] = [0.01, 0.01, 0.30, np.nan, 0.01]
    statuses = ["initialising", "tracking", "lost", "skipped", "tracking"]
    result = save_track(tmp_path / "result", PERSON + offsets, statuses)
    return result, save_reference(tmp_path / "sequence", [PERSON] * 5)


def printed(evaluation):
    console = Console(record=True, width=120, file=io.StringIO())
    print_evaluation(evaluation, console)
    return console.export_text()


def test_frames_that_are_not_tracking_are_counted_and_scored_apart(five_frames):
    evaluation = evaluate(*five_frames, reference_is_truth=True)
    assert evaluation.status_counts == {"initialising": 1, "tracking": 2, "lost": 1, "skipped": 1}
    assert evaluation.posed.frames == 4 and evaluation.tracking.frames == 2
    assert evaluation.posed.mean_m == pytest.approx((3 * 0.01 + 0.30) / 4)
    assert evaluation.tracking.mean_m == pytest.approx(0.01)
    assert evaluation.is_tracking.tolist() == [False, True, False, False, True]


def test_files_and_folders_name_the_same_things(five_frames):
    result, sequence = five_frames
    of_folders = evaluate(result, sequence, reference_is_truth=True)
    of_files = evaluate(
        result / "track.npz", sequence / "reference_joints.csv", reference_is_truth=True
    )
    assert json.dumps(of_folders.to_dict()) == json.dumps(of_files.to_dict())


def test_a_result_can_be_the_reference(tmp_path):
    a = save_track(tmp_path / "a", [PERSON] * 3)
    b = save_track(tmp_path / "b", [PERSON + [0.03, 0.04, 0]] * 3)
    assert evaluate(a, b, reference_is_truth=False).posed.mean_m == pytest.approx(0.05)
    assert evaluate(a, b / "track.npz", reference_is_truth=False).posed.samples == 12


def test_joints_are_matched_by_name_whatever_their_order(tmp_path):
    result = save_track(tmp_path / "result", [PERSON] * 2)
    order = [2, 0, 1]
    names = (*(NAMES[i] for i in order), "l_hand")
    reference = save_reference(tmp_path, [np.vstack([PERSON[order], [9, 9, 9]])] * 2, names)
    scores = evaluate(result, reference, reference_is_truth=True).posed
    assert scores.joint_names == NAMES[:3] and scores.mean_m < 1e-6


def test_only_the_joints_asked_for_are_compared(five_frames):
    scores = evaluate(*five_frames, reference_is_truth=True, joints=("r_knee", "pelvis")).posed
    assert scores.joint_names == ("r_knee", "pelvis") and scores.samples == 8


def test_the_frames_that_both_have_are_compared_and_the_table_says_so(tmp_path):
    result = save_track(tmp_path / "result", [PERSON] * 6)
    evaluation = evaluate(result, save_reference(tmp_path, [PERSON] * 4), reference_is_truth=True)
    assert evaluation.posed.frames == 4 and evaluation.to_dict()["compared_frames"] == 4
    text = printed(evaluation)
    assert "The result has 6 frames, the reference 4; the first 4 are compared." in text


def test_a_kinect_reference_is_never_called_truth(five_frames):
    agreement = printed(evaluate(*five_frames, reference_is_truth=False))
    assert "Distance to reference, all joints" in agreement and "rror" not in agreement
    assert "Error, all joints" in printed(evaluate(*five_frames, reference_is_truth=True))


def test_the_table_shows_every_joint_and_its_units(five_frames):
    text = printed(evaluate(*five_frames, reference_is_truth=True))
    assert "5 frames: 1 initialising, 2 tracking, 1 lost, 1 skipped" in text
    assert "mean (cm)" in text and "8.2" in text and "1.0" in text
    assert all(name in text for name in NAMES)


def test_writing_leaves_json_and_a_figure(five_frames, tmp_path):
    folder = tmp_path / "deep" / "scores"
    write_evaluation(evaluate(*five_frames, reference_is_truth=True), folder)
    content = json.loads((folder / "evaluation.json").read_text(), parse_constant=pytest.fail)
    assert content["measure"] == "error" and content["tracking_frames"]["swap_frames"] == 0
    assert content["posed_frames"]["joints"]["l_foot"]["median_m"] == pytest.approx(0.01)
    assert cv2.imread(str(folder / "evaluation.png")).shape[1] == 1440


@pytest.mark.parametrize("frames", [1, 3])
def test_a_result_without_one_pose_is_written_and_printed_without_a_warning(
    tmp_path, recwarn, frames
):
    result = save_track(tmp_path, [PERSON * np.nan] * frames, ["skipped"] * frames)
    reference = save_reference(tmp_path / "sequence", [PERSON] * frames)
    evaluation = evaluate(result, reference, reference_is_truth=True)
    write_evaluation(evaluation, tmp_path)
    content = json.loads((tmp_path / "evaluation.json").read_text(), parse_constant=pytest.fail)
    assert content["posed_frames"]["mean_m"] is None
    assert "0.0 %" in printed(evaluation)
    assert [str(warning.message) for warning in recwarn] == []


def test_paths_and_joints_without_common_ground_are_refused(five_frames, tmp_path):
    result, sequence = five_frames
    none = tmp_path / "none"
    with pytest.raises(ResultError, match="none: no result there; give a result folder"):
        evaluate(none, sequence, reference_is_truth=True)
    with pytest.raises(ResultError, match="none: no reference there; give a reference_joints.csv"):
        evaluate(result, none, reference_is_truth=True)
    with pytest.raises(ResultError, match="joint 'tail' is not in both; valid: pelvis, l_knee"):
        evaluate(result, sequence, reference_is_truth=True, joints=("pelvis", "tail"))
    other = save_reference(tmp_path / "other", [PERSON[:1]], ("l_hand",))
    with pytest.raises(ResultError, match="no common joint: the result has pelvis.* has l_hand"):
        evaluate(result, other, reference_is_truth=True)
    empty = save_track(tmp_path / "empty", [])
    with pytest.raises(ResultError, match=r"no common frame: .*empty/track.npz has 0, .* has 5"):
        evaluate(empty, sequence, reference_is_truth=True)


def test_an_output_folder_that_cannot_be_made_is_named(five_frames, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ResultError, match=r"cannot make the folder .*file/scores: Not a directory"):
        write_evaluation(evaluate(*five_frames, reference_is_truth=True), tmp_path / "file/scores")


def test_a_path_with_brackets_is_printed_as_it_is(tmp_path):
    result = save_track(tmp_path / "run[bold]", [PERSON] * 2)
    evaluation = evaluate(result, result, reference_is_truth=False)
    assert "run[bold]" in printed(evaluation).replace("\n", "")


def test_the_figure_names_what_it_shows_and_shades_a_single_lost_frame(tmp_path):
    statuses = ["tracking", "lost", "tracking"]
    result = save_track(tmp_path / "result", [PERSON] * 3, statuses)
    reference = save_reference(tmp_path, [PERSON] * 3)
    figure = plot_evaluation(evaluate(result, reference, reference_is_truth=False))
    curve, bars, time = figure.axes
    assert [line.get_label() for line in curve.lines] == ["tracking frames", "all posed frames"]
    assert [tick.get_text() for tick in bars.get_xticklabels()][1:3] == ["left knee", "right knee"]
    assert bars.get_ylabel() == time.get_ylabel() == "distance to reference [cm]"
    (shade,) = time.patches
    np.testing.assert_array_equal(shade.get_data().values, [0, 1, 0])
    np.testing.assert_allclose(shade.get_data().edges * 30, [0, 0.5, 1.5, 2])


def test_a_reference_that_misses_frames_and_joints_lowers_nothing_but_the_count(tmp_path):
    seen = np.stack([PERSON] * 4)
    seen[1] = np.nan
    seen[2, 3] = np.nan
    result = save_track(tmp_path / "result", [PERSON + [0, 0, 0.02]] * 4)
    scores = evaluate(result, save_reference(tmp_path, seen), reference_is_truth=False).posed
    assert (scores.frames, scores.samples, scores.coverage) == (3, 11, 1.0)
    np.testing.assert_allclose(scores.joint_mean_m, 0.02)


def test_offsets_that_turn_with_the_torso_are_found_even_when_only_a_wrist_is_compared(tmp_path):
    names = ("l_hip", "r_hip", "l_shoulder", "r_shoulder", "l_wrist")
    body = np.array([[0.1, 0.5, 0], [-0.1, 0.5, 0], [0.2, 0, 0], [-0.2, 0, 0], [0.3, 0.4, -0.2]])
    reference, estimate = [], []
    for angle in np.linspace(0, 3, 10):
        c, s = np.cos(angle), np.sin(angle)
        R_camera_body = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        reference.append(body @ R_camera_body.T + [0, 0, 3])
        estimate.append((body + [0, 0, 0.06]) @ R_camera_body.T + [0, 0, 3])
    result = save_track(tmp_path / "result", estimate, names=names)
    sequence = save_reference(tmp_path, reference, names)
    scores = evaluate(result, sequence, reference_is_truth=True, joints=("l_wrist",)).posed
    assert scores.mean_m == pytest.approx(0.06, abs=1e-5)
    assert scores.offset_free_torso_mean_m < 1e-5 < 0.03 < scores.offset_free_camera_mean_m

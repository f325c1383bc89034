# SPDX-License-Identifier: Apache-2.0
import json
import shutil
import sys
from pathlib import Path

import av
import numpy as np
import pytest

from kintrack.config import SolverConfig, StartConfig, TrackerConfig
from kintrack.errors import ConfigError, ResultError
from kintrack.fit import Outputs, caption, fit_sequence, load_person, posed_skin
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.result import STATUSES, Track
from kintrack.sequence import open_sequence

DEMO = Path(__file__).resolve().parents[1] / "src" / "kintrack" / "demo"
FRAMES = 15


def truncated_demo(folder, frames=FRAMES):
    """The first frames of the recording that ships, as a recording of its own."""
    (folder / "depth").mkdir(parents=True)
    shutil.copy(DEMO / "camera.json", folder)
    lines = [x for x in (DEMO / "depth.txt").read_text().splitlines() if not x.startswith("#")]
    (folder / "depth.txt").write_text("\n".join(lines[:frames]) + "\n")
    for line in lines[:frames]:
        name = line.split()[1]
        shutil.copy(DEMO / name, folder / name)
    return folder


@pytest.fixture(scope="module")
def sequence(tmp_path_factory):
    return open_sequence(truncated_demo(tmp_path_factory.mktemp("recordings") / "demo"))


@pytest.fixture(scope="module")
def fitted(sequence, tmp_path_factory):
    """A fit with the defaults and all outputs: folder, track, and the frames it reported."""
    folder, reported = tmp_path_factory.mktemp("fit"), []
    outputs = Outputs(video=folder / "films" / "overlay.mp4", html=folder / "pages" / "track.html")
    track = fit_sequence(
        sequence,
        folder / "result",
        outputs=outputs,
        on_frame=lambda frame, result: reported.append((frame, result)),
    )
    return folder, track, reported


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def test_a_solver_that_is_not_installed_leaves_an_earlier_result_alone(
    sequence, tmp_path, monkeypatch
):
    (tmp_path / "track.npz").write_bytes(b"earlier")
    monkeypatch.setitem(sys.modules, "casadi", None)
    config = TrackerConfig(solver=SolverConfig(method="ipopt"))
    with pytest.raises(ConfigError, match="CasADi"):
        fit_sequence(sequence, tmp_path, config)
    assert (tmp_path / "track.npz").read_bytes() == b"earlier"


def test_a_recording_becomes_a_valid_result_folder(fitted, human):
    folder, track, _ = fitted
    stored = Track.load(folder / "result" / "track.npz")
    assert len(stored) == len(track) == FRAMES
    assert stored.joint_names == JOINT_NAMES
    assert stored.q.shape == (FRAMES, human.body.nq)
    assert np.array_equal(stored.joint_positions_camera_m, track.joint_positions_camera_m)
    assert set(stored.status) == {"tracking"}


def test_the_demo_is_tracked_near_its_true_joints(fitted):
    reference = {}
    for line in (DEMO / "reference_joints.csv").read_text().splitlines()[1:]:
        frame, joint, *position = line.split(",")
        reference[int(frame), joint] = [float(x) for x in position]
    track = fitted[1]
    truth = np.array([[reference[i, name] for name in JOINT_NAMES] for i in range(FRAMES)])
    errors = np.linalg.norm(track.joint_positions_camera_m - truth, axis=-1)
    assert np.median(errors) < 0.05
    assert errors.mean() < 0.07


def test_the_summary_tells_everything_about_the_run(fitted, sequence):
    summary = summary_of(fitted[0] / "result")
    assert summary["finished"] is True
    assert summary["frames"] == FRAMES
    assert set(summary["status_counts"]) == set(STATUSES)
    assert sum(summary["status_counts"].values()) == FRAMES
    assert summary["camera"]["fx"] == sequence.camera.fx
    assert summary["config"]["solver"]["rounds"] >= 1
    assert summary["skipped"] == [] == summary["untracked"]
    assert np.allclose(summary["T_world_camera"], T_LEVEL_WORLD_CAMERA)
    assert summary["residual_rms_m"]["median"] < 0.015


def test_the_person_is_sized_and_can_be_loaded_again(fitted):
    human, T_world_camera = load_person(fitted[0] / "result")
    assert len(human.shape) == StartConfig().shape_coefficients
    assert np.abs(human.shape).max() > 0
    assert np.allclose(T_world_camera, T_LEVEL_WORLD_CAMERA)
    q = fitted[1].q[-1]
    vertices = posed_skin(human, q, T_world_camera)
    near = np.linalg.norm(
        vertices[:, None] - fitted[1].joint_positions_camera_m[-1][None], axis=-1
    ).min(axis=0)
    assert near.max() < 0.15


def test_every_frame_is_reported_as_it_comes(fitted):
    _, track, reported = fitted
    assert [frame.index for frame, _ in reported] == list(range(FRAMES))
    assert [result.status for _, result in reported] == list(track.status)


def test_video_and_page_are_written_where_wanted(fitted):
    folder = fitted[0]
    with av.open(str(folder / "films" / "overlay.mp4")) as video:
        assert sum(1 for _ in video.decode(video=0)) == FRAMES
    page = (folder / "pages" / "track.html").read_text()
    assert page.lstrip().lower().startswith("<!doctype html") and len(page) > 100_000


def test_two_fits_write_the_same_track_but_for_the_milliseconds(fitted, sequence, tmp_path):
    fit_sequence(sequence, tmp_path / "again")
    with (
        np.load(fitted[0] / "result" / "track.npz", allow_pickle=False) as first,
        np.load(tmp_path / "again" / "track.npz", allow_pickle=False) as second,
    ):
        assert first.files == second.files
        for name in first.files:
            if name != "milliseconds":
                assert first[name].tobytes() == second[name].tobytes(), name


def test_an_interrupted_fit_leaves_the_frames_so_far(sequence, tmp_path, quick):
    def interrupt(frame, result):
        if frame.index == 4:
            raise KeyboardInterrupt

    outputs = Outputs(tmp_path / "overlay.mp4", tmp_path / "track.html")
    with pytest.raises(KeyboardInterrupt):
        fit_sequence(sequence, tmp_path / "result", quick, outputs, on_frame=interrupt)
    track = Track.load(tmp_path / "result" / "track.npz")
    assert len(track) == 5
    assert set(track.status) == {"tracking"}
    summary = summary_of(tmp_path / "result")
    assert summary["finished"] is False and summary["frames"] == 5
    assert (tmp_path / "overlay.mp4").stat().st_size > 1000
    assert (tmp_path / "track.html").stat().st_size > 1000
    assert [p.name for p in (tmp_path / "result").iterdir() if p.name.startswith(".")] == []


def test_bad_frames_are_counted_and_the_rest_is_tracked(tmp_path, quick):
    folder = truncated_demo(tmp_path / "demo", 5)
    broken = folder / "depth" / "000002.png"
    broken.write_bytes(broken.read_bytes()[:500])
    (folder / "depth" / "000003.png").unlink()
    track = fit_sequence(open_sequence(folder), tmp_path / "result", quick)
    assert list(track.status) == ["tracking", "tracking", "skipped", "skipped", "tracking"]
    summary = summary_of(tmp_path / "result")
    assert summary["status_counts"]["skipped"] == 2
    assert [entry["frame"] for entry in summary["skipped"]] == [2, 3]
    assert "000002.png" in summary["skipped"][0]["reason"]
    assert np.isnan(track.q[2:4]).all()


def test_an_output_that_cannot_be_written_fails_before_any_work(sequence, tmp_path, quick):
    blocker = tmp_path / "file"
    blocker.write_text("")
    worked = []
    for folder, outputs in (
        (blocker / "result", Outputs()),
        (tmp_path / "result", Outputs(html=blocker / "page" / "track.html")),
        (tmp_path / "result", Outputs(video=blocker / "film" / "overlay.mp4")),
    ):
        with pytest.raises(ResultError, match="file"):
            fit_sequence(sequence, folder, quick, outputs, on_frame=lambda *_: worked.append(1))
    assert worked == []


def test_a_pitched_camera_is_noted_in_the_summary(tmp_path, quick):
    folder = truncated_demo(tmp_path / "demo", 1)
    T = camera_pose(10.0)
    fit_sequence(open_sequence(folder), tmp_path / "result", quick, T_world_camera=T)
    assert np.allclose(load_person(tmp_path / "result")[1], T)


def test_a_missing_or_broken_summary_is_named(tmp_path):
    with pytest.raises(ResultError, match="summary.json"):
        load_person(tmp_path)
    for text in ("{", "{}", "[]", '{"T_world_camera": [1, 2]}'):
        (tmp_path / "summary.json").write_text(text)
        with pytest.raises(ResultError, match="summary.json"):
            load_person(tmp_path)


def test_an_unknown_pose_has_no_skin(human):
    q = np.full(human.body.nq, np.nan)
    assert posed_skin(human, q, T_LEVEL_WORLD_CAMERA) is None


def test_captions_say_what_matters(fitted):
    _, result = fitted[2][3]
    assert " ms" in caption(result) and " mm" in caption(result)

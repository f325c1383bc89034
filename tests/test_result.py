# SPDX-License-Identifier: Apache-2.0
import json
import os
import subprocess
import sys
import textwrap
import time
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from kintrack.errors import ResultError
from kintrack.files import write_json
from kintrack.geometry import PinholeCamera
from kintrack.result import FrameResult, Track
from kintrack.result_writer import TrackWriter, summarise

NAMES = ("pelvis", "head")
CAMERA = PinholeCamera(320, 240, 285.0, 285.0, 159.5, 119.5)


def make_frame(index=0, status="tracking", **changes):
    rng = np.random.default_rng(index)
    frame = FrameResult(
        timestamp_s=index / 30,
        status=status,
        q=rng.normal(size=7),
        joint_positions_camera_m=rng.normal(size=(2, 3)),
        joint_covariances_m2=np.stack([np.eye(3)] * 2) * 1e-4,
        joint_visible=np.array([1.0, 0.25]),
        residual_rms_m=0.01,
        inliers=1000 + index,
        milliseconds=20.0,
        reason="no depth" if status == "skipped" else None,
    )
    return replace(frame, **changes)


def open_writer(folder, **changes):
    settings = {"sequence_name": "walk", "camera": CAMERA, "config": {"fit": {"prior": 1.0}}}
    return TrackWriter(folder, NAMES, **(settings | changes))


def stored_arrays(tmp_path, **changes):
    path = tmp_path / "track.npz"
    Track.from_frames(NAMES, [make_frame(0), make_frame(1)]).save(path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    arrays |= {name: value for name, value in changes.items() if value is not None}
    for name, value in changes.items():
        if value is None:
            del arrays[name]
    np.savez(path, **arrays)
    return path


def test_a_saved_track_loads_as_it_was(tmp_path):
    track = Track.from_frames(NAMES, [make_frame(0, "initialising"), make_frame(1)])
    track.save(tmp_path / "track.npz")
    loaded = Track.load(tmp_path / "track.npz")
    assert loaded.joint_names == NAMES and len(loaded) == 2
    assert loaded.status.dtype == "<U12" and loaded.status.tolist() == ["initialising", "tracking"]
    assert loaded.q.shape == (2, 7) and loaded.joint_covariances_m2.shape == (2, 2, 3, 3)
    for name in ("q", "joint_positions_camera_m", "joint_visible", "inliers", "timestamps_s"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(track, name))


def test_a_track_without_frames_is_valid(tmp_path):
    Track.from_frames(NAMES, []).save(tmp_path / "track.npz")
    loaded = Track.load(tmp_path / "track.npz")
    assert len(loaded) == 0 and loaded.joint_positions_camera_m.shape == (0, 2, 3)


def test_the_same_track_saved_on_another_day_has_the_same_bytes(tmp_path, monkeypatch):
    track = Track.from_frames(NAMES, [make_frame(0), make_frame(1)])
    track.save(tmp_path / "a.npz")
    later = time.localtime(time.time() + 90_000)
    monkeypatch.setattr(time, "time", lambda: 2e9)
    monkeypatch.setattr(time, "localtime", lambda *_: later)
    track.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with zipfile.ZipFile(tmp_path / "b.npz") as archive:
        assert {info.date_time[0] for info in archive.infolist()} == {1980}


def test_a_slower_run_differs_in_milliseconds_alone(tmp_path):
    for name, milliseconds in (("a.npz", 20.0), ("b.npz", 35.0)):
        Track.from_frames(NAMES, [make_frame(0, milliseconds=milliseconds)]).save(tmp_path / name)
    with zipfile.ZipFile(tmp_path / "a.npz") as a, zipfile.ZipFile(tmp_path / "b.npz") as b:
        differing = [name for name in a.namelist() if a.read(name) != b.read(name)]
    assert differing == ["milliseconds.npy"]


def test_a_write_that_fails_leaves_the_old_file_and_no_rest(tmp_path, monkeypatch):
    path = tmp_path / "track.npz"
    Track.from_frames(NAMES, [make_frame(0)]).save(path)
    before = path.read_bytes()

    def fill_the_disk(file, **arrays):
        file.write(b"half a file")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", fill_the_disk)
    with pytest.raises(ResultError, match="track.npz: No space left"):
        Track.from_frames(NAMES, [make_frame(1)]).save(path)
    assert path.read_bytes() == before and os.listdir(tmp_path) == ["track.npz"]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"q": None}, "track.npz: array q is missing; needed: timestamps_s"),
        ({"inliers": np.zeros(3, int)}, r"array inliers has shape \(3,\); needed: 2"),
        ({"q": np.zeros(2)}, r"array q has shape \(2,\); needed: 2 x nq"),
        ({"joint_visible": np.zeros((2, 5))}, r"joint_visible has shape \(2, 5\); needed: 2 x 2"),
        ({"status": np.array([1, 2])}, "array status has dtype int64"),
        ({"status": np.array(["tracking", "asleep"])}, "status 'asleep' is unknown; valid: init"),
        ({"q": np.array([{}, {}], dtype=object)}, "is not a track.npz: .*allow_pickle=False"),
    ],
)
def test_a_track_with_a_bad_array_is_refused(tmp_path, changes, message):
    with pytest.raises(ResultError, match=message):
        Track.load(stored_arrays(tmp_path, **changes))


def test_a_file_that_is_no_track_is_refused(tmp_path):
    with pytest.raises(ResultError, match="none.npz: there is no such file"):
        Track.load(tmp_path / "none.npz")
    (tmp_path / "text.npz").write_text("not a zip")
    with pytest.raises(ResultError, match="text.npz is not a track.npz"):
        Track.load(tmp_path / "text.npz")
    whole = stored_arrays(tmp_path).read_bytes()
    (tmp_path / "cut.npz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(ResultError, match="cut.npz is not a track.npz"):
        Track.load(tmp_path / "cut.npz")
    np.save(tmp_path / "single.npy", np.zeros(3))
    with pytest.raises(ResultError, match="single.npy is not a track.npz: it holds a single array"):
        Track.load(tmp_path / "single.npy")


def test_frames_that_do_not_fit_the_joint_names_are_refused():
    with pytest.raises(ResultError, match="array joint_positions_camera_m has shape"):
        Track.from_frames((*NAMES, "chest"), [make_frame(0)])


def test_the_writer_leaves_a_track_and_a_summary(tmp_path):
    folder = tmp_path / "new" / "kintrack"
    statuses = ["initialising", "tracking", "tracking", "skipped", "lost"]
    with open_writer(folder, config={"ratio": float("nan"), "size": (1, 2)}) as writer:
        for index, status in enumerate(statuses):
            slow = 5.0 if status == "skipped" else 10.0 * (index + 1)
            why = {"initialising": "nobody in view", "skipped": "no depth"}.get(status)
            writer.append(make_frame(index, status, milliseconds=slow, reason=why))
    assert Track.load(folder / "track.npz").status.tolist() == statuses
    text = (folder / "summary.json").read_text()
    summary = json.loads(text, parse_constant=pytest.fail)
    assert text == json.dumps(summary, indent=2, sort_keys=True) + "\n"
    assert summary["finished"] is True and summary["frames"] == 5
    assert summary["status_counts"] == {"initialising": 1, "tracking": 2, "lost": 1, "skipped": 1}
    assert summary["skipped"] == [{"frame": 3, "reason": "no depth"}]
    assert summary["untracked"] == [{"frame": 0, "reason": "nobody in view"}]
    assert summary["config"] == {"ratio": None, "size": [1, 2]}
    assert summary["camera"]["fx"] == 285.0 and summary["sequence"] == "walk"
    assert set(summary["versions"]) == {"python", "kintrack", "numpy", "pin", "numba", "opencv"}
    assert summary["latency_ms"]["median"] == 25.0 and summary["fps_median"] == 40.0
    assert sorted(os.listdir(folder)) == ["summary.json", "track.npz"]


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, RuntimeError])
def test_an_interrupted_writer_leaves_every_frame_so_far(tmp_path, interruption):
    with pytest.raises(interruption), open_writer(tmp_path) as writer:
        writer.append(make_frame(0))
        writer.append(make_frame(1))
        raise interruption
    assert len(Track.load(tmp_path / "track.npz")) == 2
    assert json.loads((tmp_path / "summary.json").read_text())["finished"] is False


def test_a_killed_writer_leaves_a_loadable_track(tmp_path):
    script = """
        import os, signal, sys
        from pathlib import Path
        sys.path.insert(0, sys.argv[2])
        from test_result import make_frame, open_writer
        writer = open_writer(Path(sys.argv[1]), flush_every_s=0.0)
        for index in range(3):
            writer.append(make_frame(index))
        os.kill(os.getpid(), signal.SIGKILL)
    """
    tests = os.path.dirname(__file__)
    command = [sys.executable, "-c", textwrap.dedent(script), str(tmp_path), tests]
    assert subprocess.run(command).returncode == -9
    assert Track.load(tmp_path / "track.npz").inliers.tolist() == [1000, 1001, 1002]
    assert json.loads((tmp_path / "summary.json").read_text())["finished"] is False


def test_frames_are_written_only_when_a_flush_is_due(tmp_path):
    writer = open_writer(tmp_path, flush_every_s=3600.0)
    writer.append(make_frame(0))
    assert len(Track.load(tmp_path / "track.npz")) == 0
    assert len(writer.close()) == 1
    assert len(Track.load(tmp_path / "track.npz")) == 1


def test_a_folder_that_cannot_be_written_shows_before_any_work(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ResultError, match=r"cannot make the folder .*file/result: Not a directory"):
        open_writer(tmp_path / "file" / "result")
    with pytest.raises(ResultError, match=r"cannot make the folder .*file: File exists"):
        open_writer(tmp_path / "file")
    (tmp_path / "taken" / "track.npz").mkdir(parents=True)
    with pytest.raises(ResultError, match=r"cannot write .*taken/track.npz: Is a directory"):
        open_writer(tmp_path / "taken")


def test_a_summary_without_frames_has_null_instead_of_nan(tmp_path):
    summary = summarise(Track.from_frames(NAMES, [make_frame(0, "skipped")]))
    write_json(tmp_path / "summary.json", summary)
    read = json.loads((tmp_path / "summary.json").read_text(), parse_constant=pytest.fail)
    assert read["fps_median"] is None and read["residual_rms_m"]["p95"] is None


def test_json_takes_the_types_a_configuration_holds(tmp_path):
    content = {
        "path": tmp_path,
        "tuple": (1, True, None),
        "number": np.float32(0.5),
        "array": np.array([[1.0, np.nan], [np.inf, 2.0]]),
    }
    write_json(tmp_path / "a.json", content)
    assert json.loads((tmp_path / "a.json").read_text(), parse_constant=pytest.fail) == {
        "path": str(tmp_path),
        "tuple": [1, True, None],
        "number": 0.5,
        "array": [[1.0, None], [None, 2.0]],
    }


def test_residual_statistics_are_of_tracking_frames_and_latency_of_frames_not_skipped():
    frames = [
        make_frame(0, "tracking", residual_rms_m=0.01, milliseconds=10.0),
        make_frame(1, "tracking", residual_rms_m=0.03, milliseconds=30.0),
        make_frame(2, "lost", residual_rms_m=0.50, milliseconds=20.0),
        make_frame(3, "skipped", residual_rms_m=np.nan, milliseconds=0.1),
    ]
    summary = summarise(Track.from_frames(NAMES, frames))
    assert summary["residual_rms_m"] == pytest.approx({"median": 0.02, "p95": 0.029})
    assert summary["latency_ms"] == pytest.approx({"median": 20.0, "p95": 29.0})
    assert summary["fps_median"] == pytest.approx(50.0)

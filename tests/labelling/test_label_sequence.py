# SPDX-License-Identifier: Apache-2.0
"""A recording in, labels of the frames worth keeping out."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import kintrack
from kintrack.errors import ResultError
from kintrack.labelling.sequence import label_sequence
from kintrack.sequence import open_sequence

DEMO = Path(kintrack.__file__).parent / "demo"
FRAMES = range(0, 20, 2)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Ten frames of the demo without its labels, the fourth one broken."""
    root = tmp_path_factory.mktemp("label") / "short"
    (root / "depth").mkdir(parents=True)
    shutil.copy(DEMO / "camera.json", root)
    lines = [line for line in (DEMO / "depth.txt").read_text().splitlines() if line[0] != "#"]
    for i in FRAMES:
        shutil.copy(DEMO / lines[i].split()[1], root / "depth")
    (root / "depth.txt").write_text("\n".join(lines[i] for i in FRAMES) + "\n")
    (root / lines[6].split()[1]).write_bytes(b"no picture")
    return root


@pytest.fixture
def copy(recording, tmp_path):
    return Path(shutil.copytree(recording, tmp_path / "copy"))


@pytest.fixture(scope="module")
def labelled(recording, tmp_path_factory, unsized):
    """The recording labelled into a folder of its own."""
    folder = tmp_path_factory.mktemp("out") / "labelled"
    return folder, label_sequence(open_sequence(recording), folder, tracker=unsized)


def test_the_new_folder_reads_back_with_labels_near_the_truth(labelled):
    folder, report = labelled
    sequence = open_sequence(folder)
    assert len(sequence) == report.kept == 9
    truth = {f.timestamp_s: f for f in open_sequence(DEMO)}
    for frame in sequence:
        true = truth[frame.timestamp_s]
        assert np.abs(frame.depth_m - true.depth_m).max() < 1e-6
        person = true.labels > 0
        assert (frame.labels[person] == true.labels[person]).mean() > 0.85


def test_the_report_lists_the_dropped_frame_with_its_reason(labelled):
    folder, _ = labelled
    report = json.loads((folder / "labels.json").read_text())
    assert report["dropped"] == [3] and report["kept"] == 9 and report["finished"]
    assert "not tracking" in report["per_frame"][3]["reasons"][0]
    assert report["reasons"] == {"not tracking": 1}
    assert report["thresholds"]["keeping"]["max_rms_m"] == 0.02
    assert [row["labels"] for row in report["per_frame"]][2:5] == [
        "labels/000002.png",
        None,
        "labels/000003.png",
    ]


def test_the_picture_shows_something(labelled):
    picture = cv2.imread(str(labelled[0] / "labels.png"))
    assert picture is not None and picture.std() > 20


def test_labels_in_place_carry_the_names_of_the_depth_images(copy, unsized):
    stages = []
    label_sequence(
        open_sequence(copy), tracker=unsized, on_progress=lambda *step: stages.append(step)
    )
    names = sorted(path.name for path in (copy / "labels").glob("*.png"))
    assert names == [f"{i:06d}.png" for i in FRAMES if i != 6]
    frames = list(open_sequence(copy))
    assert frames[0].labels is not None and frames[3].labels is None
    assert stages[-1] == ("labelling", 10, 10) and ("tracking", 20, 20) in stages


def test_labels_that_are_there_stay_unless_told_otherwise(copy, unsized):
    (copy / "labels").mkdir()
    old = copy / "labels" / "000006.png"
    cv2.imwrite(str(old), np.ones((240, 320), np.uint8))
    before = old.read_bytes()
    with pytest.raises(ResultError, match="holds 1 label images.*--overwrite"):
        label_sequence(open_sequence(copy), tracker=unsized)
    assert old.read_bytes() == before
    label_sequence(open_sequence(copy), tracker=unsized, overwrite=True)
    assert not old.exists() and len(list((copy / "labels").glob("*.png"))) == 9


def test_a_folder_that_is_not_empty_or_is_the_recording_is_refused_before_any_work(copy, tmp_path):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    with pytest.raises(ResultError, match="not empty"):
        label_sequence(open_sequence(copy), tmp_path / "full")
    with pytest.raises(ResultError, match="the recording itself"):
        label_sequence(open_sequence(copy), copy)


def test_a_recording_of_nobody_names_the_reasons_and_leaves_no_folder(copy, tmp_path, unsized):
    blob = np.zeros((240, 320), np.uint16)
    blob[100:110, 100:110] = 2000
    for path in (copy / "depth").glob("*.png"):
        cv2.imwrite(str(path), blob)
    with pytest.raises(ResultError, match=r"no frame is kept: not tracking \(10 of 10"):
        label_sequence(open_sequence(copy), tmp_path / "none", tracker=unsized)
    assert not (tmp_path / "none").exists()


def test_stopping_while_labels_are_written_leaves_a_valid_folder(copy, tmp_path, unsized):
    def stop(stage, done, total):
        if stage == "labelling" and done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        label_sequence(open_sequence(copy), tmp_path / "part", tracker=unsized, on_progress=stop)
    assert len(open_sequence(tmp_path / "part")) == 2
    report = json.loads((tmp_path / "part" / "labels.json").read_text())
    assert report["finished"] is False and report["kept"] == 2


def test_a_limb_that_only_one_way_loses_is_dropped_or_taken_from_the_other(recording, unsized):
    from kintrack.geometry import T_LEVEL_WORLD_CAMERA
    from kintrack.labelling.foreground import find_foreground
    from kintrack.labelling.opinions import Labeller, LabellingConfig
    from kintrack.labelling.passes import track_both_ways

    sequence = open_sequence(recording)
    passes = track_both_ways(sequence, unsized)
    body = passes.human.body
    spoiled = list(passes.forward)
    q = spoiled[5].q.copy()
    k = body.dof("l_shoulder_elevation") + 1
    q[k] = np.radians(120)
    spoiled[5] = replace(spoiled[5], q=q)
    passes = replace(passes, forward=tuple(spoiled))
    labeller = Labeller(
        sequence, find_foreground(sequence), passes, T_LEVEL_WORLD_CAMERA, LabellingConfig()
    )
    verdicts = labeller.verdicts()
    assert verdicts[5].way == "backward"
    assert not verdicts[5].reasons and verdicts[5].opinions == 1

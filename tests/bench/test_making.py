# SPDX-License-Identifier: Apache-2.0
import os

import numpy as np
import pytest

from kintrack.bench import running
from kintrack.bench.made import MADE_FILE, is_made
from kintrack.bench.segmentation.making import Excerpt, make_all, spread
from kintrack.errors import SceneError
from kintrack.sequence.folder import open_folder
from kintrack.sequence.occlusion import read_occlusion
from kintrack.sequence.write import SequenceWriter

from .small_bench import CAMERA, figure, record


@pytest.fixture
def at_once(monkeypatch):
    """Jobs run here; like the real thing it tells libraries to use one thread."""

    def run_all(jobs, workers, on_progress):
        os.environ["OMP_NUM_THREADS"] = "1"
        failed = {}
        for job in jobs:
            try:
                job.run()
            except SceneError as error:
                failed[job] = str(error)
            on_progress(0)
        return failed

    monkeypatch.setattr(running, "run_all", run_all)


def made(job):
    seen = []
    failed = make_all([job], 1, lambda done, total: seen.append((done, total)))
    return failed, seen


def test_frames_are_spread_over_the_whole_recording():
    assert spread(100, 5) == [0, 25, 50, 74, 99]
    assert spread(3, 10) == [0, 1, 2] and spread(1, 4) == [0]


def test_an_excerpt_keeps_images_joints_and_what_hides_them_in_step(tmp_path, at_once):
    writer = SequenceWriter(tmp_path / "long", CAMERA, joint_names=("head", "l_wrist"))
    depth, color, labels = figure()
    for n in range(9):
        writer.write(
            n / 10,
            depth + n / 100,
            color=color,
            labels=labels,
            joint_positions_m=np.array([[n, 0, 3.0], [0, n, 3.0]]),
            hidden_share=n / 10,
            hidden_joints=["l_wrist"] if n == 8 else [],
        )
    job = Excerpt(tmp_path / "long", tmp_path / "short", 3, labelled=True)
    assert made(job) == ({}, [(0, 1), (1, 1), (1, 1)])
    short = open_folder(tmp_path / "short")
    assert len(short) == 3
    assert short.frame(1).depth_m[0, 0] == pytest.approx(4.04)
    shares, hidden = read_occlusion(tmp_path / "short" / "occlusion.csv")
    assert shares == pytest.approx([0.0, 0.4, 0.8])
    assert hidden.sum(axis=1).tolist() == [0, 0, 1]
    lines = (tmp_path / "short" / "reference_joints.csv").read_text().splitlines()
    assert "2,head,8.000000,0.000000,3.000000" in lines


def test_an_excerpt_is_made_again_when_its_source_or_its_length_changes(tmp_path, at_once):
    job = Excerpt(record(tmp_path / "long"), tmp_path / "short", 2, labelled=True)
    made(job)
    assert is_made(job.folder, job.recipe()) and made(job)[1] == [(1, 1), (1, 1)]
    longer = Excerpt(tmp_path / "long", tmp_path / "short", 3, labelled=True)
    assert not is_made(longer.folder, longer.recipe())
    path = tmp_path / "long" / "depth" / "000001.png"
    path.write_bytes(path.read_bytes() + b"\0")
    assert not is_made(job.folder, job.recipe())


def test_a_folder_that_was_left_half_made_is_made_anew(tmp_path, at_once):
    job = Excerpt(record(tmp_path / "long"), tmp_path / "short", 2, labelled=True)
    made(job)
    (tmp_path / "short" / MADE_FILE).unlink()
    made(job)
    assert is_made(job.folder, job.recipe()) and len(open_folder(tmp_path / "short")) == 2


def test_one_thread_for_those_who_film_is_not_one_thread_for_what_is_timed(
    tmp_path, at_once, monkeypatch
):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    made(Excerpt(record(tmp_path / "long"), tmp_path / "short", 2, labelled=True))
    assert "OMP_NUM_THREADS" not in os.environ

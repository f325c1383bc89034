# SPDX-License-Identifier: Apache-2.0
import subprocess
import sys

import av
import numpy as np
import pytest

from kintrack.errors import ResultError
from kintrack.export.video import VideoWriter


def grey(level, shape=(48, 64)):
    return np.full((*shape, 3), level, dtype=np.uint8)


def decode(path):
    with av.open(str(path)) as video:
        stream = video.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert stream.codec_context.pix_fmt == "yuv420p"
        return [frame.to_ndarray(format="rgb24") for frame in video.decode(video=0)]


def test_a_video_has_every_picture_in_order_and_its_rate(tmp_path):
    path = tmp_path / "walk.mp4"
    with VideoWriter(path, 29.97) as writer:
        for i in range(40):
            writer.write(grey(40 + 4 * i))
    pictures = decode(path)
    assert [p.shape for p in pictures] == [(48, 64, 3)] * 40
    levels = np.array([p.mean() for p in pictures])
    assert np.abs(levels - (40 + 4 * np.arange(40))).max() < 4
    with av.open(str(path)) as video:
        assert float(video.streams.video[0].average_rate) == pytest.approx(29.97, abs=0.01)


def test_odd_sizes_gain_a_row_and_a_column(tmp_path):
    with VideoWriter(tmp_path / "odd.mp4", 10) as writer:
        writer.write(grey(200, (75, 101)))
    (picture,) = decode(tmp_path / "odd.mp4")
    assert picture.shape == (76, 102, 3)
    assert picture[:, -1].mean() > 190


def test_an_interrupt_leaves_what_was_written_so_far(tmp_path):
    path = tmp_path / "cut.mp4"
    with pytest.raises(KeyboardInterrupt), VideoWriter(path, 30) as writer:
        for i in range(7):
            writer.write(grey(i))
        raise KeyboardInterrupt
    assert len(decode(path)) == 7


def test_a_killed_writer_leaves_a_readable_file(tmp_path):
    path = tmp_path / "killed.mp4"
    program = (
        "import os, sys, numpy as np\n"
        "from kintrack.export.video import VideoWriter\n"
        "writer = VideoWriter(sys.argv[1], 30)\n"
        "for i in range(150): writer.write(np.full((48, 64, 3), i, dtype=np.uint8))\n"
        "os.kill(os.getpid(), 9)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program, str(path)], timeout=60)
    assert ended.returncode == -9
    assert len(decode(path)) >= 60


def test_a_finished_file_is_a_plain_mp4_with_a_duration(tmp_path):
    path = tmp_path / "plain.mp4"
    with VideoWriter(path, 30) as writer:
        for _ in range(60):
            writer.write(grey(90))
    with av.open(str(path)) as video:
        assert video.duration == pytest.approx(2_000_000, rel=0.02)


@pytest.mark.parametrize("name", ["no_such_folder/a.mp4", "a.avi", "a_folder.mp4"])
def test_a_path_that_cannot_be_written_is_named_before_any_work(tmp_path, name):
    (tmp_path / "a_folder.mp4").mkdir()
    with pytest.raises(ResultError, match=name):
        VideoWriter(tmp_path / name, 30)


@pytest.mark.parametrize("fps", [0.0, -1.0, float("nan"), float("inf")])
def test_an_impossible_rate_is_refused(tmp_path, fps):
    with pytest.raises(ResultError, match="fps"):
        VideoWriter(tmp_path / "a.mp4", fps)
    assert not (tmp_path / "a.mp4").exists()


def test_a_picture_of_another_size_is_refused_and_the_video_stays_good(tmp_path):
    path = tmp_path / "sizes.mp4"
    with pytest.raises(ResultError, match="shape"), VideoWriter(path, 30) as writer:
        writer.write(grey(1))
        writer.write(grey(1, (50, 64)))
    assert len(decode(path)) == 1


def test_no_picture_leaves_no_file_and_closing_twice_is_harmless(tmp_path):
    writer = VideoWriter(tmp_path / "none.mp4", 30)
    writer.close()
    writer.close()
    assert list(tmp_path.iterdir()) == []

# SPDX-License-Identifier: Apache-2.0
import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from export.small_track import CAMERA, SKIN, shoot
from kintrack.errors import ResultError
from kintrack.export import HtmlRecorder
from kintrack.export.packing import pack_frame, pack_scene, sample_points, script_json
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, transform_points


def unpack(packed):
    size = int.from_bytes(packed[:4], "little")
    header = json.loads(packed[4 : 4 + size])
    counts = [header["vertices"], header["joints"], header["points"]]
    values = np.frombuffer(packed, "<i2", 3 * sum(counts), 4 + size).reshape(-1, 3) / 1000
    colors = np.frombuffer(packed, np.uint8, offset=4 + size + 6 * sum(counts)).reshape(-1, 3)
    return header, *np.split(values, np.cumsum(counts)[:2]), colors


def pack(shot, **changes):
    frame = replace(shot.frame, **changes)
    return pack_frame(
        frame, shot.vertices, shot.joints, "tracking", "hi", T_LEVEL_WORLD_CAMERA, 3000
    )


def record(count, **options):
    recorder = HtmlRecorder(SKIN, **options)
    for i in range(count):
        shot = shoot(i)
        recorder.add(shot.frame, shot.vertices, shot.joints, "tracking")
    return recorder


def written(recorder, tmp_path):
    recorder.write(tmp_path / "page.html")
    return (tmp_path / "page.html").read_text()


def frames_in(page):
    (arguments,) = re.findall(r"^play\(new PersonScene\(viewer, (.*)\);$", page, re.MULTILINE)
    scene, end = json.JSONDecoder().raw_decode(arguments)
    return scene, json.loads(arguments[end:].lstrip("), "))


def test_a_packed_frame_gives_back_world_millimetres():
    shot = shoot(0)
    header, vertices, joints, points, colors = unpack(pack(shot))
    assert header["status"] == "tracking" and header["text"] == "hi" and header["index"] == 0
    for packed, camera in ((vertices, shot.vertices), (joints, shot.joints)):
        assert np.abs(packed - transform_points(T_LEVEL_WORLD_CAMERA, camera)).max() < 0.0006
    assert len(points) == len(colors) == min(3000, np.count_nonzero(shot.frame.depth_m))


def test_observed_points_lie_on_the_body_they_were_rendered_from():
    _, vertices, _, points, _ = unpack(pack(shoot(0)))
    gaps = np.linalg.norm(points[::50, None] - vertices[None], axis=2).min(axis=1)
    assert gaps.max() < 0.05


def test_points_take_the_color_of_their_pixel():
    shot = shoot(0)
    color = np.zeros((CAMERA.height, CAMERA.width, 3), dtype=np.uint8)
    color[shot.frame.depth_m > 0] = 1, 2, 3
    *_, colors = unpack(pack(shot, color=color))
    assert (colors == (1, 2, 3)).all()


def test_points_are_few_and_mostly_near_the_body():
    shot = shoot(0)
    wall = np.where(shot.frame.depth_m > 0, shot.frame.depth_m, 6.0)
    frame = replace(shot.frame, depth_m=wall)
    points, _ = sample_points(frame, shot.vertices, 400)
    assert len(points) == 400
    assert np.mean(points[:, 2] < 4) == pytest.approx(0.75)
    everything, _ = sample_points(frame, shot.vertices, 10**6)
    assert len(everything) == wall.size


def test_unknown_bodies_and_depth_leave_empty_parts():
    shot = replace(shoot(0), vertices=np.full((4, 3), np.nan), joints=None)
    header, *_ = unpack(pack(shot, depth_m=None))
    assert (header["vertices"], header["joints"], header["points"]) == (0, 0, 0)


def test_the_scene_has_the_skin_and_the_cameras_outline():
    scene = pack_scene(SKIN, CAMERA, T_LEVEL_WORLD_CAMERA, 10)
    faces = np.frombuffer(base64.b64decode(scene["faces"]), "<u4").reshape(-1, 3)
    assert np.array_equal(faces, SKIN.faces)
    assert len(base64.b64decode(scene["vertex_colors"])) == 3 * len(SKIN.labels)
    assert scene["axis"] == [1.0, 0.0, 0.0]
    assert np.array(scene["frustum"]).shape == (16, 3)


def test_the_page_holds_every_frame_with_its_time(tmp_path):
    page = written(record(5), tmp_path)
    _, frames = frames_in(page)
    assert [frame["time_s"] for frame in frames] == [i / 30 for i in range(5)]
    headers = [unpack(base64.b64decode(frame["data"]))[0] for frame in frames]
    assert [header["index"] for header in headers] == list(range(5))
    assert "5 of 5 frames, 30.0 frames/s" in page


def test_the_page_loads_nothing_from_anywhere(tmp_path):
    page = written(record(1), tmp_path)
    code = page[: page.index('<script type="text/plain"')]
    assert set(re.findall(r"https?://[^\s\"'\\)]+", code)) <= {"http://www.w3.org/1999/xhtml"}
    assert not re.search(r"<(script|link|img|iframe)[^>]*\b(src|href)\s*=", code)
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', page)
    assert "default-src 'none'" in policy and "connect-src 'none'" in policy


def test_frames_are_thinned_evenly_to_stay_small_and_the_page_says_so(tmp_path):
    largest = 3 * len(base64.b64encode(pack(shoot(0))))
    recorder = record(12, largest_bytes=largest)
    page = written(recorder, tmp_path)
    _, frames = frames_in(page)
    indices = [unpack(base64.b64decode(frame["data"]))[0]["index"] for frame in frames]
    assert len(recorder) == len(indices) and indices[0] == 0
    assert set(np.diff(indices)) == {8} or set(np.diff(indices)) == {4}
    assert f"{len(indices)} of 12 frames" in page
    assert sum(len(frame["data"]) for frame in frames) <= largest


def test_ninety_frames_make_less_than_25_megabytes():
    one = len(base64.b64encode(pack(shoot(0)))) + 50
    assert 90 * one + 1_500_000 < 25e6


def test_texts_cannot_end_the_script_or_the_title(tmp_path):
    assert "<" not in script_json("</script>")
    page = written(record(1, title="<b>&"), tmp_path)
    assert "<title>&lt;b&gt;&amp;</title>" in page


def test_a_page_without_frames_or_folder_is_refused(tmp_path):
    with pytest.raises(ResultError, match="no frames"):
        HtmlRecorder(SKIN).write(tmp_path / "page.html")
    with pytest.raises(ResultError, match="no_such_folder"):
        record(1).write(tmp_path / "no_such_folder" / "page.html")
    assert list(tmp_path.iterdir()) == []

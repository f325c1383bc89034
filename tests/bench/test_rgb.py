# SPDX-License-Identifier: Apache-2.0
import sys

import numpy as np
import pytest

from kintrack.bench import rgb
from kintrack.bench.rgb import (
    THICKNESS_M,
    TRUNK,
    find_pixels,
    lift,
    lifted_pixel,
    obstacle,
    regress,
)
from kintrack.bench.rgb_worker import LANDMARKS
from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame

from .small_bench import CAMERA, figure, record, witnessed

MIDDLE = np.array([CAMERA.cx, CAMERA.cy])
J = {name: n for n, name in enumerate(JOINT_NAMES)}


def frame(depth=None):
    return Frame(0, 0.0, CAMERA, figure()[0] if depth is None else depth)


def flat(depth_m):
    return frame(np.full((CAMERA.height, CAMERA.width), depth_m, np.float32))


def test_a_joint_lies_behind_the_skin_on_its_line_of_sight():
    joint = lifted_pixel(flat(2.0), MIDDLE, "elbow")
    assert joint == pytest.approx([0, 0, 2.0 + THICKNESS_M["elbow"]])
    aside = MIDDLE + [60, -40]
    joint = lifted_pixel(flat(2.0), aside, "hip")
    assert CAMERA.project(joint) == pytest.approx(aside)
    assert np.linalg.norm(joint) - np.linalg.norm(joint * 2.0 / joint[2]) == pytest.approx(
        THICKNESS_M["hip"]
    )


def test_single_wrong_readings_and_holes_around_a_joint_do_not_matter():
    odd = flat(2.0)
    u, v = np.rint(MIDDLE).astype(int)
    odd.depth_m[v, u], odd.depth_m[v + 1, u] = 0.7, 0.0
    assert lifted_pixel(odd, MIDDLE, "knee")[2] == pytest.approx(2.0 + THICKNESS_M["knee"])


def test_no_reading_no_pixel_or_one_outside_the_image_is_a_missing_joint():
    assert np.isnan(lifted_pixel(flat(0.0), MIDDLE, "knee")).all()
    for place in (np.full(2, np.nan), np.array([-5.0, 10.0]), np.array([10.0, CAMERA.height])):
        assert np.isnan(lifted_pixel(flat(2.0), place, "knee")).all()


def test_the_trunk_lies_between_hips_and_shoulders_and_misses_what_they_miss():
    places = {
        f"{side}_{name}": MIDDLE + [sign * 15, down]
        for side, sign in (("l", 1), ("r", -1))
        for name, down in (("hip", 40), ("shoulder", -40))
    }
    joints = lift(flat(2.0), places)
    hips, shoulders = (
        joints[[J[f"l_{name}"], J[f"r_{name}"]]].mean(axis=0) for name in ("hip", "shoulder")
    )
    for name, share in TRUNK.items():
        assert joints[J[name]] == pytest.approx(hips + share * (shoulders - hips))
    assert np.isnan(joints[J["head"]]).all() and np.isnan(joints[J["l_knee"]]).all()
    del places["l_hip"]
    assert np.isnan(lift(flat(2.0), places)[[J[name] for name in TRUNK]]).all()


def test_the_head_is_found_by_one_ear_too():
    joints = lift(flat(2.0), {"l_ear": MIDDLE, "r_ear": np.full(2, np.nan)})
    assert joints[J["head"]] == pytest.approx([0, 0, 2.0 + THICKNESS_M["ear"]])


def test_every_landmark_has_a_thickness():
    assert set(LANDMARKS) == set(THICKNESS_M)


def test_a_recording_is_regressed_from_kept_pixels(tmp_path):
    folder = record(tmp_path / "boxes", 2)
    u, v = MIDDLE
    witnessed(folder, [(0, "l_wrist", u, v, 0.9), (0, "r_wrist", u, v, 0.4)])
    pixels = folder / "reference_mediapipe.csv"
    seen = []
    track = regress(open_sequence(folder), tmp_path / "out", pixels, None, lambda: seen.append(1))
    assert len(seen) == 2 and track.status.tolist() == ["tracking", "lost"]
    known = np.isfinite(track.joint_positions_camera_m[0]).all(axis=1)
    assert known.tolist() == [name == "l_wrist" for name in JOINT_NAMES]


def test_without_mediapipe_the_interpreter_is_named(tmp_path):
    assert str(tmp_path / "none") in obstacle(tmp_path / "none")
    with pytest.raises(ResultError, match="none cannot be started"):
        find_pixels(tmp_path, tmp_path / "pixels.csv", tmp_path / "none")


def test_a_worker_that_fails_leaves_no_half_table_and_says_why(tmp_path, monkeypatch):
    worker = tmp_path / "worker.py"
    worker.write_text(
        "import sys\nopen(sys.argv[2], 'w').write('frame')\nsys.exit('no such model')\n"
    )
    monkeypatch.setattr(rgb.rgb_worker, "__file__", str(worker))
    with pytest.raises(ResultError, match="no such model"):
        find_pixels(tmp_path, tmp_path / "pixels.csv", sys.executable)
    assert not (tmp_path / "pixels.csv").exists()

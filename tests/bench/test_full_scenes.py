# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.bench.cases import Case
from kintrack.bench.full_scenes import witnessed
from kintrack.joints import JOINT_NAMES
from kintrack.result import FrameResult
from kintrack.result_writer import TrackWriter

from .small_bench import CAMERA, record
from .small_bench import witnessed as write_witness

N = len(JOINT_NAMES)
PLACES = {
    "l_shoulder": (140, 60), "r_shoulder": (110, 60), "l_hip": (135, 110), "r_hip": (115, 110),
    "l_wrist": (160, 100), "r_wrist": (90, 100),
}  # fmt: skip
"""The torso is 50 px long, so that 10 px are near."""


@pytest.fixture
def recording(tmp_path):
    folder = record(tmp_path / "walk", 3, labelled=False)
    rows = [(n, name, u, v, 0.99) for n in range(3) for name, (u, v) in PLACES.items()]
    write_witness(folder, [*rows[:-1], (2, "r_wrist", 90, 100, 0.5)])
    return Case("scenes", "walk", "clean", folder)


def tracked(folder, frames):
    """Results whose joints lie at pixels (u, v) 2 m away; None for a lost frame."""
    with TrackWriter(folder, JOINT_NAMES, sequence_name="x", camera=CAMERA, config={}) as writer:
        for n, places in enumerate(frames):
            joints = np.full((N, 3), np.nan)
            for name, (u, v) in (places or {}).items():
                x, y = (u - CAMERA.cx) / CAMERA.fx, (v - CAMERA.cy) / CAMERA.fy
                joints[JOINT_NAMES.index(name)] = 2.0 * np.array([x, y, 1.0])
            status = "lost" if places is None else "tracking"
            writer.append(
                FrameResult(n / 10, status, np.zeros(0), joints, np.full((N, 3, 3), np.nan),
                            np.zeros(N), float("nan"), 0, 0.0)
            )  # fmt: skip
    return folder


def test_joints_on_the_witness_agree_and_lost_frames_miss_all(recording, tmp_path):
    found = witnessed(recording, tracked(tmp_path / "out", [None, PLACES, PLACES]))
    assert found["joints"] == 17
    assert found["pck"] == pytest.approx(11 / 17) and found["pck_posed"] == 1.0
    assert found["status"]["lost"] == pytest.approx(1 / 3) and found["locked_after"] == 2
    assert found["swapped_frames"] == 0


def test_a_fifth_of_the_torso_is_near_and_more_is_not(recording, tmp_path):
    u, v = PLACES["l_wrist"]
    for away, near in ((9, True), (11, False)):
        places = PLACES | {"l_wrist": (u + away, v)}
        found = witnessed(recording, tracked(tmp_path / str(away), [places] * 3))
        assert found["pck"] == pytest.approx(1.0 if near else 14 / 17)


def test_exchanged_wrists_are_a_swap_where_the_witness_sees_both(recording, tmp_path):
    crossed = PLACES | {"l_wrist": PLACES["r_wrist"], "r_wrist": PLACES["l_wrist"]}
    found = witnessed(recording, tracked(tmp_path / "out", [crossed] * 3))
    assert found["swapped_frames"] == 2


def test_a_jump_to_somebody_else_shows_in_the_pelvis(recording, tmp_path):
    near, far = PLACES | {"pelvis": (125, 110)}, PLACES | {"pelvis": (200, 110)}
    found = witnessed(recording, tracked(tmp_path / "out", [near, near, far]))
    assert found["largest_step_m"] == pytest.approx(2.0 * 75 / CAMERA.fx)
    found = witnessed(recording, tracked(tmp_path / "gone", [near, None, far]))
    assert found["largest_step_m"] is None

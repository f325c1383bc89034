# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import numpy as np
import pytest

from kintrack.errors import DatasetError
from kintrack.joints import JOINT_NAMES
from synthesis.motions.mocap import (
    HELD_OUT,
    Clip,
    clips_in,
    despiked,
    facing_x,
    load_clip,
    mirrored_clip,
)

DATA = Path(__file__).parents[4] / "shared" / "data" / "mocap"


def arrays() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    x = np.cumsum(rng.normal(scale=0.005, size=(6, 21, 3)), axis=0) + rng.normal(size=(21, 3))
    return {
        "joint_positions_m": x.astype(np.float32),
        "joint_names": np.array(JOINT_NAMES),
        "rate_hz": np.array(30),
    }


@pytest.fixture
def clip(tmp_path) -> Clip:
    np.savez(tmp_path / "some.npz", **arrays())
    return load_clip(tmp_path / "some.npz")


def test_a_clip_is_read_with_its_name_times_and_joints(clip):
    assert clip.name == "some"
    np.testing.assert_allclose(clip.times_s, np.arange(6) / 30.0)
    assert clip.rate_hz() == pytest.approx(30.0)
    np.testing.assert_array_equal(
        clip.joint("l_knee"), arrays()["joint_positions_m"][:, JOINT_NAMES.index("l_knee")]
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"joint_positions_m": None}, "lacks the arrays joint_positions_m"),
        ({"rate_hz": None}, "lacks the arrays rate_hz"),
        ({"joint_positions_m": np.zeros((6, 20, 3))}, "shape"),
        ({"joint_positions_m": np.zeros((6, 21, 3), dtype=int)}, "real numbers"),
        ({"joint_positions_m": np.zeros((1, 21, 3))}, "at least 2"),
        ({"joint_positions_m": np.full((3, 21, 3), np.nan)}, "3 frames .* the first is 0"),
        ({"rate_hz": np.array(0)}, "above 0 Hz"),
        ({"joint_names": np.array(("tail", *JOINT_NAMES[1:]))}, "unknown: ..tail"),
        ({"joint_names": np.array((*JOINT_NAMES[:20], "pelvis"))}, "twice: ..pelvis"),
        ({"joint_names": np.array([object()])}, "cannot be read"),
    ],
)
def test_a_clip_that_is_not_whole_is_refused_by_name(tmp_path, change, message):
    content = {k: v for k, v in (arrays() | change).items() if v is not None}
    np.savez(tmp_path / "broken.npz", **content)
    with pytest.raises(DatasetError, match=message) as caught:
        load_clip(tmp_path / "broken.npz")
    assert "broken.npz" in str(caught.value)


def test_a_file_that_is_no_archive_or_does_not_exist_is_refused(tmp_path):
    (tmp_path / "text.npz").write_text("hello")
    for name in ("text.npz", "nowhere.npz"):
        with pytest.raises(DatasetError, match=name):
            load_clip(tmp_path / name)


def test_clips_are_listed_by_name_and_an_empty_folder_is_refused(tmp_path):
    with pytest.raises(DatasetError, match="no .*npz"):
        clips_in(tmp_path)
    with pytest.raises(DatasetError, match="no such folder"):
        clips_in(tmp_path / "nowhere")
    for name in ("b.npz", "a.npz", "c.txt"):
        (tmp_path / name).touch()
    assert [path.name for path in clips_in(tmp_path)] == ["a.npz", "b.npz"]


def test_mirroring_swaps_the_sides_and_twice_gives_the_clip_back(clip):
    other = mirrored_clip(clip)
    np.testing.assert_allclose(other.joint("l_hip"), clip.joint("r_hip") * [1.0, -1.0, 1.0])
    np.testing.assert_allclose(mirrored_clip(other).joint("l_hip"), clip.joint("l_hip"))


def test_a_turned_clip_starts_between_its_hips_with_the_left_hip_to_the_left(clip):
    turned = facing_x(clip)
    left, right = turned.joint("l_hip")[0], turned.joint("r_hip")[0]
    np.testing.assert_allclose((left + right)[:2], 0.0, atol=1e-12)
    assert left[1] > 0.0 and left[0] == pytest.approx(0.0, abs=1e-12)
    bones = [np.linalg.norm(np.diff(c.joint_positions_m, axis=1), axis=2) for c in (clip, turned)]
    np.testing.assert_allclose(*bones)
    np.testing.assert_allclose(turned.joint("head")[:, 2], clip.joint("head")[:, 2])


def test_a_person_without_a_heading_is_refused(clip):
    x = clip.joint_positions_m.copy()
    x[:, clip.joint_names.index("l_hip"), :2] = x[:, clip.joint_names.index("r_hip"), :2]
    with pytest.raises(DatasetError, match="one hip is above the other"):
        facing_x(Clip(clip.name, clip.times_s, clip.joint_names, x))


def test_a_joint_that_jumps_away_and_back_is_put_between_its_neighbours(clip):
    x = clip.joint_positions_m.copy()
    x[3, 7] += [0.5, 0.0, 0.0]
    out = despiked(Clip(clip.name, clip.times_s, clip.joint_names, x)).joint_positions_m
    np.testing.assert_allclose(out[3], 0.5 * (x[2] + x[4]))
    kept = [0, 1, 2, 4, 5]
    np.testing.assert_array_equal(out[kept], x[kept])
    np.testing.assert_array_equal(despiked(clip).joint_positions_m, clip.joint_positions_m)


@pytest.mark.skipif(not DATA.is_dir(), reason=f"no motion capture in {DATA}")
def test_every_clip_of_the_data_is_readable_and_those_held_out_are_among_them():
    clips = {path.stem: load_clip(path) for path in clips_in(DATA)}
    assert set(HELD_OUT) < set(clips)
    for clip in clips.values():
        assert clip.rate_hz() == pytest.approx(30.0)

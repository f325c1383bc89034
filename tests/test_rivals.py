# SPDX-License-Identifier: Apache-2.0
"""A start that exchanges sides is found out, and what was said of it is amended."""

from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest

import kintrack.tracker
from kintrack.begin import begin
from kintrack.calibration.config import BodyConfig
from kintrack.config import TrackerConfig
from kintrack.errors import ConfigError
from kintrack.fit import fit_sequence
from kintrack.joints import JOINT_NAMES
from kintrack.rival_config import RivalConfig
from kintrack.rivals import challenges, crossed_legs, turned_round
from kintrack.tracker import Tracker

FRAMES = 24
LEGS = [JOINT_NAMES.index(f"{side}_{name}") for side in "lr" for name in ("knee", "ankle", "foot")]


def pose(scene, index):
    return scene.place({"r_elbow_flexion": 30 + 2 * index, "knee_flexion": 15}, heading_deg=20)


@pytest.fixture(scope="module")
def movie(scene):
    return [scene.frame(scene.depth(pose(scene, i)), i) for i in range(FRAMES)]


@pytest.fixture
def mistaken(scene, monkeypatch):
    """Whoever starts by itself takes back for front."""
    wrong = turned_round(scene.joints(pose(scene, 0)))

    def found(human, observation, T_world_camera, config, labelled):
        return begin(human, observation, wrong, T_world_camera, config)

    monkeypatch.setattr(kintrack.tracker, "found_by", found)


def errors(scene, results):
    return np.array(
        [scene.errors(pose(scene, i), r.joint_positions_camera_m) for i, r in enumerate(results)]
    )


def test_turning_round_swaps_the_sides_and_twice_is_nothing(scene):
    joints = scene.joints(pose(scene, 0))
    turned = turned_round(joints)
    left, right = JOINT_NAMES.index("l_knee"), JOINT_NAMES.index("r_knee")
    assert (turned[left] == joints[right]).all() and (turned[right] == joints[left]).all()
    middle = [JOINT_NAMES.index(name) for name in ("pelvis", "chest", "head")]
    assert (turned[middle] == joints[middle]).all()
    assert (turned_round(turned) == joints).all()


def test_a_track_that_began_back_to_front_is_turned_and_amended(scene, movie, unsized, mistaken):
    tracker, results = Tracker(unsized), []
    for frame in movie:
        results.append(tracker.step(frame))
        if not tracker.in_doubt:
            break
    better = tracker.amended
    assert better[-1] is results[-1]
    assert all(b.milliseconds >= r.milliseconds for b, r in zip(better, results, strict=True))
    assert len(better) == len(results) > unsized.rival.least_frames
    assert [r.timestamp_s for r in better] == [frame.timestamp_s for frame in movie[: len(better)]]
    assert errors(scene, results[:-1]).mean() > 0.15
    assert errors(scene, better).mean() < 0.03


def striding(scene, index):
    """In profile, the right leg before the left one and farther from the camera."""
    stride = {"r_hip_flexion": 15, "l_hip_flexion": -10, "knee_flexion": 10}
    return scene.place(stride | {"elbow_flexion": 30 + 2 * index}, heading_deg=80)


def test_crossing_legs_leaves_hips_and_arms_alone_and_twice_is_nothing(scene):
    joints = scene.joints(striding(scene, 0))
    crossed = crossed_legs(joints)
    moved = {JOINT_NAMES[j] for j in np.flatnonzero((crossed != joints).any(axis=1))}
    assert moved == {f"{side}_{name}" for side in "lr" for name in ("knee", "ankle", "foot")}
    assert (crossed_legs(crossed) == joints).all()


def test_a_track_that_began_on_exchanged_legs_is_put_right_and_amended(scene, unsized, monkeypatch):
    movie = [scene.frame(scene.depth(striding(scene, i)), i) for i in range(FRAMES)]
    wrong = crossed_legs(scene.joints(striding(scene, 0)))

    def found(human, observation, T_world_camera, config, labelled):
        return begin(human, observation, wrong, T_world_camera, config)

    def off(result, index):
        joints = result.joint_positions_camera_m
        return scene.errors(striding(scene, index), joints)[LEGS].mean()

    monkeypatch.setattr(kintrack.tracker, "found_by", found)
    lenient = replace(unsized.judge, start_explained=0.5, min_explained=0.5)
    tracker, results = Tracker(replace(unsized, judge=lenient)), []
    for frame in movie:
        results.append(tracker.step(frame))
        if not tracker.in_doubt:
            break
    assert off(results[0], 0) > 0.12
    assert len(tracker.amended) == len(results)
    assert max(off(result, i) for i, result in enumerate(tracker.amended)) < 0.05


class OneAfterTheOther:
    """Threads that are none: what is submitted is done at once."""

    @staticmethod
    def submit(do, *arguments):
        done = Future()
        done.set_result(do(*arguments))
        return done


def test_rivals_beside_the_track_find_what_they_find_one_after_the_other(
    movie, unsized, mistaken, monkeypatch
):
    beside = Tracker(unsized)
    both = [(beside.step(frame), beside.amended) for frame in movie]
    monkeypatch.setattr(kintrack.tracker, "other_cores", OneAfterTheOther)
    alone = Tracker(unsized)
    for frame, (result, amended) in zip(movie, both, strict=True):
        again = alone.step(frame)
        assert again.q.tobytes() == result.q.tobytes()
        assert [r.q.tobytes() for r in alone.amended] == [r.q.tobytes() for r in amended]


def test_legs_of_which_one_is_not_seen_are_not_exchanged(scene, movie, unsized):
    result = Tracker(unsized).step(movie[0])
    assert len(challenges(result, unsized.rival)) == 2
    seen = result.joint_visible.copy()
    seen[[JOINT_NAMES.index(f"r_{name}") for name in ("knee", "ankle", "foot")]] = 0.0
    assert len(challenges(replace(result, joint_visible=seen), unsized.rival)) == 1


def test_a_new_start_from_joints_ends_a_duel(scene, movie, unsized, mistaken):
    tracker = Tracker(unsized)
    tracker.step(movie[0])
    assert tracker.in_doubt
    tracker.begin(movie[1], scene.joints(pose(scene, 1)))
    assert not tracker.in_doubt
    results = [tracker.step(frame) for frame in movie[2:14]]
    assert not tracker.amended
    assert scene.errors(pose(scene, 13), results[-1].joint_positions_camera_m).mean() < 0.03


def test_without_rivals_it_stays_back_to_front(scene, movie, unsized, mistaken):
    tracker = Tracker(replace(unsized, rival=RivalConfig(most_frames=0)))
    results = [tracker.step(frame) for frame in movie]
    assert errors(scene, results)[-1].mean() > 0.15


def test_a_right_start_is_not_turned(scene, movie, unsized):
    tracker = Tracker(unsized)
    for frame in movie:
        result = tracker.step(frame)
        assert not tracker.amended
    assert not tracker.in_doubt
    assert scene.errors(pose(scene, FRAMES - 1), result.joint_positions_camera_m).mean() < 0.03


def test_a_result_folder_holds_the_amended_frames(scene, movie, unsized, mistaken, tmp_path):
    class Sequence:
        name, camera = "movie", scene.camera

        def __len__(self):
            return FRAMES

        def __iter__(self):
            return iter(movie)

        def frame(self, index):
            return movie[index]

    track = fit_sequence(Sequence(), tmp_path / "out", unsized, body=BodyConfig("template"))
    found = track.joint_positions_camera_m
    off = [scene.errors(pose(scene, i), found[i]).mean() for i in range(FRAMES)]
    assert len(track) == FRAMES and max(off) < 0.04


def test_a_frame_that_cannot_be_read_decides_nothing(scene, movie, unsized, mistaken):
    tracker = Tracker(unsized)
    for n, frame in enumerate(movie):
        bad = replace(frame, depth_m=None, problem="depth/000003.png is truncated")
        tracker.step(bad if n == 3 else frame)
        if tracker.amended:
            break
    assert [r.status for r in tracker.amended].count("skipped") == 1


@pytest.mark.parametrize(
    "values",
    [
        {"wins": 1.5},
        {"legs_win": -1},
        {"loses_early": 0.9},
        {"loses": 0.5},
        {"most_frames": -1},
        {"least_frames": 0},
    ],
)
def test_numbers_that_make_no_sense_are_refused(values):
    with pytest.raises(ConfigError, match=f"RivalConfig.{next(iter(values))}"):
        TrackerConfig(rival=RivalConfig(**values))

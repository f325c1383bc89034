# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import cv2
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.joints import JOINT_NAMES
from kintrack.lifecycle import NOBODY
from kintrack.raster import rasterise
from kintrack.rival_config import RivalConfig
from kintrack.skin import skinned_vertices
from kintrack.start import found_by
from kintrack.tracker import Tracker

LEFT_ARM = [JOINT_NAMES.index(f"l_{name}") for name in ("elbow", "wrist", "hand")]
RIGHT_ARM = [JOINT_NAMES.index(f"r_{name}") for name in ("elbow", "wrist", "hand")]
FRAMES = 30


def waving(scene, index):
    """Both arms rise and bend, and the person sways."""
    phase = 0.5 * (1 - np.cos(2 * np.pi * index / FRAMES))
    return scene.place(
        {
            "l_shoulder_elevation": 10 + 60 * phase,
            "r_shoulder_elevation": 10 + 35 * phase,
            "elbow_flexion": 15 + 50 * phase,
        },
        heading_deg=10 * phase,
        at=(2.8, 0.08 * phase, 0.0),
    )


def track(tracker, frames):
    return [tracker.step(frame) for frame in frames]


def bad_frames(scene):
    empty = np.zeros((scene.camera.height, scene.camera.width), dtype=np.float32)
    return {
        "unreadable": replace(scene.frame(None), problem="depth/000004.png is truncated"),
        "without depth": scene.frame(None),
        "all zero": scene.frame(empty),
        "all NaN": scene.frame(np.full_like(empty, np.nan)),
    }


@pytest.fixture(scope="module")
def movie(scene):
    return [scene.frame(scene.depth(waving(scene, i), wall_m=4.5), i) for i in range(FRAMES)]


@pytest.fixture(scope="module")
def run(movie, quick):
    """Results of the whole movie, and what the tracker believed after each frame."""
    tracker, results, beliefs = Tracker(quick), [], []
    for frame in movie:
        results.append(tracker.step(frame))
        beliefs.append(tracker.belief)
    return results, beliefs


@pytest.fixture(scope="module")
def results(run):
    return run[0]


@pytest.fixture(scope="module")
def stages():
    return []


@pytest.fixture(scope="module")
def again(movie, quick, stages):
    """The first frames once more, by another tracker, with the stages it reports."""
    tracker = Tracker(quick, clock=stages.append)
    return track(tracker, movie[:6])


@pytest.fixture
def after(run, quick):
    """A function of a frame number: a tracker that has followed the movie up to it."""

    def resume(index):
        tracker = Tracker(quick)
        tracker.belief = run[1][index]
        return tracker

    return resume


def test_moving_arms_are_followed_within_two_centimetres(scene, results):
    assert [result.status for result in results] == ["tracking"] * FRAMES
    errors = np.array(
        [
            scene.errors(waving(scene, i), result.joint_positions_camera_m)
            for i, result in enumerate(results)
        ]
    )
    assert errors.mean() < 0.02
    assert errors.mean(axis=1).max() < 0.03
    assert errors[:, LEFT_ARM + RIGHT_ARM].mean() < 0.03


def test_a_result_is_whole_and_within_limits(results, body):
    for result in results:
        assert np.isfinite(result.q).all() and np.isfinite(result.joint_positions_camera_m).all()
        assert (result.q[7:] >= body.lower[6:] - 1e-9).all()
        assert (result.q[7:] <= body.upper[6:] + 1e-9).all()
        assert ((result.joint_visible >= 0) & (result.joint_visible <= 1)).all()
        assert result.residual_rms_m < 0.01 and result.inliers > 500
        assert result.milliseconds > 0 and result.reason is None


def test_covariances_are_symmetric_and_positive(results):
    for covariance in results[-1].joint_covariances_m2:
        assert np.allclose(covariance, covariance.T, atol=1e-12)
        assert np.linalg.eigvalsh(covariance).min() > 0


def test_two_runs_are_equal_to_the_bit(results, again):
    for first, second in zip(results, again, strict=False):
        for name in ("q", "joint_positions_camera_m", "joint_covariances_m2", "joint_visible"):
            assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
        assert first.residual_rms_m == second.residual_rms_m
        assert (first.status, first.inliers) == (second.status, second.inliers)


def without_left_arm(scene, human, q):
    """Depth of the body with something 1 m from the camera before the left arm."""
    vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
    vertices = transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), vertices)
    depth, face = rasterise(vertices, human.skin.faces, scene.camera)
    on_arm = (human.skin.labels == 4)[human.skin.faces].any(axis=1)
    arm = ((face >= 0) & on_arm[face]).astype(np.uint8)
    hidden = cv2.dilate(arm, np.ones((9, 9), np.uint8)) > 0
    return np.where(hidden, 1.0, np.where(face >= 0, depth, 0.0)).astype(np.float32)


def test_a_limb_without_data_stays_predicted_and_its_doubt_grows(scene, after):
    tracker = after(14)  # arms up
    q = waving(scene, 15)
    seen = track(tracker, [scene.frame(scene.depth(q), i) for i in (15, 16, 17)])
    masked = without_left_arm(scene, scene.human, q)
    blind = track(tracker, [scene.frame(masked, i) for i in range(18, 28)])
    assert {result.status for result in seen + blind} == {"tracking"}
    hand, other = JOINT_NAMES.index("l_hand"), JOINT_NAMES.index("r_hand")
    doubt = np.array([np.trace(r.joint_covariances_m2, axis1=1, axis2=2) for r in seen + blind])
    assert doubt[3, hand] > 2 * doubt[2, hand]
    assert doubt[-1, hand] > 10 * doubt[2, hand]
    assert doubt[-1, other] < 2 * doubt[2, other]
    assert blind[-1].joint_visible[hand] < 0.1 < blind[-1].joint_visible[other]
    errors = scene.errors(q, blind[-1].joint_positions_camera_m)
    assert np.delete(errors, LEFT_ARM).mean() < 0.02
    for joint in LEFT_ARM:  # whatever it drifted lies within three of its own standard deviations
        covariance = blind[-1].joint_covariances_m2[joint]
        assert errors[joint] < 3 * np.sqrt(np.linalg.eigvalsh(covariance).max())


@pytest.mark.parametrize("kind", ["unreadable", "without depth", "all zero", "all NaN"])
def test_a_bad_frame_is_skipped_with_a_reason_and_survived(scene, movie, after, kind):
    tracker = after(2)
    bad = replace(bad_frames(scene)[kind], index=3, timestamp_s=3 / 30)
    skipped, good = track(tracker, [bad, movie[4]])
    assert skipped.status == "skipped"
    assert skipped.reason
    assert np.isnan(skipped.q).all() and np.isnan(skipped.joint_positions_camera_m).all()
    assert skipped.inliers == 0
    assert good.status == "tracking"
    assert scene.errors(waving(scene, 4), good.joint_positions_camera_m).mean() < 0.03


def test_the_reader_s_reason_is_passed_on(scene, after):
    assert after(2).step(bad_frames(scene)["unreadable"]).reason == "depth/000004.png is truncated"


def test_bad_frames_before_the_first_good_one_are_skipped_too(scene, quick):
    tracker = Tracker(quick)
    results = track(tracker, bad_frames(scene).values())
    assert [result.status for result in results] == ["skipped"] * 4


def test_nobody_in_view_is_initialising(scene, quick):
    tracker = Tracker(quick)
    for result in track(tracker, [scene.room(0), scene.room(1)]):
        assert result.status == "initialising"
        assert np.isnan(result.q).all() and result.reason == NOBODY
        assert result.joint_positions_camera_m.shape == (len(JOINT_NAMES), 3)


def test_a_person_who_leaves_is_lost_and_found_again(scene, movie, after):
    tracker = after(2)
    gone = track(tracker, [scene.room(i) for i in range(3, 15)])
    statuses = [result.status for result in gone]
    lost = statuses.index("lost")
    assert set(statuses[:lost]) <= {"tracking"}
    assert set(statuses[lost + 1 :]) <= {"initialising", "lost"}
    q = scene.place(at=(3.3, 0.5, 0.0))
    back = scene.frame(scene.depth(q, wall_m=4.5), 15)
    found = tracker.step(back)
    assert found.status == "tracking"
    assert scene.errors(q, found.joint_positions_camera_m).mean() < 0.03


def test_a_gap_in_time_is_survived(scene, movie, after):
    tracker = after(2)
    late = scene.frame(scene.depth(waving(scene, 6), wall_m=4.5), 6)
    result = tracker.step(late)
    assert result.status == "tracking"
    assert scene.errors(waving(scene, 6), result.joint_positions_camera_m).mean() < 0.03


def test_stages_are_reported_for_benchmarks(again, stages):
    assert stages.count("start") == 1
    assert stages.count("observe") == stages.count("report") - 1 == len(again) - 1
    assert stages.count("rival") == 1 + RivalConfig().early_frames  # hopeless after so many
    assert {"skin", "associate", "solve"} <= set(stages)


def test_a_rejected_start_leaves_the_body_as_it_was(scene):
    depth = np.zeros((scene.camera.height, scene.camera.width), dtype=np.float32)
    depth[60:200, 110:210] = 2.5  # a board, as tall as a person but no person
    tracker = Tracker()
    assert tracker.step(scene.frame(depth)).status == "initialising"
    assert len(tracker.human.shape) == 0


def test_after_a_rejected_start_the_next_attempt_waits(scene, monkeypatch):
    depth = np.zeros((scene.camera.height, scene.camera.width), dtype=np.float32)
    depth[60:200, 110:210] = 2.5
    attempts = []
    monkeypatch.setattr(
        "kintrack.tracker.found_by", lambda *given: attempts.append(0) or found_by(*given)
    )
    tracker = Tracker()
    times = [0.0, 0.1, 0.4, 0.6, 0.7]
    frames = [replace(scene.frame(depth, n), timestamp_s=t) for n, t in enumerate(times)]
    counts = []
    for frame in frames:
        assert tracker.step(frame).status == "initialising"
        counts.append(len(attempts))
    assert counts == [1, 1, 1, 2, 2]


def test_nobody_in_view_does_not_delay_the_start(scene, quick):
    tracker = Tracker(quick)
    assert tracker.step(scene.room(0)).status == "initialising"
    found = tracker.step(scene.frame(scene.depth(scene.place(), wall_m=4.5), 1))
    assert found.status == "tracking"

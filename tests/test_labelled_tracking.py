# SPDX-License-Identifier: Apache-2.0
"""The tracker behind a segmenter: clutter, occluders, and segmenters that fail."""

from dataclasses import replace

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import SegmenterError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.joints import JOINT_NAMES
from kintrack.raster import rasterise
from kintrack.skin import skinned_vertices
from kintrack.tracker import Tracker

FRAMES = 14
BEHIND_M, BOX_M = 3.4, 1.9
LEGS = [JOINT_NAMES.index(f"{s}_{name}") for s in "lr" for name in ("knee", "ankle", "foot")]
FEET = [JOINT_NAMES.index(f"{s}_{name}") for s in "lr" for name in ("ankle", "foot")]
UPPER = [JOINT_NAMES.index(name) for name in ("head", "chest", "l_shoulder", "r_elbow")]


class Fixed:
    """Label maps by frame number."""

    def __init__(self, maps):
        self.maps = maps

    def segment(self, frame, region=None):
        return self.maps[frame.index]


class Constant:
    def __init__(self, label):
        self.label = label

    def segment(self, frame, region=None):
        return np.full(frame.depth_m.shape, self.label, dtype=np.uint8)


class Between:
    """Another segmenter from one frame number up to another."""

    def __init__(self, usual, other, first, last=10**9):
        self.usual, self.other, self.span = usual, other, range(first, last)

    def segment(self, frame, region=None):
        return (self.other if frame.index in self.span else self.usual).segment(frame, region)


def pose(scene, index):
    return scene.place({"r_elbow_flexion": 20 + 3 * index}, at=(2.8, 0.01 * index, 0.0))


def filmed(scene, index, box_rows=None):
    """Depth of the person before a wall, behind a box if rows are given, and true labels."""
    q = pose(scene, index)
    skin = scene.human.skin
    vertices = skinned_vertices(run_kinematics(scene.human.body, q), skin)
    camera_points = transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), vertices)
    depth, face = rasterise(camera_points, skin.faces, scene.camera)
    labels = np.where(face >= 0, skin.labels[skin.faces[face, 0]], 0).astype(np.uint8)
    depth = np.where(face >= 0, depth, BEHIND_M).astype(np.float32)
    if box_rows is not None:
        depth[box_rows, 60:260], labels[box_rows, 60:260] = BOX_M, 0
    return scene.frame(depth, index), labels


@pytest.fixture(scope="module")
def film(scene):
    """From the fourth frame on a box stands before the legs."""
    clips = [filmed(scene, i, slice(150, 240) if i >= 3 else None) for i in range(FRAMES)]
    return [frame for frame, _ in clips], [labels for _, labels in clips]


def followed(scene, film, config, segmenter):
    """Results from frame 1 on, begun at the true joints of frame 0."""
    tracker = Tracker(config, segmenter=segmenter)
    tracker.begin(film[0][0], scene.joints(pose(scene, 0)))
    return tracker, [tracker.step(frame) for frame in film[0][1:]]


@pytest.fixture(scope="module")
def gated(scene, film, unsized):
    return followed(scene, film, unsized, Fixed(film[1]))


def errors(scene, results):
    return np.array(
        [
            scene.errors(pose(scene, i + 1), r.joint_positions_camera_m)
            for i, r in enumerate(results)
        ]
    )


def test_a_wall_and_a_box_do_not_attract_a_labelled_person(scene, gated):
    _, results = gated
    assert all(r.status == "tracking" for r in results)
    assert errors(scene, results)[:, UPPER].mean() < 0.02


def test_hidden_legs_stay_near_where_they_were(scene, gated):
    """What is usual draws them, too."""
    _, results = gated
    assert errors(scene, results)[-1, LEGS].max() < 0.08


def test_hidden_joints_are_reported_as_not_seen_and_soon_as_sure_as_what_is_usual(gated):
    _, results = gated
    spread = np.array([np.trace(r.joint_covariances_m2[LEGS[1]]) for r in results])
    assert spread[3:].min() > 2 * spread[:2].mean()
    assert results[-1].joint_visible[FEET].max() < 0.1
    assert results[-1].joint_visible[UPPER].min() > 0.5


def test_a_true_joint_lies_within_its_ellipsoid_hidden_or_not(scene, gated):
    _, results = gated
    for i, r in enumerate(results):
        d = r.joint_positions_camera_m - scene.joints(pose(scene, i + 1))
        squared = np.einsum("ji,jik,jk->j", d, np.linalg.inv(r.joint_covariances_m2), d)
        assert (squared < 7.815).mean() > 0.9


def test_the_same_frames_give_the_same_bytes(scene, film, unsized, gated):
    _, again = followed(scene, film, unsized, Fixed(film[1]))
    for one, other in zip(gated[1], again, strict=True):
        assert one.q.tobytes() == other.q.tobytes()
        assert one.joint_covariances_m2.tobytes() == other.joint_covariances_m2.tobytes()


def test_a_person_wholly_hidden_is_coasted_and_then_lost(scene, film, unsized):
    segmenter = Between(Fixed(film[1]), Constant(0), FRAMES)
    tracker, results = followed(scene, film, unsized, segmenter)
    patience = tracker.labelled.lifecycle.patience
    after = [
        tracker.step(replace(film[0][-1], index=FRAMES + i, timestamp_s=(FRAMES + i) / 30))
        for i in range(patience)
    ]
    assert [r.status for r in after[:-1]] == ["tracking"] * (patience - 1)
    assert np.isfinite(after[0].q).all() and (after[0].joint_visible == 0).all()
    grown = np.trace(after[0].joint_covariances_m2, axis1=1, axis2=2)
    assert (grown[UPPER] > np.trace(results[-1].joint_covariances_m2[UPPER], 0, 1, 2)).all()
    assert after[-1].status == "lost" and tracker.belief is None


@pytest.mark.parametrize("label", [1, 2, 6])
def test_with_a_segmenter_stuck_on_one_part_the_body_is_followed_or_given_up(
    scene, film, unsized, label
):
    segmenter = Between(Fixed(film[1]), Constant(label), 1)
    _, results = followed(scene, (film[0][:8], film[1]), unsized, segmenter)
    assert {r.status for r in results} <= {"tracking", "lost", "initialising"}
    for index, result in enumerate(results, start=1):
        if result.status == "tracking":
            assert scene.errors(pose(scene, index), result.joint_positions_camera_m).mean() < 0.1


@pytest.mark.parametrize("label", [0, 2, 6])
def test_a_segmenter_stuck_from_the_first_frame_on_begins_nothing(film, unsized, label):
    tracker = Tracker(unsized, segmenter=Constant(label))
    for frame in film[0][:3]:
        result = tracker.step(frame)
        assert result.status == "initialising" and result.reason


def test_labels_that_contradict_the_depth_are_survived(scene, film, unsized):
    noise = np.random.default_rng(0)
    maps = [noise.integers(0, 7, (96, 128)).astype(np.uint8) for _ in range(FRAMES)]
    segmenter = Between(Fixed(film[1]), Fixed(maps), 1, 5)
    tracker, results = followed(scene, film, unsized, segmenter)
    assert {r.status for r in results} <= {"tracking", "lost", "initialising"}
    off = [scene.errors(pose(scene, i + 1), r.joint_positions_camera_m) for i, r in
           enumerate(results)]  # fmt: skip
    assert all(o.mean() < 0.1 for o, r in zip(off, results, strict=True) if r.status == "tracking")
    assert results[-1].status == "tracking" and off[-1][UPPER].mean() < 0.03


def test_a_depth_of_nan_is_a_hole_for_the_network_too(scene, film, unsized):
    pytest.importorskip("openvino")
    from segmentation.tracking import image_segmenter

    depth = film[0][0].depth_m.copy()
    depth[:, :40], depth[0, -1] = np.nan, -1.0
    spoilt = replace(film[0][0], depth_m=depth)
    empty = replace(film[0][0], depth_m=np.full_like(depth, np.nan))
    tracker = Tracker(unsized, segmenter=image_segmenter())
    assert tracker.step(empty).status == "skipped"
    assert tracker.step(spoilt).status in ("initialising", "tracking")


def test_a_map_of_the_wrong_size_is_named(scene, film, unsized):
    tracker = Tracker(unsized, segmenter=Fixed([np.zeros((106, 128), np.uint8)] * FRAMES))
    with pytest.raises(SegmenterError, match="128 x 106"):
        tracker.step(film[0][0])


def test_a_stream_whose_camera_changes_is_followed_on(scene, film, unsized):
    frames = [
        replace(frame, camera=frame.camera.scaled(2), depth_m=frame.depth_m[::2, ::2])
        if frame.index > 2
        else frame
        for frame in film[0]
    ]
    _, results = followed(scene, (frames, film[1]), unsized, Fixed(film[1]))
    assert all(r.status == "tracking" for r in results)
    assert errors(scene, results)[:, UPPER].mean() < 0.03

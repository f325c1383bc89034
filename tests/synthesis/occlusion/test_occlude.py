# SPDX-License-Identifier: Apache-2.0
import json

import numpy as np
import pytest

from kintrack.errors import ResultError, SceneError
from kintrack.geometry import PinholeCamera
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import read_reference_joints
from kintrack.sequence.write import SequenceWriter
from synthesis.mesh import Material, mesh_of
from synthesis.objects.catalogue import THINGS
from synthesis.occlusion.occlude import FACTS_FILE, OccludeConfig, occlude
from synthesis.occlusion.placing import TOLERANCE, PlacingConfig
from synthesis.occlusion.sensing import sensor_for

CAMERA = PinholeCamera(320, 240, 285.6, 285.6, 160.0, 120.0)
JOINTS = ("pelvis", "head", "l_hand")
FRAMES = 4


def a_person(n, depth_m=2.8):
    """A standing slab that sways by a pixel a frame."""
    depth = np.zeros((240, 320), np.float32)
    depth[40:215, 130 + n : 190 + n] = depth_m
    return depth


def recording(folder, *, labels=False, color=False, background=0.0):
    writer = SequenceWriter(folder, CAMERA, joint_names=JOINTS)
    joints = np.array([[0.0, 0.1, 2.9], [0.0, -0.7, 2.9], [0.28, 0.2, 2.9]])
    for n in range(FRAMES):
        person = a_person(n)
        depth = np.where(person > 0, person, background).astype(np.float32)
        writer.write(
            n / 30,
            depth,
            labels=np.where(person > 0, 2, 0).astype(np.uint8) if labels else None,
            color=np.full((240, 320, 3), 200, np.uint8) if color else None,
            joint_positions_m=joints,
        )
    return open_sequence(folder)


@pytest.fixture(scope="module")
def box():
    return THINGS["box"](np.random.default_rng(0))


@pytest.fixture(scope="module")
def occluded(tmp_path_factory, box):
    folder = tmp_path_factory.mktemp("occlude")
    clean = recording(folder / "clean", labels=True, color=True)
    config = OccludeConfig(PlacingConfig(0.45, 0.4))
    written = occlude(clean, folder / "out", box, config=config)
    return clean, open_sequence(folder / "out"), written


def test_the_wanted_share_is_hidden_in_the_frames_too(occluded):
    _, out, written = occluded
    shares, _ = read_occlusion(out.root / OCCLUSION_FILE)
    assert written.frames == len(shares) == FRAMES
    assert np.mean(shares) == pytest.approx(0.4, abs=2 * TOLERANCE)
    assert written.hidden_share == pytest.approx(np.mean(shares), abs=1e-4)


def test_depth_is_the_nearer_of_both_and_labels_follow(occluded):
    clean, out, _ = occluded
    for before, after in zip(clean, out, strict=True):
        changed = np.abs(after.depth_m - before.depth_m) > 1e-4
        inserted = changed & (after.depth_m > 0)
        assert changed.mean() > 0.02
        assert np.all(after.depth_m[inserted] < 2.8 - 0.45 + 0.05)
        assert np.array_equal(after.depth_m[~changed], before.depth_m[~changed])
        hidden = (before.labels > 0) & (after.labels == 0)
        assert 0.3 < hidden.sum() / (before.labels > 0).sum() < 0.5
        assert np.mean(changed[hidden]) > 0.98
        assert not np.any((before.labels == 0) & (after.labels > 0))


def test_color_changes_where_the_object_is_and_nowhere_else(occluded):
    clean, out, _ = occluded
    before, after = clean.frame(1), out.frame(1)
    unchanged = np.abs(after.depth_m - before.depth_m) < 1e-4
    difference = np.abs(after.color.astype(int) - before.color.astype(int)).max(axis=-1)
    assert np.mean(difference[unchanged] > 30) < 0.05
    assert difference.max() > 60


def test_truth_is_kept_and_hidden_joints_are_named(occluded):
    clean, out, _ = occluded
    names, joints = read_reference_joints(out.root / "reference_joints.csv")
    assert names == JOINTS
    assert np.allclose(joints, read_reference_joints(clean.root / "reference_joints.csv")[1])
    _, hidden = read_occlusion(out.root / OCCLUSION_FILE)
    for n, frame in enumerate(out):
        for j, name in enumerate(JOINTS):
            u, v = np.rint(CAMERA.project(joints[n, j])).astype(int)
            covered = 0 < frame.depth_m[v, u] < 2.7
            if frame.depth_m[v, u] > 0:
                assert hidden[n, JOINT_NAMES.index(name)] == covered


def test_equal_seeds_write_equal_bytes_and_others_do_not(occluded, tmp_path, box):
    clean, out, _ = occluded
    for name, seed in (("same", 0), ("other", 1)):
        config = OccludeConfig(PlacingConfig(0.45, 0.4), seed=seed)
        occlude(clean, tmp_path / name, box, config=config)
    first = (out.root / "depth/000002.png").read_bytes()
    assert (tmp_path / "same" / "depth/000002.png").read_bytes() == first
    assert (tmp_path / "other" / "depth/000002.png").read_bytes() != first


def test_a_scene_surrounds_a_person_without_background(tmp_path):
    clean = recording(tmp_path / "clean")
    wall = [[-4.0, -3.0, 2.0], [4.0, -3.0, 2.0], [4.0, 3.0, 2.0], [-4.0, 3.0, 2.0]]
    scene = mesh_of(
        np.array(wall),
        np.array([[0, 2, 1], [0, 3, 2]]),
        Material(lambda coords: np.full((len(coords), 3), 0.5)),
    )
    written = occlude(clean, tmp_path / "out", None, scene)
    facts = json.loads((tmp_path / "out" / FACTS_FILE).read_text())
    assert facts["scene_scale"] * 2.0 > 2.8
    assert written.hidden_share == 0.0
    depth = open_sequence(tmp_path / "out").frame(0).depth_m
    assert np.all(depth > 0)
    assert np.allclose(depth[a_person(0) > 0], 2.8)


def test_bad_frames_are_left_out_and_counted(tmp_path, box):
    clean = recording(tmp_path / "clean")
    (tmp_path / "clean" / "depth" / "000001.png").write_bytes(b"no image")
    written = occlude(clean, tmp_path / "out", box)
    assert (written.frames, written.skipped) == (FRAMES - 1, 1)
    assert len(open_sequence(tmp_path / "out")) == FRAMES - 1


def test_an_unknown_person_nothing_to_insert_and_a_full_folder_are_errors(tmp_path, box):
    unlabelled = recording(tmp_path / "room", background=4.0)
    with pytest.raises(SceneError, match="kintrack label"):
        occlude(unlabelled, tmp_path / "a", box)
    clean = recording(tmp_path / "clean")
    with pytest.raises(SceneError, match="nothing to insert"):
        occlude(clean, tmp_path / "b", None)
    with pytest.raises(ResultError, match="not empty"):
        occlude(clean, tmp_path / "room", box)
    assert not (tmp_path / "a").exists() and not (tmp_path / "b").exists()


def test_the_sensor_is_told_by_the_image_size_or_by_name():
    assert type(sensor_for("auto", CAMERA)).__name__ == "KinectV1"
    assert sensor_for("auto", CAMERA).camera == CAMERA
    assert type(sensor_for("perfect", CAMERA)).__name__ == "Perfect"
    with pytest.raises(SceneError, match="kinect_v2"):
        sensor_for("kinect", CAMERA)
    with pytest.raises(SceneError, match="auto, kinect_v1"):
        OccludeConfig(sensor="kinect")

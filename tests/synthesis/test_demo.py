# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

import kintrack
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import open_sequence
from kintrack.sequence.reference import read_reference_joints
from synthesis import demo
from synthesis.film import film
from synthesis.motions.scripts import demo as demo_script
from synthesis.sensors.catalogue import SENSORS

SHIPPED = Path(kintrack.__file__).parent / "demo"
CAMERA = SENSORS["kinect_v1_320"]().camera
TRUNK = [JOINT_NAMES.index(name) for name in ("pelvis", "spine", "chest", "neck")]


@pytest.fixture(scope="module")
def exposures():
    sensor = SENSORS["perfect"]().with_camera(CAMERA)
    scene = replace(demo.demo_scene(sensor, np.random.default_rng(0)), stride=6)
    return list(film(scene, np.random.default_rng(0)))


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Two short demos with one seed and one with another."""
    folders = [tmp_path_factory.mktemp("demo") for _ in range(3)]
    script = replace(demo_script(), duration_s=0.4)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "demo", lambda: script)
        for folder, seed in zip(folders, (0, 0, 1), strict=True):
            demo.write_demo_sequence(folder, seed)
    return folders


def _bytes(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_the_same_seed_writes_the_same_bytes(short):
    assert _bytes(short[0]) == _bytes(short[1])


def test_another_seed_writes_other_depth(short):
    assert _bytes(short[0])["depth/000003.png"] != _bytes(short[2])["depth/000003.png"]


def test_the_shipped_sequence_is_what_the_command_writes(short):
    assert (short[0] / "camera.json").read_text() == (SHIPPED / "camera.json").read_text()
    for name in ("depth/000003.png", "labels/000003.png"):
        expected, shipped = (cv2.imread(str(f / name), -1) for f in (short[0], SHIPPED))
        assert np.mean(expected != shipped) < 1e-3


def test_truth_covers_the_same_pixels_as_depth_before_noise(exposures):
    for exposure in exposures:
        assert np.array_equal(exposure.labels > 0, exposure.true_depth_m > 0)


def test_trunk_joints_lie_inside_the_silhouette_and_behind_the_surface(exposures):
    for exposure in exposures:
        joints = exposure.joint_positions_camera_m[TRUNK]
        u, v = np.rint(CAMERA.project(joints)).astype(int).T
        assert np.all(exposure.labels[v, u] > 0)
        assert np.all(exposure.true_depth_m[v, u] < joints[:, 2])


def test_the_person_stays_in_the_picture(exposures):
    for exposure in exposures:
        seen = exposure.labels > 0
        assert not (seen[[0, -1]].any() or seen[:, [0, -1]].any())


def test_the_shipped_sequence_reads_and_is_small():
    sequence = open_sequence(SHIPPED)
    names, positions = read_reference_joints(SHIPPED / "reference_joints.csv")
    assert len(sequence) == len(positions) == 150
    assert names == JOINT_NAMES
    frames = [sequence.frame(n) for n in (0, 75, 149)]
    assert all(frame.problem is None and frame.labels is not None for frame in frames)
    assert sum(len(data) for data in _bytes(SHIPPED).values()) < 3e6

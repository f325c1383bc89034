# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import ConfigError
from kintrack.joints import JOINT_NAMES
from kintrack.tracker import Tracker


@pytest.fixture(scope="module")
def turned(scene):
    """A person who turns her back and lifts an arm: no start finds her by itself."""
    return scene.place({"l_shoulder_elevation": 70, "elbow_flexion": 60}, heading_deg=150)


def test_rough_joints_start_a_person_who_turns_her_back(scene, quick, turned):
    rng = np.random.default_rng(0)
    rough = scene.joints(turned) + rng.normal(0, 0.03, (len(JOINT_NAMES), 3))
    result = Tracker(quick).begin(scene.frame(scene.depth(turned)), rough)
    assert result.status == "tracking"
    assert scene.errors(turned, result.joint_positions_camera_m).mean() < 0.025


def test_tracking_goes_on_from_there(scene, quick, turned):
    tracker = Tracker(quick)
    tracker.begin(scene.frame(scene.depth(turned)), scene.joints(turned))
    result = tracker.step(scene.frame(scene.depth(turned, wall_m=4.5), 1))
    assert result.status == "tracking"
    assert scene.errors(turned, result.joint_positions_camera_m).mean() < 0.025


def test_unknown_limbs_are_left_to_the_surface(scene, quick):
    q = scene.place()
    joints = scene.joints(q)
    for name in ("pelvis", "l_wrist", "l_hand", "r_knee", "r_ankle", "r_foot", "head"):
        joints[JOINT_NAMES.index(name)] = np.nan
    result = Tracker(quick).begin(scene.frame(scene.depth(q)), joints)
    assert scene.errors(q, result.joint_positions_camera_m).mean() < 0.02


def test_hips_and_shoulders_are_needed(scene, quick):
    q = scene.place()
    joints = scene.joints(q)
    joints[JOINT_NAMES.index("l_hip")] = np.nan
    with pytest.raises(ConfigError, match="l_hip"):
        Tracker(quick).begin(scene.frame(scene.depth(q)), joints)


def test_a_bad_frame_and_nobody_there_start_nothing(scene, quick):
    joints = scene.joints(scene.place())
    tracker = Tracker(quick)
    assert tracker.begin(scene.frame(None), joints).status == "skipped"
    empty = np.zeros((scene.camera.height, scene.camera.width), dtype=np.float32)
    assert tracker.begin(scene.frame(empty), joints).status == "initialising"
    assert tracker.belief is None

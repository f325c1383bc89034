# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.errors import SceneError
from kintrack.geometry import invert_rigid, transform_points
from kintrack.joints import JOINT_NAMES
from synthesis.film import film
from synthesis.render.filming import ASIDE_RAD, CLEAR_M, film_from
from synthesis.scene import build_scene
from synthesis.sensors.catalogue import SENSORS
from synthesis.takes import Take

TAKE = Take(
    name="a",
    part="train",
    seed=(3, 1),
    person=12,
    action="reaching",
    sensor="perfect",
    frames=4,
    stride=2,
    barrier=True,
)


@pytest.fixture(scope="module")
def scene():
    return build_scene(TAKE)


@pytest.fixture(scope="module")
def exposures(scene):
    return list(film(scene, np.random.default_rng(0)))


def test_a_take_has_its_length_and_every_stride_is_one_frame(exposures):
    assert len(exposures) == TAKE.frames
    assert np.allclose(np.diff([e.timestamp_s for e in exposures]), TAKE.stride / 30.0)


def test_a_perfect_sensor_shows_the_truth(exposures):
    for exposure in exposures:
        assert np.array_equal(exposure.depth_m, exposure.true_depth_m)
        assert np.all(exposure.true_depth_m[exposure.labels > 0] > 0)


def test_joints_in_sight_lie_just_behind_the_person_and_hidden_ones_behind_something(
    scene, exposures
):
    camera = scene.sensor.camera
    hidden = seen = 0
    for exposure in exposures:
        for j, joint in enumerate(exposure.joint_positions_camera_m):
            u, v = np.rint(camera.project(joint)).astype(int)
            if not (0 <= u < camera.width and 0 <= v < camera.height):
                continue
            label, depth = exposure.labels[v, u], exposure.true_depth_m[v, u]
            if exposure.hidden_joints[j]:
                hidden += 1
                assert label == 0 and depth < joint[2]
            elif label > 0 and JOINT_NAMES[j] in ("pelvis", "spine", "chest", "neck"):
                seen += 1
                assert -0.02 < joint[2] - depth < 0.45
    assert hidden > 0 and seen > 0


def test_the_hidden_share_is_what_the_barrier_takes_from_the_person(scene, exposures):
    alone = list(film(replace(scene, fixed=None), np.random.default_rng(0)))
    for with_barrier, without in zip(exposures, alone, strict=True):
        lost = 1.0 - (with_barrier.labels > 0).sum() / (without.labels > 0).sum()
        assert with_barrier.hidden_share == pytest.approx(lost, abs=0.03)
        assert without.hidden_share < 0.01
    assert 0.05 < exposures[0].hidden_share < 0.8


def test_the_same_take_gives_the_same_pixels(scene, exposures):
    again = list(film(build_scene(TAKE), np.random.default_rng(0)))
    for first, second in zip(exposures, again, strict=True):
        assert np.array_equal(first.depth_m, second.depth_m)
        assert np.array_equal(first.color, second.color)
        assert np.array_equal(first.labels, second.labels)


def test_unknown_sensors_and_actions_are_named():
    with pytest.raises(SceneError, match="kinect_v1"):
        build_scene(replace(TAKE, sensor="lidar"))
    with pytest.raises(SceneError, match="reaching"):
        build_scene(replace(TAKE, action="flying"))


def walk():
    path = np.linspace(-0.8, 0.8, 30)
    joints = np.random.default_rng(0).uniform([-0.3, -0.3, 0], [0.3, 0.3, 1.7], (21, 3))
    return joints + np.stack([path, 0 * path, 0 * path], axis=1)[:, None]


@pytest.mark.parametrize("moving", [False, True])
def test_a_camera_has_the_whole_person_in_view_from_a_distance(moving):
    camera = SENSORS["kinect_v2"]().camera
    joints = walk()
    for seed in range(4):
        Ts = film_from(joints, camera, np.random.default_rng(seed), moving=moving)
        assert np.allclose(Ts[0], Ts[-1]) != moving
        points = np.stack(
            [transform_points(invert_rigid(T), x) for T, x in zip(Ts, joints, strict=True)]
        )
        u, v = np.moveaxis(camera.project(points), -1, 0)
        inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
        assert inside.mean() > 0.96
        assert np.linalg.norm(points, axis=-1).min() > CLEAR_M - 0.35


def test_a_camera_that_is_faced_stands_before_the_person():
    camera = SENSORS["kinect_v2"]().camera
    for seed in range(6):
        T = film_from(walk(), camera, np.random.default_rng(seed), facing_rad=1.0)[0]
        from_middle = T[:2, 3] - walk().mean(axis=(0, 1))[:2]
        turned = np.arctan2(from_middle[1], from_middle[0]) - 1.0
        assert abs(np.arctan2(np.sin(turned), np.cos(turned))) < ASIDE_RAD + 0.1


def test_a_truncated_person_is_in_view_in_part():
    camera = SENSORS["kinect_v2"]().camera
    Ts = film_from(walk(), camera, np.random.default_rng(1), truncated=True)
    points = transform_points(invert_rigid(Ts[0]), walk())
    u, v = np.moveaxis(camera.project(np.maximum(points, [-9, -9, 0.2])), -1, 0)
    inside = (u >= 0) & (u < camera.width) & (v >= 0) & (v < camera.height)
    assert 0.3 < inside.mean() < 0.95


def test_a_motion_that_fits_no_image_is_named():
    far = walk() * [200.0, 1.0, 1.0]
    with pytest.raises(SceneError, match="no camera found"):
        film_from(far, SENSORS["kinect_v2"]().camera, np.random.default_rng(0))

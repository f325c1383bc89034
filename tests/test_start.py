# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.clothing import dressed_human
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, camera_pose, invert_rigid, transform_points
from kintrack.human import SITTING_DEG
from kintrack.judge import acceptable
from kintrack.skin import skinned_vertices
from kintrack.start import find_person, sized, start
from kintrack.tracker import Tracker

STANDING_TALL = {"knee_flexion": 0.0}


def seen(scene, depth_m):
    return observe(scene.frame(depth_m.astype(np.float32)), 320)


def plane(scene, z_m, width_m=np.inf, height_m=np.inf, at_x_m=0.0):
    """Depth of an upright rectangle that faces the camera."""
    points = scene.camera.back_project(np.full((scene.camera.height, scene.camera.width), z_m))
    inside = np.abs(points[..., 0] - at_x_m) < width_m / 2
    return np.where(inside & (np.abs(points[..., 1]) < height_m / 2), z_m, 0.0)


def nearest(*depths):
    stack = np.stack([np.where(depth > 0, depth, np.inf) for depth in depths]).min(axis=0)
    return np.where(np.isfinite(stack), stack, 0.0)


@pytest.mark.parametrize(
    ("degrees", "heading_deg", "at"),
    [
        (STANDING_TALL, 0.0, (2.8, 0.0, 0.0)),
        ({"elbow_flexion": 60}, 35.0, (3.2, -0.4, 0.1)),
        ({"shoulder_elevation": 25}, -35.0, (2.4, 0.3, -0.1)),
        (SITTING_DEG, 0.0, (2.8, 0.0, -0.3)),
    ],
    ids=["upright", "turned right", "turned left", "sitting"],
)
def test_a_person_is_found_from_several_headings_and_postures(
    scene, unsized, degrees, heading_deg, at
):
    q = scene.place(degrees, heading_deg, at)
    found = start(scene.human, seen(scene, scene.depth(q)), T_LEVEL_WORLD_CAMERA, unsized)
    assert found is not None
    assert acceptable(found.agreed, found.fit.surface.rms_m, unsized.judge)
    errors = scene.errors(q, scene.joints(found.fit.state.q))
    assert errors.mean() < 0.03
    true_chest = run_kinematics(scene.human.body, q).Ts_world_link[2, :3, 0]
    assert found.fit.state.Ts_world_link[2, :3, 0] @ true_chest > np.cos(np.radians(25))


def test_a_camera_that_looks_down_finds_the_same_person(scene, unsized):
    q = scene.place(STANDING_TALL)
    T_world_camera = camera_pose(15.0)
    found = start(scene.human, seen(scene, scene.depth(q)), T_world_camera, unsized)
    positions = transform_points(
        invert_rigid(T_world_camera), found.fit.state.joint_positions_world
    )
    assert scene.errors(q, positions).mean() < 0.03


def test_the_mask_holds_the_person_and_nothing_else(scene, unsized):
    body_m = scene.depth(scene.place())
    depth = nearest(body_m, plane(scene, 4.5))
    mask = find_person(seen(scene, depth), T_LEVEL_WORLD_CAMERA, unsized.start)
    assert not mask[body_m == 0].any()
    assert mask[body_m > 0].mean() > 0.9


def test_of_two_people_the_nearer_is_taken(scene, unsized):
    near = scene.depth(scene.place(at=(2.5, 0.6, 0.0)))
    far = scene.depth(scene.place(at=(3.6, -0.7, 0.0)))
    mask = find_person(seen(scene, nearest(far, near)), T_LEVEL_WORLD_CAMERA, unsized.start)
    assert mask[near > 0].mean() > 0.9
    assert not mask[(far > 0) & (near == 0)].any()


@pytest.mark.parametrize("wall_m", [0.8, 2.5, 4.0, 5.5])
def test_a_wall_is_nobody(scene, unsized, wall_m):
    observation = seen(scene, plane(scene, wall_m))
    assert start(scene.human, observation, T_LEVEL_WORLD_CAMERA, unsized) is None


def test_small_and_far_things_are_nobody(scene, unsized):
    for depth in (
        plane(scene, 2.0, width_m=0.4, height_m=0.4),
        plane(scene, 2.0, width_m=0.1, height_m=1.5),
        plane(scene, 8.0, width_m=0.6, height_m=1.7),
    ):
        assert start(scene.human, seen(scene, depth), T_LEVEL_WORLD_CAMERA, unsized) is None


@pytest.mark.parametrize(
    ("width_m", "height_m", "z_m"), [(0.9, 2.0, 2.8), (2.0, 1.9, 2.9)], ids=["door", "board"]
)
def test_a_flat_thing_of_human_height_is_not_tracked(scene, quick, width_m, height_m, z_m):
    frame = scene.frame(plane(scene, z_m, width_m, height_m).astype(np.float32))
    assert Tracker(quick).step(frame).status == "initialising"


@pytest.mark.parametrize("value", [0.0, np.nan])
def test_an_empty_image_holds_nobody(scene, unsized, value):
    shape = (scene.camera.height, scene.camera.width)
    observation = seen(scene, np.full(shape, value))
    assert find_person(observation, T_LEVEL_WORLD_CAMERA, unsized.start) is None
    assert start(scene.human, observation, T_LEVEL_WORLD_CAMERA, unsized) is None


def test_nobody_smaller_than_wanted_is_found(scene, unsized):
    observation = seen(scene, scene.depth(scene.place()))
    giants = replace(unsized.start, min_height_m=2.1, max_height_m=3.0)
    assert find_person(observation, T_LEVEL_WORLD_CAMERA, unsized.start) is not None
    assert find_person(observation, T_LEVEL_WORLD_CAMERA, giants) is None


def test_a_tall_person_is_measured_within_four_centimetres(scene):

    config = TrackerConfig()
    person = dressed_human(np.array([1.5, 0.0]))
    q = scene.place(STANDING_TALL, at=(3.0, 0.0, 0.0))
    observation = seen(scene, scene.depth(q, person))
    begun = start(scene.human, observation, T_LEVEL_WORLD_CAMERA, config)
    measured, refitted = sized(scene.human, begun, T_LEVEL_WORLD_CAMERA, config)
    assert stature(measured) == pytest.approx(stature(person), abs=0.04)
    assert stature(person) - stature(scene.human) > 0.1
    assert len(measured.shape) == config.start.shape_coefficients
    assert measured.clothing_m == scene.human.clothing_m != {}
    assert np.abs(measured.shape).max() <= config.start.shape_limit + 1e-9
    errors = np.linalg.norm(
        scene.joints(refitted.fit.state.q, measured) - scene.joints(q, person), axis=1
    )
    assert errors.mean() < 0.03


def stature(human):
    state = run_kinematics(human.body, human.body.neutral())
    return np.ptp(skinned_vertices(state, human.skin)[:, 2])

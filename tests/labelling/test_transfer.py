# SPDX-License-Identifier: Apache-2.0
"""Pixels take the label of the skin they lie on, and of no other."""

import time

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import ConfigError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, PinholeCamera, invert_rigid, transform_points
from kintrack.labelling.measures import coverage, share_outside
from kintrack.labelling.transfer import TransferConfig, transfer_labels, visible_skin
from kintrack.skin import skinned_vertices

ARM_FORWARD = {"r_shoulder_elevation": 70.0, "r_shoulder_plane": 70.0}


@pytest.fixture(scope="module")
def fitted(scene):
    """A function: skin vertices in the camera frame for a pose."""

    def vertices(degrees=None, shift=(0.0, 0.0, 0.0)):
        q = scene.place(degrees)
        world = skinned_vertices(run_kinematics(scene.human.body, q), scene.human.skin)
        return transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), world) + np.array(shift)

    return vertices


def labelled(scene, vertices, depth, foreground=None, room=None, config=None):
    skin = visible_skin(scene.human.skin, vertices, scene.camera)
    read = depth > 0
    return transfer_labels(
        depth,
        read if foreground is None else foreground,
        np.zeros_like(read) if room is None else room,
        skin,
        scene.camera,
        config or TransferConfig(),
    )


@pytest.mark.parametrize("degrees", [{}, ARM_FORWARD], ids=["at rest", "arm before the torso"])
def test_a_perfect_fit_gives_the_labels_of_the_skin(scene, fitted, degrees):
    vertices = fitted(degrees)
    depth = scene.depth(scene.place(degrees))
    found = labelled(scene, vertices, depth)
    assert (found.labels[depth > 0] > 0).all()
    assert (found.labels == found.skin.labels).mean() > 0.999
    assert set(np.unique(found.labels)) == set(range(7))


def test_a_shifted_fit_still_labels_the_arm_before_the_torso_by_its_depth(scene, fitted):
    truth = labelled(scene, fitted(ARM_FORWARD), scene.depth(scene.place(ARM_FORWARD))).labels
    depth = scene.depth(scene.place(ARM_FORWARD))
    found = labelled(scene, fitted(ARM_FORWARD, (0.02, 0.0, 0.0)), depth)
    raster = found.skin.labels
    on = truth > 0
    assert (found.labels[on] == truth[on]).mean() > (raster[on] == truth[on]).mean()
    assert (found.labels[on] == truth[on]).mean() > 0.93


def test_clothes_within_the_tolerance_are_the_persons_and_a_bag_behind_it_is_not(scene, fitted):
    depth = scene.depth(scene.place())
    cloth = np.where(depth > 0, depth - 0.05, 0).astype(np.float32)
    assert (labelled(scene, fitted(), cloth).labels[cloth > 0] > 0).mean() > 0.95
    bag = np.where(depth > 0, depth - 0.2, 0).astype(np.float32)
    assert (labelled(scene, fitted(), bag).labels[bag > 0] > 0).mean() < 0.05


def test_pixels_of_the_room_never_take_a_label(scene, fitted):
    depth = scene.depth(scene.place())
    room = np.zeros(depth.shape, dtype=bool)
    room[180:] = True
    found = labelled(scene, fitted(), depth, room=room)
    assert found.labels[room].max() == 0
    assert found.labels[100:140].max() > 0


def test_pixels_outside_the_foreground_need_to_lie_closer(scene, fitted):
    depth = scene.depth(scene.place())
    cloth = np.where(depth > 0, depth - 0.06, 0).astype(np.float32)
    nothing = np.zeros(depth.shape, dtype=bool)
    found = labelled(scene, fitted(), cloth, foreground=nothing)
    assert (found.labels[cloth > 0] > 0).mean() < 0.5
    assert not found.explained.any()


def test_a_hole_amid_one_part_is_filled_and_one_beside_the_person_is_not(scene, fitted):
    depth = scene.depth(scene.place())
    whole = labelled(scene, fitted(), depth).labels
    row, column = (int(np.median(axis)) for axis in np.nonzero(whole == 2))
    depth[row - 1 : row + 2, column - 1 : column + 2] = 0
    found = labelled(scene, fitted(), depth)
    assert (found.labels[row - 1 : row + 2, column - 1 : column + 2] == 2).all()
    assert found.labels[depth == 0].astype(bool).sum() < 60
    assert labelled(scene, fitted(), depth, config=TransferConfig(hole_radius_px=0)).labels[
        row, column
    ] == 0  # fmt: skip


def test_a_limb_elsewhere_shows_as_unexplained_foreground_and_unsupported_skin(scene, fitted):
    depth = scene.depth(scene.place({"l_shoulder_elevation": 90.0}))
    read = depth > 0
    wrong = coverage(labelled(scene, fitted(), depth), depth, read, scene.camera, True)
    right = coverage(
        labelled(scene, fitted({"l_shoulder_elevation": 90.0}), depth),
        depth,
        read,
        scene.camera,
        True,
    )
    assert right.unexplained_m2 < 0.001 and right.unsupported_m2 < 0.001
    assert wrong.unexplained_m2 > 0.02 and wrong.unsupported_m2 > 0.015
    assert wrong.explained < right.explained


def test_skin_without_depth_counts_as_unread_where_the_room_was_seen(scene, fitted):
    depth = scene.depth(scene.place(), wall_m=4.5)
    person = depth < 4.0
    depth[140:][person[140:]] = 0
    found = labelled(scene, fitted(), depth, foreground=person & (depth > 0))
    seen = coverage(found, depth, person & (depth > 0), scene.camera, empty_is_free=False)
    assert seen.unread > 0.25 and seen.unsupported_m2 < 0.01
    free = coverage(found, depth, person & (depth > 0), scene.camera, empty_is_free=True)
    assert free.unread == 0 and free.unsupported_m2 > 0.05


def test_a_body_half_outside_the_image_is_known_to_be(scene, fitted):
    assert share_outside(fitted(), scene.camera) == 0
    assert 0.3 < share_outside(fitted(shift=(1.55, 0, 0)), scene.camera) < 0.9


def test_a_kinect_v2_frame_takes_well_below_a_tenth_of_a_second(scene, fitted):
    camera = PinholeCamera(512, 424, 365.0, 365.0, 255.5, 211.5)
    skin = visible_skin(scene.human.skin, fitted(), camera)
    depth = skin.points_camera[..., 2]
    times = []
    for _ in range(3):
        began = time.perf_counter()
        transfer_labels(
            depth, depth > 0, np.zeros(depth.shape, bool), skin, camera, TransferConfig()
        )
        times.append(time.perf_counter() - began)
    assert min(times) < 0.1


def test_a_tolerance_below_zero_is_refused_with_the_range():
    with pytest.raises(ConfigError, match="outside_m = -1"):
        TransferConfig(outside_m=-1)

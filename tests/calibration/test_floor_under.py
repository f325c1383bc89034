# SPDX-License-Identifier: Apache-2.0
"""Somebody behind a table: only what is above her hips is seen, and the floor tells her height."""

import numpy as np
import pytest

from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.calibration.calibrator import Calibrator
from kintrack.calibration.measures import height
from kintrack.clothing import REGIONS, dressed_space
from kintrack.human import load_human
from kintrack.sequence.frame import Frame
from kintrack.shape import load_shape_space
from kintrack.skin import skinned_vertices

from .people import CAMERA, placed, seen

TALL = np.array([1.6, 0, 0, 0, 0, 0, 0, 0, 0, 0])
STANDING = (
    ({"shoulder_elevation": 40, "shoulder_plane": 50, "elbow_flexion": 80}, 25.0),
    ({"shoulder_elevation": 70, "elbow_flexion": 30}, 0.0),
    ({"spine_flexion": 10, "shoulder_elevation": 30, "elbow_flexion": 100}, -20.0),
)
TABLE_M, TABLE_TOP_M = 1.9, -0.05
"""How far before the camera the table stands, and its height in the level world frame."""


def ground(z_m):
    """Depth of a level floor at this height below the camera, 0 above the horizon."""
    v = np.arange(CAMERA.height)[:, None] - CAMERA.cy + np.zeros(CAMERA.width)
    with np.errstate(divide="ignore"):
        depth = np.where(v > 0, -z_m * CAMERA.fy / v, 0.0)
    return np.where(depth < 5.5, depth, 0.0)


def calibrated(floor):
    """Her height as estimated."""
    space = load_shape_space()
    body, dressed = space.body(TALL), dressed_space(space)
    skin = dressed.bound(np.concatenate([TALL, np.full(len(REGIONS), 0.012)]))
    template = load_human()
    calibrator = Calibrator(template)
    for n, (degrees, heading) in enumerate(STANDING):
        q = placed(body, degrees, heading)
        vertices = skinned_vertices(run_kinematics(body, q), skin)
        depth, labels = seen(vertices, skin.faces, skin.labels)
        floor_m = ground(vertices[:, 2].min())
        room = np.where(floor_m > 0, floor_m, 5.0) if floor else np.zeros_like(floor_m)
        depth = np.where(labels > 0, depth, room).astype(np.float32)
        rows = np.arange(CAMERA.height)[:, None]
        table = (rows > CAMERA.cy - TABLE_TOP_M * CAMERA.fy / TABLE_M) & (labels > 0)
        depth, labels = np.where(table, np.float32(TABLE_M), depth), np.where(table, 0, labels)
        frame = Frame(n, 0.1 * n, CAMERA, depth)
        calibrator.add(n, observe(frame, 320, labels=labels.astype(np.uint8)), q)
    return calibrator.result().height


@pytest.fixture(scope="module")
def with_floor():
    return calibrated(True)


def test_the_floor_tells_how_tall_she_is(with_floor):
    assert abs(with_floor.value_m - height(TALL)[0]) < 0.02


def test_without_it_her_height_is_known_less_well(with_floor):
    without = calibrated(False)
    assert with_floor.sigma_m < 0.7 * without.sigma_m
    assert abs(with_floor.value_m - height(TALL)[0]) < abs(without.value_m - height(TALL)[0])

# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.floor import Floor, Ground, find_floor, soles_of
from kintrack.floor_config import ContactConfig, FloorConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.residuals.contact import Contact, contact_residual
from kintrack.skin import skinned_vertices
from kintrack.solver.gauss_newton import solve
from kintrack.tracker import Tracker
from labelled_people import board, labelled

CONFIG = FloorConfig()
BOTH = np.ones(2, dtype=bool)


def plane(scene, height_m, tilt_deg=0.0, until_m=5.0):
    """Depth of a plane so far below a level camera, rising away from it by an angle."""
    rows = np.arange(scene.camera.height)
    down = (rows - scene.camera.cy) / scene.camera.fy + np.tan(np.radians(tilt_deg))
    z = np.where(down > 1e-3, height_m / np.maximum(down, 1e-3), 0.0)
    return np.tile(np.where(z < until_m, z, 0.0)[:, None], scene.camera.width)


def lowest_m(scene, q):
    state = run_kinematics(scene.human.body, q)
    return float(skinned_vertices(state, scene.human.skin)[:, 2].min())


def soles_at(scene, q):
    state = run_kinematics(scene.human.body, q)
    return skinned_vertices(state, scene.human.skin)[soles_of(scene.human)]


@pytest.mark.parametrize("tilt_deg", [0.0, 12.0, -3.0])
def test_a_floor_is_found_where_it_is_level_or_not(scene, tilt_deg):
    q = scene.place()
    seen = labelled(scene, q, things=[plane(scene, 1.1, tilt_deg)])
    floor = find_floor(seen, T_LEVEL_WORLD_CAMERA, CONFIG.tilt_deg)
    assert floor is not None
    assert np.degrees(np.arccos(floor.normal[2])) == pytest.approx(abs(tilt_deg), abs=0.5)
    assert floor.height_m == pytest.approx(-1.1 * np.cos(np.radians(tilt_deg)), abs=0.01)


def test_a_pitched_camera_sees_the_same_floor(scene):
    seen = labelled(scene, things=[plane(scene, 1.1, 10.0)])
    floor = find_floor(seen, camera_pose(10.0), 5.0)
    assert floor is not None and floor.normal[2] > np.cos(np.radians(1.0))


def test_noise_moves_it_by_millimetres(scene):
    rng = np.random.default_rng(0)
    thing = plane(scene, 1.1)
    thing += (thing > 0) * rng.normal(0.0, 0.01, thing.shape)
    floor = find_floor(labelled(scene, things=[thing]), T_LEVEL_WORLD_CAMERA, CONFIG.tilt_deg)
    assert floor is not None and floor.height_m == pytest.approx(-1.1, abs=0.015)


def test_walls_tables_and_people_are_no_floor(scene):
    assert find_floor(labelled(scene, scene.place()), T_LEVEL_WORLD_CAMERA, 25.0) is None
    table = plane(scene, 0.5, until_m=1.6)
    table[:, :100] = 0.0
    both = labelled(scene, scene.place(), things=[plane(scene, 1.1), table])
    floor = find_floor(both, T_LEVEL_WORLD_CAMERA, 25.0)
    assert floor is not None and floor.height_m == pytest.approx(-1.1, abs=0.01)
    seen = labelled(scene, scene.place(), things=[plane(scene, 1.1)])
    nobody = np.ones_like(seen.labels)
    assert find_floor(replace(seen, labels=nobody), T_LEVEL_WORLD_CAMERA, 25.0) is None
    assert find_floor(replace(seen, labels=None), T_LEVEL_WORLD_CAMERA, 25.0) is None


def test_a_plane_on_which_nobody_stands_is_not_taken_and_an_old_one_forgotten(scene):
    q = scene.place()
    soles, low = soles_at(scene, q), lowest_m(scene, q)
    on = labelled(scene, q, things=[plane(scene, -low)])
    above = labelled(scene, q, things=[plane(scene, -low - 0.3)])
    blank = labelled(scene, q)
    T = T_LEVEL_WORLD_CAMERA
    assert Ground().looked(above, T, soles, 0.0, CONFIG).floor is None
    ground = Ground().looked(on, T, soles, 0.0, CONFIG)
    assert ground.floor is not None and not ground.due(0.1, CONFIG) and ground.due(0.6, CONFIG)
    assert ground.looked(blank, T, soles, 1.0, CONFIG).floor is ground.floor
    assert ground.looked(blank, T, soles, 4.0, CONFIG).floor is None
    # a stream that begins anew
    assert ground.due(-5.0, CONFIG) and ground.looked(blank, T, soles, -5.0, CONFIG).floor is None


def test_soles_lie_under_the_feet_heel_and_toes(scene):
    for side, sole in zip("lr", soles_at(scene, scene.place()), strict=True):
        state = run_kinematics(scene.human.body, scene.place())
        foot = state.joint_positions_world[JOINT_NAMES.index(f"{side}_foot")]
        ankle = state.joint_positions_world[JOINT_NAMES.index(f"{side}_ankle")]
        assert np.ptp(sole[:, 2]) < 0.02 and (sole[:, 2] < min(foot[2], ankle[2])).all()
        assert np.ptp(sole[:, 0]) > 0.15
        assert np.abs(sole[:, 1] - foot[1]).max() < 0.1


@pytest.mark.parametrize("off_m", [-0.1, 0.1])
def test_feet_come_to_the_floor_the_sooner_if_they_are_below_it(scene, off_m):
    body, skin, soles = scene.human.body, scene.human.skin, soles_of(scene.human)
    state = run_kinematics(body, scene.place({"knee_flexion": 40, "hip_flexion": 30}))
    heights = skinned_vertices(state, skin)[soles][..., 2]
    floor = Floor(np.array([0.0, 0.0, 1.0]), float(heights.mean() - off_m))
    term = contact_residual(
        skin, Contact(floor, soles, BOTH), skinned_vertices(state, skin), ContactConfig()
    )
    solution = solve(body, state, [term], 30, 1e-3)
    after = floor.above_m(skinned_vertices(solution.state, skin)[soles].reshape(-1, 3))
    assert np.abs(after).max() < 0.5 * abs(off_m)
    sunk = Floor(floor.normal, float(heights.mean() + abs(off_m)))
    below = contact_residual(
        skin, Contact(sunk, soles, BOTH), skinned_vertices(state, skin), ContactConfig()
    )
    assert off_m < 0 or below.cost(state) > 4 * term.cost(state)


class Given:
    """Labels of the frame at hand."""

    name, labels = "given", None

    def segment(self, frame, region=None):
        return self.labels


@pytest.fixture(scope="module")
def squatting(scene):
    """How far from the floor the lowest skin comes of somebody who sinks behind a board, if the
    floor was seen before, and if it never was [m]."""

    def above(with_floor):
        given, low = Given(), lowest_m(scene, scene.place())
        tracker = Tracker(human=scene.human, segmenter=given)
        floor = [plane(scene, -low)] if with_floor else []
        off = []
        before = board(scene, 2.2, (0, 10_000), (scene.camera.height * 4 // 9, 10_000))
        for n in range(40):
            bend = min(n, 25) * 1.8
            q = scene.place({"hip_flexion": bend, "knee_flexion": 2 * bend})
            q[2] += low - lowest_m(scene, q)
            seen = labelled(scene, q, things=[*floor, before] if n > 2 else floor)
            given.labels = seen.labels
            result = tracker.step(scene.frame(seen.points_camera[..., 2].astype(np.float32), n))
            assert result.status == "tracking"
            off.append(abs(lowest_m(scene, result.q) - low))
        return max(off)

    return above(True), above(False)


def test_hidden_feet_of_somebody_who_squats_stay_on_the_floor(squatting):
    with_floor, without = squatting
    assert with_floor < 0.06 and without > 0.15

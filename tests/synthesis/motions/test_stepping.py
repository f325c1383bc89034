# SPDX-License-Identifier: Apache-2.0
from itertools import pairwise

import numpy as np
import pytest

from synthesis.motions.footwork import Gait, Stance
from synthesis.motions.holding import frame_path
from synthesis.motions.motion import Script, perform
from synthesis.motions.poses import keys
from synthesis.motions.stepping import steps_along, steps_aside, steps_turning

ARC = 2.0 * np.column_stack(
    [np.sin(np.linspace(0.0, 1.2, 60)), 1.0 - np.cos(np.linspace(0.0, 1.2, 60))]
)
"""70 degrees of a circle of 2 m to the left."""


@pytest.fixture(scope="module")
def curved(person):
    steps = steps_along(person, ARC, 0.3, 0.55, 0.5)
    gait = Gait(follow_s=0.17, heel_off_deg=50.0, roll_s=0.3, glide=0.8)
    return steps, perform(person, Script(steps[-1].end_s + 0.5, keys(), steps, gait=gait))


def test_steps_alternate_in_time_and_none_is_longer_than_told(curved):
    steps, _ = curved
    assert all(a.side != b.side and a.end_s < b.start_s for a, b in pairwise(steps))
    places = np.array([[s.forward_m, s.left_m] for s in steps])
    assert np.linalg.norm(places[2:] - places[:-2], axis=1).max() < 2 * 0.55 * 1.1


def test_feet_pelvis_and_heading_follow_a_curve(person, curved):
    _, motion = curved
    pelvis, end = frame_path(person, motion, "pelvis"), np.degrees(1.2)
    assert abs(np.degrees(np.arctan2(pelvis[-1, 1, 0], pelvis[-1, 0, 0])) - end) < 2.0
    start = pelvis[0, :2, 3]
    off = [np.linalg.norm(ARC - (p - start), axis=1).min() for p in pelvis[:, :2, 3]]
    assert max(off) < 0.08
    assert np.linalg.norm(pelvis[-1, :2, 3] - ARC[-1]) < 0.05
    feet = [frame_path(person, motion, f"{side}_foot")[-1] for side in "lr"]
    apart = feet[0][:2, 3] - feet[1][:2, 3]
    assert abs(apart @ pelvis[-1, :2, 0]) < 0.02


def test_the_pelvis_rises_and_falls_as_walkers_do(curved):
    height = curved[1].q[30:-40, 2]
    assert 0.015 < np.ptp(height) < 0.08


@pytest.mark.parametrize("to_deg", [180.0, -180.0, 360.0])
def test_a_turn_on_the_spot_ends_where_it_began(person, to_deg):
    steps = steps_turning(person, 0.0, to_deg, 0.2, 0.5, 65.0)
    assert steps[0].side == ("l" if to_deg > 0 else "r")
    motion = perform(person, Script(steps[-1].end_s + 0.6, keys(), steps))
    pelvis = frame_path(person, motion, "pelvis")
    yaw = np.degrees(np.unwrap(np.arctan2(pelvis[:, 1, 0], pelvis[:, 0, 0])))
    assert abs(yaw[-1] - to_deg) < 2.0
    assert np.linalg.norm(pelvis[-1, :2, 3] - pelvis[0, :2, 3]) < 0.06


def test_a_step_aside_moves_both_feet_as_the_person_looks(person):
    first, second = steps_aside(person, (-0.2, 0.0), 0.0, 0.1, 0.5)
    assert {first.side, second.side} == {"l", "r"}
    assert first.forward_m == pytest.approx(-0.2) and second.forward_m == pytest.approx(-0.2)


def test_a_path_without_length_needs_no_step(person):
    assert steps_along(person, np.zeros((3, 2)), 0.0, 0.5, 0.5) == ()
    assert steps_turning(person, 30.0, 30.0, 0.0, 0.5) == ()


def test_a_raised_heel_turns_the_foot_over_its_toe(person):
    raised = {"l_heel": ((0.0, 0.0), (0.5, 25.0)), "pelvis_drop": ((0.0, 0.1),)}
    motion = perform(person, Script(1.0, {**keys(), **raised}))
    foot = frame_path(person, motion, "l_foot")
    toe = foot[:, :3, :3] @ person.toe["l"] + foot[:, :3, 3]
    heel = foot[:, :3, :3] @ person.heel["l"] + foot[:, :3, 3]
    assert np.ptp(toe[:, :2], axis=0).max() < 0.001 and heel[-1, 2] - heel[0, 2] > 0.07
    assert motion.planted["r"].all() and not motion.planted["l"][-1]


def test_a_stance_sets_the_feet(person):
    stance = Stance(narrower_m=-0.1, toe_out_deg=(20.0, 0.0), left_ahead_m=0.1)
    motion = perform(person, Script(0.2, keys(), stance=stance))
    left, right = (frame_path(person, motion, f"{side}_foot")[0] for side in "lr")
    assert left[0, 3] - right[0, 3] == pytest.approx(0.1, abs=0.002)
    assert left[1, 3] - right[1, 3] > 0.3
    assert np.degrees(np.arctan2(left[1, 0], left[0, 0])) == pytest.approx(20.0, abs=0.1)

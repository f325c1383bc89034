# SPDX-License-Identifier: Apache-2.0
import numpy as np

from kintrack.body import run_kinematics
from kintrack.skin import skinned_vertices
from synthesis.people.person import CLOTH_MAX_M, CLOTH_MIN_M, dressed


def _thickness(person):
    clothed = dressed(person, np.random.default_rng(1))
    state = run_kinematics(person.body, person.body.neutral())
    moved = skinned_vertices(state, clothed.skin) - skinned_vertices(state, person.skin)
    return np.linalg.norm(moved, axis=1)


def test_clothes_are_five_to_fifteen_millimetres_thick_on_the_thighs(person):
    link = person.skin.link_names.index("l_thigh")
    thigh = (person.skin.weights * (person.skin.links == link)).sum(axis=1) > 0.99
    thickness = _thickness(person)[thigh]
    assert thickness.min() > CLOTH_MIN_M - 1e-6 and thickness.max() < CLOTH_MAX_M + 1e-6
    assert np.ptp(thickness) > 1e-3


def test_clothes_leave_head_hands_and_feet_bare(person):
    bare = [person.skin.link_names.index(name) for name in ("head", "l_hand", "r_foot")]
    covered = (person.skin.weights * ~np.isin(person.skin.links, bare)).sum(axis=1) > 0
    assert np.all(_thickness(person)[~covered] < 1e-9)


def test_clothes_have_no_steps(person):
    thickness = _thickness(person)
    a, b = person.skin.faces[:, 0], person.skin.faces[:, 1]
    assert np.percentile(np.abs(thickness[a] - thickness[b]), 99) < 3e-3


def test_a_sole_runs_from_heel_to_toe(person):
    for side in "lr":
        assert 0.20 < person.toe[side][0] - person.heel[side][0] < 0.32

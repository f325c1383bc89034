# SPDX-License-Identifier: Apache-2.0
from dataclasses import fields

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import ConfigError
from kintrack.human import load_human
from kintrack.solver.nlp import programme
from kintrack.solver.nlp_terms import Parameters, bonds, parameters
from kintrack.solver.symbolic_body import tree_of
from residual_terms import SQUARES, motion_prior, pose_prior, surface

ca = pytest.importorskip("casadi")
STEP = 1e-5


@pytest.fixture(scope="module")
def build():
    """A function (state, terms): the programme and the numbers of its inputs after the step."""

    def made(state, terms):
        together = bonds(terms, len(state.body.link_names))
        given = parameters(state, terms, together)
        rows = tuple(map(tuple, together.tolist()))
        made = programme(tree_of(state.body), rows, given.places.shape[1], 60)
        at = [getattr(given, field.name) for field in fields(Parameters)]
        place = made.cost.name_in().index("surface_Q")
        at[place - 1] = ca.DM(made.cost.sparsity_in(place), at[place - 1])
        return made, given, at

    return made


def moved(made, given, state, step):
    """The state after a step."""
    q = np.array(made.kinematics(step, given.q, given.origins_m)[0]).ravel()
    q[:3] += state.q[:3]
    return run_kinematics(state.body, q)


def all_terms(human, state, rng):
    return [kind(human, state, rng) for kind in SQUARES]


@pytest.mark.parametrize("kind", SQUARES, ids=lambda kind: kind.__name__)
def test_the_cost_of_every_term_is_that_of_its_residual(build, human, legal_pose, kind):
    for seed in range(3):
        state, rng = run_kinematics(human.body, legal_pose(seed)), np.random.default_rng(seed)
        term = kind(human, state, rng)
        made, given, at = build(state, [term])
        for step in (np.zeros(48), rng.normal(0, 0.3, 48)):
            expected = term.cost(moved(made, given, state, step))
            assert float(made.cost(step, *at)) == pytest.approx(expected, rel=1e-7, abs=1e-7)


def test_terms_add_up_however_many_there_are(build, human, legal_pose):
    state, rng = run_kinematics(human.body, legal_pose(3)), np.random.default_rng(3)
    terms = [*all_terms(human, state, rng), *all_terms(human, state, rng)]
    made, given, at = build(state, terms)
    assert given.places.shape == (7, 2)
    step = rng.normal(0, 0.1, 48)
    reached = moved(made, given, state, step)
    expected = sum(term.cost(reached) for term in terms)
    assert float(made.cost(step, *at)) == pytest.approx(expected, rel=1e-8)


def test_slope_and_curvature_agree_with_differences(build, human, legal_pose):
    state, rng = run_kinematics(human.body, legal_pose(4)), np.random.default_rng(4)
    made, _, at = build(state, all_terms(human, state, rng))
    x = rng.normal(0, 0.1, 48)
    steps = STEP * np.eye(48)

    def slope(x):
        return np.array(made.slope(x, *at)[1]).ravel()

    numeric = [float(made.cost(x + d, *at)) - float(made.cost(x - d, *at)) for d in steps]
    assert np.allclose(slope(x), np.array(numeric) / (2 * STEP), atol=1e-6 * np.abs(slope(x)).max())
    upper = np.array(made.curvature(x, *at))
    numeric = np.array([slope(x + d) - slope(x - d) for d in steps]) / (2 * STEP)
    assert np.allclose(upper, np.triu(numeric), atol=1e-6 * np.abs(upper).max())


def test_the_slope_where_the_step_starts_is_that_of_gauss_newton(build, human, legal_pose):
    state, rng = run_kinematics(human.body, legal_pose(5)), np.random.default_rng(5)
    terms = all_terms(human, state, rng)
    made, _, at = build(state, terms)
    expected = sum(term.quadratic(state).g for term in terms)
    slope = np.array(made.slope(0, *at)[1]).ravel()
    assert np.allclose(slope, expected, atol=1e-7 * np.abs(expected).max())


def test_a_person_a_kilometre_away_costs_what_her_residuals_say(build, human, legal_pose):
    q = legal_pose(6)
    q[0] += 1000.0
    state, rng = run_kinematics(human.body, q), np.random.default_rng(6)
    terms = all_terms(human, state, rng)
    made, given, at = build(state, terms)
    step = rng.normal(0, 0.1, 48)
    reached = moved(made, given, state, step)
    expected = sum(term.cost(reached) for term in terms)
    assert float(made.cost(step, *at)) == pytest.approx(expected, rel=1e-7)


def test_people_of_all_sizes_share_one_programme(build, human, legal_pose):
    tall = load_human(shape=np.array([2.0]))
    programmes = []
    for person in (human, tall):
        state = run_kinematics(person.body, legal_pose(7))
        term = surface(person, state, np.random.default_rng(7))
        made, given, at = build(state, [term])
        step = np.full(48, 0.05)
        expected = term.cost(moved(made, given, state, step))
        assert float(made.cost(step, *at)) == pytest.approx(expected, rel=1e-8)
        programmes.append(made)
    assert programmes[0] is programmes[1]


def test_pairs_of_no_weight_and_no_terms_at_all_cost_nothing(build, body, legal_pose):
    made, _, at = build(run_kinematics(body, legal_pose(8)), [])
    assert float(made.cost(0.1, *at)) == 0.0


def test_expected_places_are_only_kept_of_priors_that_know_the_root(human, legal_pose):
    state, rng = run_kinematics(human.body, legal_pose(9)), np.random.default_rng(9)
    together = bonds([], 21)
    for kinds, places in (
        ((pose_prior,), 1),
        ((pose_prior, motion_prior), 1),
        ((motion_prior,) * 3, 3),
    ):
        terms = [kind(human, state, rng) for kind in kinds]
        assert parameters(state, terms, together).places.shape == (7, places)


def test_a_term_of_another_kind_is_refused_by_name(body, legal_pose):
    class Curious:
        pass

    with pytest.raises(ConfigError, match="Curious.*SurfaceResidual"):
        parameters(run_kinematics(body, legal_pose(0)), [Curious()], bonds([], 21))

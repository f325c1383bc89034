# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.belief import rest_priors
from kintrack.body import run_kinematics
from kintrack.errors import ModelError
from kintrack.human import RESTING_DEG, SITTING_DEG, leg_hinges, posed, prior_sigma
from kintrack.objective_config import PriorConfig
from kintrack.residuals.pose_prior import PRIOR_FILE, hinge_names, load_leg_prior
from synthesis.motions.habits import mirrored

CONFIG = PriorConfig()


@pytest.fixture(scope="module")
def prior(body):
    return load_leg_prior(body, CONFIG)


@pytest.fixture(scope="module")
def names(body):
    return tuple(np.array(hinge_names(body))[leg_hinges(body)[6:]])


def angle(body, q, hinge):
    return np.degrees(q[body.dof(hinge) + 1])


def test_what_ships_is_a_mixture_within_the_limits(body, prior):
    assert prior.weights.sum() == pytest.approx(1.0) and (prior.weights > 0).all()
    assert np.linalg.eigvalsh(prior.covariances_rad2).min() >= CONFIG.floor_rad**2
    assert (prior.means_rad >= body.lower[prior.hinges] - 0.05).all()
    assert (prior.means_rad <= body.upper[prior.hinges] + 0.05).all()


def test_a_posture_and_its_mirror_image_are_as_likely(body, prior, names, legal_pose):
    for seed in range(5):
        q = legal_pose(seed)
        turned = q.copy()
        turned[prior.hinges + 1] = mirrored(q[None, prior.hinges + 1], names)[0]
        here, there = (prior.near(x).cost(run_kinematics(body, x)) for x in (q, turned))
        assert here == pytest.approx(there, rel=1e-6)


@pytest.mark.parametrize(
    ("degrees", "least", "most"), [(SITTING_DEG, 60, 110), (RESTING_DEG, 0, 30)]
)
def test_who_sits_is_held_to_sitting_and_who_stands_to_standing(body, prior, degrees, least, most):
    target = prior.near(posed(body, degrees)).q0
    assert least < angle(body, target, "l_knee_flexion") < most
    assert least - 15 < angle(body, target, "r_hip_flexion") < most


def test_a_hidden_leg_is_held_as_the_seen_one_says_however_it_was_taken_to_be(body, prior):
    sitting, standing = posed(body, SITTING_DEG), posed(body, RESTING_DEG)
    hidden = np.array([False] * 6 + [n.startswith("l_") for n in hinge_names(body)])
    hidden &= leg_hinges(body)
    q = np.where(np.r_[False, hidden], standing, sitting)
    assert angle(body, prior.near(q, hidden=hidden).q0, "l_knee_flexion") > 60
    nothing = prior.near(q, hidden=leg_hinges(body)).q0
    assert (nothing == prior.near(q).q0).all()


def test_all_but_the_legs_is_free(body, prior):
    q = posed(body, RESTING_DEG)
    moved = body.integrate(q, 0.3 * ~leg_hinges(body))
    costs = [prior.near(q).cost(run_kinematics(body, x)) for x in (q, moved)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


def test_a_component_costs_its_mahalanobis_distance(body, prior):
    q = posed(body, SITTING_DEG)
    term, legs = prior.near(q), prior.hinges + 1
    k = int(np.flatnonzero((prior.means_rad == term.q0[legs]).all(axis=1))[0])
    off = q[legs] - prior.means_rad[k]
    expected = 0.5 * off @ np.linalg.solve(prior.covariances_rad2[k], off)
    assert term.cost(run_kinematics(body, q)) == pytest.approx(expected, rel=1e-6)


def test_twice_the_doubt_costs_a_quarter(body, prior):
    q = posed(body, SITTING_DEG)
    surely, in_doubt = prior.near(q), prior.near(q, np.full(body.nv, 2.0))
    state = run_kinematics(body, posed(body, RESTING_DEG))
    assert in_doubt.cost(state) == pytest.approx(surely.cost(state) / 4)


def test_whoever_bends_a_hip_bends_the_knee(prior, names):
    hip, knee = (names.index(name) for name in ("l_hip_flexion", "l_knee_flexion"))
    off = prior.means_rad - prior.weights @ prior.means_rad
    spread = np.einsum("k,kij->ij", prior.weights,
                       prior.covariances_rad2 + off[:, :, None] * off[:, None])  # fmt: skip
    assert spread[hip, knee] > 0.5 * np.sqrt(spread[hip, hip] * spread[knee, knee])


def test_hidden_legs_are_held_hidden_arms_are_not_and_what_is_not_found_softly(body, prior):
    q, none, all_ = posed(body, SITTING_DEG), *(np.full(body.nv, x) for x in (False, True))

    def held(hinge, unseen, hidden):
        terms = rest_priors(
            prior,
            posed(body, RESTING_DEG),
            prior_sigma(body, CONFIG),
            q,
            unseen,
            hidden,
            25.0,
        )
        return sum((term.root @ term.root.T)[body.dof(hinge), body.dof(hinge)] for term in terms)

    for hinge in ("l_knee_flexion", "r_elbow_flexion"):
        assert held(hinge, none, none) == pytest.approx(CONFIG.limb_rad**-2)
        assert held(hinge, all_, none) == pytest.approx(CONFIG.limb_rad**-2 / 25.0)
    for unseen in (none, all_):
        assert held("r_elbow_flexion", unseen, all_) == 0
        root = prior.near(q).root
        knee = body.dof("l_knee_flexion")
        assert held("l_knee_flexion", unseen, all_) == pytest.approx((root @ root.T)[knee, knee])


def test_a_broken_file_and_other_hinges_are_named(body, tmp_path, model_folder):
    with pytest.raises(ModelError, match=PRIOR_FILE):
        load_leg_prior(body, CONFIG, tmp_path)
    with np.load(model_folder / PRIOR_FILE) as file:
        arrays = dict(file)
    arrays["hinge_names"] = arrays["hinge_names"][::-1]
    np.savez(tmp_path / PRIOR_FILE, **arrays)
    with pytest.raises(ModelError, match="is of the hinges r_ankle_inversion"):
        load_leg_prior(body, CONFIG, tmp_path)

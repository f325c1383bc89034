# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kintrack.belief import rest_priors
from kintrack.body import leg_length, run_kinematics
from kintrack.errors import ModelError
from kintrack.human import RESTING_DEG, SITTING_DEG, leg_hinges, posed, prior_sigma
from kintrack.objective_config import PriorConfig
from kintrack.residuals.pose_prior import (
    PRIOR_FILE,
    STANCE,
    hinge_names,
    load_leg_prior,
    stance_of,
)
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
    n, means = len(STANCE), prior.means[:, len(STANCE) :]
    assert prior.weights.sum() == pytest.approx(1.0) and (prior.weights > 0).all()
    assert np.linalg.eigvalsh(prior.covariances[:, n:, n:]).min() >= CONFIG.floor_rad**2
    assert (means >= body.lower[prior.hinges] - 0.05).all()
    assert (means <= body.upper[prior.hinges] + 0.05).all()


def test_a_posture_and_its_mirror_image_are_as_likely(body, prior, names, legal_pose):
    for seed in range(5):
        q, here = legal_pose(seed), np.array([0.1, 0.2, 3.0])
        turned = q.copy()
        turned[prior.hinges + 1] = mirrored(q[None, prior.hinges + 1], names)[0]
        costs = [
            prior.near(x, stance=stance).cost(run_kinematics(body, x))
            for x, stance in ((q, here), (turned, here * [1, -1, 1]))
        ]
        assert costs[0] == pytest.approx(costs[1], rel=1e-6)


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
    ankles_only = hidden & np.array([False] * 6 + ["ankle" in n for n in hinge_names(body)])
    assert (prior.near(q, hidden=ankles_only).q0 == prior.near(q).q0).all()


def test_all_but_the_legs_is_free(body, prior):
    q = posed(body, RESTING_DEG)
    moved = body.integrate(q, 0.3 * ~leg_hinges(body))
    costs = [prior.near(q).cost(run_kinematics(body, x)) for x in (q, moved)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


LOW, HIGH = np.array([-0.2, 0.0, 1.9]), np.array([0.0, 0.0, 3.3])


def hips_in_world(body, stance_degrees, height_m):
    """Q of a standing body with its pelvis pitched and rolled, at a height."""
    q = posed(body, RESTING_DEG)
    q[:3] = 1.0, 2.0, height_m
    q[3:7] = Rotation.from_euler("ZYX", (70.0, *stance_degrees), degrees=True).as_quat()
    return q


def test_a_stance_is_up_in_the_pelvis_and_its_height_in_thirds_of_a_leg(body):
    up, leg_m = np.array([0.0, 0.0, 1.0]), leg_length(body)
    pitched = stance_of(hips_in_world(body, (30.0, 0.0), 1.0), leg_m, up, 0.2)
    assert pitched == pytest.approx([-0.5, 0.0, 3 * 0.8 / leg_m])
    rolled = stance_of(hips_in_world(body, (0.0, 30.0), 1.0), leg_m, up, np.nan)
    assert rolled[:2] == pytest.approx([0.0, 0.5]) and np.isnan(rolled[2])
    q = np.stack([hips_in_world(body, (10.0, 20.0), z) for z in (0.5, 1.0)])
    each = np.stack([stance_of(x, leg_m, up, 0.0) for x in q])
    assert stance_of(q, leg_m, up, 0.0) == pytest.approx(each)
    assert 0.7 < leg_m < 0.95


def test_hidden_legs_bend_if_the_pelvis_is_low_and_are_straight_if_it_is_high(body, prior):
    hidden = leg_hinges(body)
    for q in (posed(body, RESTING_DEG), posed(body, SITTING_DEG)):
        low = prior.near(q, hidden=hidden, stance=LOW).q0
        high = prior.near(q, hidden=hidden, stance=HIGH).q0
        assert angle(body, low, "l_knee_flexion") > 60 > 25 > angle(body, high, "l_knee_flexion")
        assert angle(body, low, "r_hip_flexion") > 60 > 25 > angle(body, high, "r_hip_flexion")


def test_the_more_is_known_of_the_stance_the_surer_is_the_posture(body, prior):
    q, hidden = posed(body, RESTING_DEG), leg_hinges(body)
    stances = (None, np.array([0.0, 0.0, np.nan]), HIGH)
    terms = [prior.near(q, hidden=hidden, stance=stance) for stance in stances]
    knee = body.dof("l_knee_flexion")
    sure = [(term.root @ term.root.T)[knee, knee] for term in terms]
    assert sure == sorted(sure) and sure[0] < sure[-1]
    unknown = prior.near(q, hidden=hidden, stance=np.full(3, np.nan))
    assert (unknown.q0 == terms[0].q0).all() and (unknown.root == terms[0].root).all()


def test_one_component_given_a_stance_is_its_regression(body, prior):
    one = replace(
        prior, weights=np.ones(1), means=prior.means[:1], covariances=prior.covariances[:1]
    )
    term, n = one.near(posed(body, RESTING_DEG), stance=LOW), len(STANCE)
    mu, S = prior.means[0], prior.covariances[0]
    mean = mu[n:] + S[n:, :n] @ np.linalg.solve(S[:n, :n], LOW - mu[:n])
    covariance = S[n:, n:] - S[n:, :n] @ np.linalg.solve(S[:n, :n], S[:n, n:])
    assert term.q0[prior.hinges + 1] == pytest.approx(mean)
    root = term.root[prior.hinges]
    assert np.linalg.inv(root @ root.T) == pytest.approx(covariance)


def test_the_mixture_given_what_is_known_agrees_with_samples_of_it(body, prior):
    """Rejection: of many samples, those near the stance have the term's mean and spread."""
    rng, near = np.random.default_rng(0), np.array([-0.1, 0.0, 2.6])
    counts = rng.multinomial(600_000, prior.weights)
    each = zip(prior.means, prior.covariances, counts, strict=True)
    samples = np.vstack([rng.multivariate_normal(*component) for component in each])
    kept = samples[(np.abs(samples[:, : len(STANCE)] - near) < 0.06).all(axis=1), len(STANCE) :]
    hidden = leg_hinges(body)
    term = prior.near(posed(body, RESTING_DEG), hidden=hidden, stance=near)
    root = term.root[prior.hinges]
    sigma = np.sqrt(np.diag(np.linalg.inv(root @ root.T)))
    assert len(kept) > 500
    assert np.abs(kept.mean(axis=0) - term.q0[prior.hinges + 1]).max() < 0.06
    assert kept.std(axis=0) == pytest.approx(sigma, rel=0.1)


def test_twice_the_doubt_costs_a_quarter(body, prior):
    q = posed(body, SITTING_DEG)
    surely, in_doubt = prior.near(q), prior.near(q, np.full(body.nv, 2.0))
    state = run_kinematics(body, posed(body, RESTING_DEG))
    assert in_doubt.cost(state) == pytest.approx(surely.cost(state) / 4)


def test_whoever_bends_a_hip_bends_the_knee(prior, names):
    hip, knee = (names.index(name) for name in ("l_hip_flexion", "l_knee_flexion"))
    n = len(STANCE)
    off = (prior.means - prior.weights @ prior.means)[:, n:]
    spread = np.einsum("k,kij->ij", prior.weights,
                       prior.covariances[:, n:, n:] + off[:, :, None] * off[:, None])  # fmt: skip
    assert spread[hip, knee] > 0.5 * np.sqrt(spread[hip, hip] * spread[knee, knee])


def test_lost_legs_are_held_hidden_arms_are_not_and_arms_that_are_not_found_softly(body, prior):
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
    assert held("r_elbow_flexion", all_, none) == pytest.approx(CONFIG.limb_rad**-2 / 25.0)
    root, knee = prior.near(q, hidden=all_).root, body.dof("l_knee_flexion")
    for unseen, hidden in ((none, all_), (all_, all_), (all_, none)):
        assert held("l_knee_flexion", unseen, hidden) == pytest.approx((root @ root.T)[knee, knee])
        assert hidden is none or held("r_elbow_flexion", unseen, hidden) == 0


def test_a_broken_file_and_other_hinges_are_named(body, tmp_path, model_folder):
    with pytest.raises(ModelError, match=PRIOR_FILE):
        load_leg_prior(body, CONFIG, tmp_path)
    with np.load(model_folder / PRIOR_FILE) as file:
        arrays = dict(file)
    arrays["names"] = arrays["names"][::-1]
    np.savez(tmp_path / PRIOR_FILE, **arrays)
    with pytest.raises(ModelError, match="is of r_ankle_inversion"):
        load_leg_prior(body, CONFIG, tmp_path)

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.belief import (
    angles,
    coasted,
    covariance_of,
    first,
    guessed_habit,
    predict,
    spread,
    updated,
)
from kintrack.human import RESTING_DEG, posed, prior_sigma
from kintrack.objective_config import MotionConfig, PriorConfig
from kintrack.residuals.pose_prior import load_leg_prior
from kintrack.residuals.prior import gaussian_prior

MOTION = MotionConfig()
DT_S = 1 / 30


@pytest.fixture(scope="module")
def sigma(body):
    return prior_sigma(body, PriorConfig())


@pytest.fixture
def belief(body, scene):
    return first(scene.place({"elbow_flexion": 40}), 1e-4 * np.eye(body.nv), 0.0)


def hinges(body, *names):
    out = np.zeros(body.nv, dtype=bool)
    out[[body.dof(name) for name in names]] = True
    return out


def test_a_hidden_hinge_is_less_sure_every_frame_but_never_worse_than_the_prior(
    body, belief, sigma
):
    knee = body.dof("l_knee_flexion")
    variances = []
    for i in range(300):
        belief = coasted(body, belief, (i + 1) * DT_S, MOTION, sigma)
        variances.append(belief.covariance[knee, knee])
    assert (np.diff(variances) > 0).all()
    assert variances[0] < 0.1 * sigma[knee] ** 2
    assert variances[-1] == pytest.approx(sigma[knee] ** 2, rel=0.01)


def test_an_arm_hidden_from_the_first_frame_on_goes_to_rest_and_a_leg_stays(body, scene):
    q = scene.place({"l_elbow_flexion": 90, "l_knee_flexion": 80, "r_elbow_flexion": 70})
    resting, legs = posed(body, RESTING_DEG), load_leg_prior(body, PriorConfig())
    hidden = hinges(body, "l_elbow_flexion", "l_knee_flexion")
    habit = guessed_habit(q, resting, hidden, legs)
    elbow, knee, seen = (
        body.dof(n) for n in ("l_elbow_flexion", "l_knee_flexion", "r_elbow_flexion")
    )
    assert habit[elbow] == angles(resting)[elbow] != angles(q)[elbow]
    assert habit[knee] == angles(q)[knee] and habit[seen] == angles(q)[seen]
    belief = first(q, 1e-4 * np.eye(body.nv), 0.0, hidden, habit)
    later = angles(predict(body, belief, 10.0, MOTION))
    assert later[elbow] == pytest.approx(habit[elbow], abs=1e-2)
    assert later[knee] == pytest.approx(angles(q)[knee])


def test_what_is_seen_says_nothing_about_a_hidden_hinge(body, belief, sigma):
    hidden = hinges(body, "l_knee_flexion")
    root = np.random.default_rng(0).normal(0, 0.1, (body.nv, body.nv))
    correlated = first(belief.q, root @ root.T, 0.0)
    covariance = spread(body, correlated, hidden, DT_S, MOTION, sigma)
    assert not covariance[np.ix_(hidden, ~hidden)].any()
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_a_moving_limb_that_hides_comes_to_rest_and_returns_to_its_habit(body, belief, sigma):
    knee = body.dof("l_knee_flexion")
    bent = body.integrate(belief.q, 0.2 * hinges(body, "l_knee_flexion"))
    none = np.zeros(body.nv, dtype=bool)
    moving = updated(body, belief, bent, belief.covariance, none, none, DT_S, MOTION)
    assert moving.velocity[knee] == pytest.approx(0.2 / DT_S)
    angles = []
    for i in range(150):
        moving = coasted(body, moving, (i + 2) * DT_S, MOTION, sigma)
        angles.append(moving.q[knee + 1])
    start = belief.q[knee + 1]
    assert max(angles) < start + 0.8
    assert abs(angles[-1] - start) < 0.03


def test_hidden_hinges_teach_no_habit_and_seen_ones_do(body, belief):
    moved = body.integrate(belief.q, 0.3 * hinges(body, "l_knee_flexion", "r_knee_flexion"))
    hidden = hinges(body, "l_knee_flexion")
    none = np.zeros(body.nv, dtype=bool)
    after = updated(body, belief, moved, belief.covariance, none, hidden, DT_S, MOTION)
    learnt = after.habit - belief.habit
    assert learnt[body.dof("l_knee_flexion")] == 0
    assert learnt[body.dof("r_knee_flexion")] == pytest.approx(0.3 * (1 - np.exp(-DT_S)), rel=1e-6)


def test_a_prediction_stays_within_the_limits(body, belief):
    fast = first(belief.q, belief.covariance, 0.0)
    fast.velocity[6:] = 500.0
    q = predict(body, fast, DT_S, MOTION)
    assert (q[7:] <= body.upper[6:]).all() and (q[7:] >= body.lower[6:]).all()


def test_a_direction_that_nothing_is_known_of_can_be_a_prior(body, belief):
    turned = np.linalg.qr(np.random.default_rng(0).normal(size=(body.nv, body.nv)))[0]
    known = np.geomspace(1e6, 1.0, body.nv)
    known[-1] = 0.0
    covariance = covariance_of(turned * known @ turned.T)
    assert np.sqrt(np.linalg.eigvalsh(covariance).max()) == pytest.approx(10.0, rel=1e-3)
    assert np.isfinite(gaussian_prior(belief.q, covariance).root).all()

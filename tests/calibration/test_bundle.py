# SPDX-License-Identifier: Apache-2.0
"""The blocks of a frame against finite differences, and the Schur complement against the whole."""

from dataclasses import replace

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.calibration import bundle
from kintrack.calibration.blocks import Blocks, Snapshot, blocks_of, surface_of
from kintrack.calibration.bundle import Gaussian, Measurement, solve_bundle
from kintrack.calibration.config import BundleConfig
from kintrack.clothing import (
    REGIONS,
    THICKEST_M,
    coverage,
    dressed_space,
    fold_sigma,
)
from kintrack.config import TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.human import RESTING_DEG, Human, load_human, posed, prior_sigma
from kintrack.residuals.prior import diagonal_prior
from kintrack.shape import load_shape_space

from .people import POSES, scene_of

TRACKER = TrackerConfig()
STEP = 1e-5


@pytest.fixture(scope="module")
def space():
    return dressed_space(load_shape_space())


@pytest.fixture(scope="module")
def folds():
    return fold_sigma(load_shape_space())


@pytest.fixture(scope="module")
def seen():
    return scene_of((0.5, -0.5), poses=POSES[:3])


def test_the_blocks_of_a_frame_agree_with_differences(space, folds, seen):
    """The cost with pairs and weights frozen, moved along every pose and shape direction."""
    b = np.concatenate([seen.shape, np.full(len(REGIONS), 0.015)])
    body = space.body(b)
    human = Human(body, space.bound(b), b)
    config, q = BundleConfig(), seen.qs_template[0]
    snapshot = Snapshot(seen.observations[0], q, T_LEVEL_WORLD_CAMERA)
    rest = diagonal_prior(posed(body, RESTING_DEG), prior_sigma(body, TRACKER.prior))
    frame = blocks_of(space, human, q, snapshot, rest, folds(b), 0.08, TRACKER, config)
    surface = surface_of(human, run_kinematics(body, q), snapshot, folds(b), 0.08, TRACKER, config)
    share = TRACKER.surface.correlation / config.correlation

    def cost(dv, db):
        moved = space.body(b + db)
        state = run_kinematics(moved, moved.integrate(q, dv))
        term = replace(surface, skin=space.bound(b + db))
        return term.cost(state) + share * rest.cost(state)

    none_v, none_b = np.zeros(body.nv), np.zeros(len(b))
    for k in range(0, body.nv, 3):
        step = STEP * np.eye(body.nv)[k]
        numeric = (cost(step, none_b) - cost(-step, none_b)) / (2 * STEP)
        assert frame.g_pose[k] == pytest.approx(numeric, rel=1e-4, abs=1e-2)
    for k in range(len(b)):
        step = STEP * np.eye(len(b))[k]
        numeric = (cost(none_v, step) - cost(none_v, -step)) / (2 * STEP)
        assert frame.g_shape[k] == pytest.approx(numeric, rel=1e-4, abs=1e-2)


def test_eliminating_the_poses_solves_the_whole_system():
    rng = np.random.default_rng(0)
    blocks, frames = [rng.normal(size=(20, 9)) for _ in range(3)], []
    H, g = np.zeros((15, 15)), np.zeros(15)
    H[12:, 12:] += np.eye(3)
    for i, rows in enumerate(blocks):
        A, r = rows[:, :7], rows[:, 7]
        own = slice(4 * i, 4 * i + 4)
        full = np.zeros((20, 15))
        full[:, own], full[:, 12:] = A[:, :4], A[:, 4:]
        H, g = H + full.T @ full, g + full.T @ r
        M, h = A.T @ A, A.T @ r
        frames.append(Blocks(M[:4, :4], h[:4], M[:4, 4:], M[4:, 4:], h[4:], rms_m=0.0, inliers=0))
    reduced, gradient = bundle._without_poses(np.eye(3), np.zeros(3), frames)
    assert np.allclose(np.linalg.solve(reduced, gradient), np.linalg.solve(H, g)[12:])
    assert np.allclose(np.linalg.inv(reduced), np.linalg.inv(H)[12:, 12:])


def test_bounds_hold_and_a_measurement_counts(space, folds, seen):
    k, r = len(space) - len(REGIONS), len(REGIONS)
    worn = np.array([region.mean_m for region in REGIONS])
    prior = Gaussian(
        np.concatenate([np.zeros(k), worn]),
        np.concatenate([np.ones(k), np.full(r, 0.02)]),
        np.concatenate([np.full(k, -0.1), np.zeros(r)]),
        np.concatenate([np.full(k, 0.1), np.full(r, THICKEST_M)]),
    )
    snapshots = [
        Snapshot(observation, q, T_LEVEL_WORLD_CAMERA)
        for observation, q in zip(seen.observations, seen.qs_template, strict=True)
    ]
    known = Measurement(np.eye(k + r)[2], 0.05, 1e-4)
    quick = BundleConfig(rounds=6)
    found = solve_bundle(space, snapshots, prior.mean, prior, folds, TRACKER, quick, [known])
    assert (found.b >= prior.lower).all() and (found.b <= prior.upper).all()
    assert found.b[0] == pytest.approx(0.1)  # she is taller than the bound allows
    assert found.b[2] == pytest.approx(0.05, abs=1e-3)
    body = load_human().body
    assert (found.qs[:, 7:] >= body.lower[6:] - 1e-9).all()
    assert (found.qs[:, 7:] <= body.upper[6:] + 1e-9).all()


def test_face_and_hands_are_bare_and_everything_else_is_covered_once(space):
    share = coverage(load_shape_space())
    total = share.sum(axis=1)
    assert (share >= 0).all() and total.max() < 1.0 + 1e-6
    skin = load_shape_space().skin
    owner = skin.links[np.arange(len(skin.links)), skin.weights.argmax(axis=1)]
    names = np.array(skin.link_names)[owner]
    whole = skin.weights.max(axis=1) > 0.99
    assert (total[whole & np.isin(names, ["l_hand", "r_hand"])] < 0.01).all()
    assert (total[whole & np.isin(names, ["abdomen", "l_shank", "r_foot"])] > 0.98).all()
    head = whole & (names == "head")
    front = load_shape_space().vertices_m[:, 0]
    nose, back = np.flatnonzero(head)[[front[head].argmax(), front[head].argmin()]]
    assert share[nose, 0] == 0.0 and share[back, 0] > 0.9


def test_what_hangs_loose_folds_more(folds):
    tight, loose = (folds(np.full(10 + len(REGIONS), m)) for m in (0.0, 0.06))
    assert (loose >= tight).all() and loose.max() > 0.03 and tight.max() < 0.021

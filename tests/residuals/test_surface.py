# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import AssociationError
from kintrack.objective_config import SurfaceConfig
from kintrack.residuals.surface import surface_residual
from kintrack.skin import skinned_vertices, vertex_normals

CONFIG = SurfaceConfig()


@pytest.fixture(scope="module")
def standing(human, body):
    state = run_kinematics(body, body.neutral())
    vertices = skinned_vertices(state, human.skin)
    return state, vertices, vertex_normals(vertices, human.skin.faces)


@pytest.fixture(scope="module")
def make(human, standing):
    """A function of (vertex, offsets along the normal, options): the term."""
    _, vertices, normals = standing

    def build(vertex, along, sideways=0.0, config=CONFIG, **options):
        across = np.cross(normals[vertex], [0.3, 0.5, 0.8])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        points = vertices[vertex] + np.reshape(along, (-1, 1)) * normals[vertex] + sideways * across
        return surface_residual(human.skin, vertex, points, vertices, normals, config, **options)

    return build


def test_points_on_the_skin_cost_nothing(make, standing):
    term = make(np.arange(500), np.zeros(500))
    assert term.cost(standing[0]) == pytest.approx(0.0, abs=1e-12)
    assert term.inliers == 500
    assert term.rms_m == pytest.approx(0.0, abs=1e-9)
    assert term.scale_m == CONFIG.scale_floor_m


def test_outliers_weigh_nothing_and_move_nothing(make, standing):
    rng = np.random.default_rng(0)
    along = rng.normal(0, 0.005, 600)
    along[::10] = 0.4
    term = make(np.arange(600), along)
    assert np.array_equal(term.weights[::10], np.zeros(60))
    clean = np.setdiff1d(np.arange(600), np.arange(0, 600, 10))
    assert (term.weights[clean] > 0).all()
    assert term.inliers <= 540
    assert term.rms_m < 0.01
    alone = make(clean, along[clean], least_scale_m=term.scale_m)
    both = make(np.arange(600), along, least_scale_m=term.scale_m)
    H, g, cost = both.quadratic(standing[0])
    assert np.allclose(H, alone.quadratic(standing[0]).H)
    assert np.allclose(g, alone.quadratic(standing[0]).g)
    assert cost == pytest.approx(alone.cost(standing[0]))


def test_the_scale_follows_the_noise_between_floor_and_ceiling(make):
    rng = np.random.default_rng(1)
    middle = 0.5 * (CONFIG.scale_floor_m + CONFIG.scale_ceiling_m)
    for noise, scale in (
        (1e-4, CONFIG.scale_floor_m),
        (middle, middle),
        (1.0, CONFIG.scale_ceiling_m),
    ):
        term = make(np.arange(2000), rng.normal(0, noise, 2000))
        assert term.scale_m == pytest.approx(scale, rel=0.1)


def test_a_wide_gate_keeps_far_pairs_in_play(make):
    along = np.full(300, 0.3)
    assert make(np.arange(300), along).weights.max() == 0.0
    assert make(np.arange(300), along, least_scale_m=0.1).weights.min() > 0.0


def test_the_root_mean_square_is_that_of_the_inliers(make):
    along = np.r_[np.full(200, 0.004), np.full(200, -0.004), np.full(40, 0.5)]
    term = make(np.arange(440), along)
    assert term.inliers == 400
    assert term.rms_m == pytest.approx(0.004)


def test_without_an_inlier_the_residual_is_unknown(make):
    term = make(np.arange(100), np.full(100, 2.0))
    assert term.inliers == 0
    assert np.isnan(term.rms_m)


def test_sliding_along_the_skin_costs_only_the_share_of_point_to_point(make, standing):
    state = standing[0]
    for alpha in (0.0, 0.1, 0.5):
        config = SurfaceConfig(point_weight=alpha)
        along = make(np.arange(100), np.full(100, 0.004), config=config).cost(state)
        aside = make(np.arange(100), np.zeros(100), sideways=0.004, config=config).cost(state)
        assert aside / along == pytest.approx(
            alpha / (1 + alpha) * _robust_gain(config, 0.004), rel=1e-6, abs=1e-12
        )


def _robust_gain(config, offset_m):
    """Weight of an exact pair against one that lies off along the normal, scale at its floor."""
    scale = np.clip(1.4826 * offset_m, config.scale_floor_m, config.scale_ceiling_m)
    off = (1 - (offset_m / (4.685 * scale)) ** 2) ** 2 / scale**2
    return 1 / config.scale_floor_m**2 / off


def test_correlated_neighbours_share_their_information(make, standing):
    along = np.full(100, 0.004)
    alone = make(np.arange(100), along, config=SurfaceConfig(correlation=1.0))
    shared = make(np.arange(100), along, config=SurfaceConfig(correlation=20.0))
    assert alone.cost(standing[0]) == pytest.approx(20.0 * shared.cost(standing[0]))


def test_pairs_add_up_in_any_order(make, standing):
    along = np.random.default_rng(2).normal(0, 0.01, 400)
    order = np.random.default_rng(3).permutation(400)
    a = make(np.arange(400), along).quadratic(standing[0])
    b = make(np.arange(400)[order], along[order]).quadratic(standing[0])
    assert np.allclose(a.H, b.H) and np.allclose(a.g, b.g)


def test_no_pair_at_all_is_an_association_error(make):
    with pytest.raises(AssociationError, match="no observed point lies near the skin"):
        make(np.zeros(0, dtype=int), np.zeros(0))

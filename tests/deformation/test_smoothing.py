# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.deformation.carry import carried
from kintrack.deformation.evidence import Evidence
from kintrack.deformation.memory import remembered
from kintrack.deformation.smoothing import smoothed
from kintrack.deformation_config import DeformationConfig
from kintrack.errors import ConfigError
from kintrack.skin import load_skin

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def dense(H, faces, smooth, hold):
    """The matrix that `smoothed` never forms."""
    n = faces.max() + 1
    A = hold * np.eye(n)
    for f, corners in enumerate(faces):
        a, b, c, d, e, g = H[f]
        A[np.ix_(corners, corners)] += [[a, b, c], [b, d, e], [c, e, g]]
    for i in range(n):
        for j in range(i):  # in a tetrahedron every two vertices are neighbours
            A[i, i] += smooth
            A[j, j] += smooth
            A[i, j] -= smooth
            A[j, i] -= smooth
    return A


def some_evidence(rng, count=40):
    return Evidence(
        rng.integers(0, 3, count),
        rng.uniform(0, 1, (count, 3)),
        rng.normal(0, 0.01, count),
        rng.uniform(0, 1, count),
    )


def test_the_steps_end_at_the_minimum():
    rng = np.random.default_rng(1)
    H, g = remembered(
        np.zeros((4, 6)), np.zeros((4, 3)), some_evidence(rng), TETRAHEDRON, np.zeros(4), 0.5
    )
    b = np.zeros(4)
    np.add.at(b, TETRAHEDRON, g)
    expected = np.linalg.solve(dense(H, TETRAHEDRON, 0.7, 0.2), b)
    found = smoothed(np.zeros(4), H, g, TETRAHEDRON, 0.7, 0.2, 8)
    assert np.abs(found - expected).max() < 1e-9


def test_a_triangle_forgets_only_while_it_is_seen():
    rng = np.random.default_rng(2)
    evidence, none = some_evidence(rng), np.zeros(4)
    H, g = remembered(np.ones((4, 6)), np.ones((4, 3)), evidence, TETRAHEDRON, none, 0.5)
    assert (H[3] == 1.0).all() and (g[3] == 1.0).all()
    assert (H[0] != 1.0).all()


def test_what_is_remembered_does_not_depend_on_the_offsets_at_that_time():
    rng = np.random.default_rng(3)
    evidence, shift = some_evidence(rng), rng.normal(0, 0.01, 4)
    corners = shift[TETRAHEDRON[evidence.face]]
    moved = evidence.residual_m - (evidence.a * corners).sum(axis=1)
    nothing = np.zeros((4, 6)), np.zeros((4, 3))
    first = remembered(*nothing, evidence, TETRAHEDRON, np.zeros(4), 0.5)
    other = Evidence(evidence.face, evidence.a, moved, evidence.weight)
    second = remembered(*nothing, other, TETRAHEDRON, shift, 0.5)
    assert np.allclose(first[0], second[0]) and np.allclose(first[1], second[1])


def test_the_display_skin_takes_the_offsets_of_the_tracking_skin(human):
    fine = load_skin("display")
    n = len(human.skin.labels)
    same = carried(human.body, human.skin, fine, np.full(n, 0.01))
    assert np.allclose(same, 0.01)
    part = carried(human.body, human.skin, fine, (human.skin.labels == 1).astype(float))
    assert (part[fine.labels == 1] > 0.5).mean() > 0.95
    assert (part[fine.labels >= 3] < 0.01).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"memory_s": 0.0},
        {"hold": 0.0},
        {"outward_m": float("nan")},
        {"iterations": 1.5},
        {"enabled": 1},
    ],
)
def test_impossible_numbers_are_named(wrong):
    with pytest.raises(ConfigError, match=next(iter(wrong))):
        DeformationConfig(**wrong)

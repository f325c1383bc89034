# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.objects.assembly import assembly


@pytest.mark.parametrize("seed", range(12))
def test_an_assembly_stands_on_the_floor_and_is_no_larger_than_furniture(seed):
    mesh = assembly(np.random.default_rng(seed)).mesh
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert np.isfinite(mesh.vertices).all()
    assert low[2] == pytest.approx(0.0, abs=1e-9)
    assert 0.1 < np.linalg.norm(high - low) < 4.5
    assert np.allclose(low[:2], -high[:2])


def test_assemblies_differ_and_come_back_with_their_seed():
    first, again, other = (assembly(np.random.default_rng(n)).mesh for n in (1, 1, 2))
    assert np.array_equal(first.vertices, again.vertices)
    assert len(first.vertices) != len(other.vertices) or not np.allclose(
        first.vertices, other.vertices
    )

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.people.sheet import Sheet, border_edges, cut, hem, lengthened, refined, without


@pytest.fixture
def plane() -> Sheet:
    x, y = (grid.ravel() for grid in np.meshgrid(np.arange(5.0), np.arange(5.0)))
    a = np.arange(20)[np.arange(20) % 5 < 4]
    faces = np.concatenate([np.stack([a, a + 1, a + 6], 1), np.stack([a, a + 6, a + 5], 1)])
    n = len(x)
    zero = np.zeros(n)
    return Sheet(
        np.stack([x, y, zero], axis=1), faces, np.stack([x / 4, 1 - x / 4], axis=1),
        np.ones(n, np.uint8), zero, zero, np.zeros(n, np.uint8), np.arange(n), x[:, None],
    )  # fmt: skip


def area(sheet: Sheet) -> float:
    a, b, c = np.moveaxis(sheet.vertices[sheet.faces], 1, 0)
    return float(0.5 * np.cross(b - a, c - a)[:, 2].sum())


def test_a_cut_follows_the_zero_line_and_keeps_orientation(plane):
    kept = cut(plane, 2.3 - plane.vertices[:, 0], 7)
    assert area(kept) == pytest.approx(2.3 * 4.0)
    assert kept.vertices[:, 0].max() == pytest.approx(2.3)
    np.testing.assert_allclose(kept.vertices[hem(kept, 7), 0], 2.3)
    np.testing.assert_allclose(kept.weights[:, 0], kept.vertices[:, 0] / 4)
    np.testing.assert_allclose(kept.fields[:, 0], kept.vertices[:, 0])


def test_a_slanted_cut_keeps_the_right_share(plane):
    x, y, _ = plane.vertices.T
    assert area(cut(plane, x + y - 4.6, 1)) == pytest.approx(0.5 * 3.4**2)


def test_refining_keeps_area_and_borders_and_makes_four_of_one(plane):
    faces, ends = refined(plane.faces, len(plane.vertices))
    vertices = np.concatenate([plane.vertices, plane.vertices[ends].mean(axis=1)])
    assert len(faces) == 4 * len(plane.faces)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert 0.5 * np.cross(b - a, c - a)[:, 2].sum() == pytest.approx(16.0)
    assert len(border_edges(faces)) == 2 * len(border_edges(plane.faces))


def test_a_lengthened_sheet_goes_on_without_a_seam(plane):
    kept = cut(plane, 2.5 - plane.vertices[:, 0], 7)
    start = hem(kept, 7)
    rows = [kept.vertices[start] + [0.5 * n, 0.0, 0.0] for n in (1, 2)]
    weights, labels = kept.weights[start], kept.labels[start]
    longer = lengthened(kept, 7, rows, [weights] * 2, [labels] * 2, np.array([0.01, 0.02]))
    assert area(longer) == pytest.approx(3.5 * 4.0)
    assert len(hem(longer, 7)) == len(start)
    np.testing.assert_allclose(longer.vertices[hem(longer, 7), 0], 3.5)
    assert longer.room_m.max() == 0.02


def test_what_is_hidden_goes_only_where_all_corners_are(plane):
    left = without(plane, plane.vertices[:, 0] < 2.5)
    assert area(left) == pytest.approx(8.0)

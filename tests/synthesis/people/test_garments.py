# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial import cKDTree

from kintrack.errors import SceneError
from kintrack.skin import vertex_normals
from synthesis.people.form import form_of
from synthesis.people.garments import Skirt, Top, Trousers, sew_skirt, sew_top, sew_trousers
from synthesis.people.person import load_person
from synthesis.people.shoes import Shoe, make_shafts, make_shoe

TOPS = {
    "t": Top(),
    "jumper": Top(1.9, 0.02, 0.03, collar="high", cuff=0.9),
    "hoodie": Top(1.9, 0.02, 0.02, collar="hood"),
    "jacket": Top(1.9, 0.015, hem_m=-0.12, collar="collar", open_m=0.04),
    "dress": Top(0.0, 0.007, hem_m=-0.5, flare=0.15, slope=0.5, collar="none"),
}
TROUSERS = {"tight": Trousers(1.9, 0.1, 0.004, 0.045), "wide": Trousers(2.0, hem_radius_m=0.12)}


@pytest.fixture(scope="module", params=[3, 11])
def form(request):
    return form_of(load_person(request.param))


def height_over_skin(form, points):
    """Distance from the bare body along its normals [m]; negative is inside."""
    vertices, faces = form.vertices, form.faces
    nearest = cKDTree(vertices).query(points)[1]
    return ((points - vertices[nearest]) * vertex_normals(vertices, faces)[nearest]).sum(axis=1)


@pytest.mark.parametrize("kind", TOPS)
def test_no_top_lets_the_body_through(form, kind):
    layer = sew_top(form, form.vertices, TOPS[kind], 1)
    old = layer.sheet.base >= 0
    lift = ((layer.outside - form.vertices) * form.normals).sum(axis=1)
    assert lift[layer.sheet.base[old]].min() > 0.0015
    height = height_over_skin(form, layer.sheet.vertices)
    assert np.quantile(height, 0.005) > 0.0


@pytest.mark.parametrize("kind", TROUSERS)
def test_no_trousers_let_the_body_through(form, kind):
    layer = sew_trousers(form, form.vertices, TROUSERS[kind], 1)
    base = layer.sheet.base[layer.sheet.base >= 0]
    lift = ((layer.outside - form.vertices) * form.normals).sum(axis=1)
    assert lift[base].min() > 0.0015


def test_a_jacket_lies_over_the_shirt(form):
    shirt = sew_top(form, form.vertices, TOPS["t"], 1)
    jacket = sew_top(form, shirt.outside, TOPS["jacket"], 2)
    base = np.intersect1d(shirt.sheet.base, jacket.sheet.base)
    lift = ((jacket.outside - shirt.outside) * form.normals).sum(axis=1)
    assert lift[base[base >= 0]].min() > 0.0015


def test_wide_trousers_are_wider_than_tight_ones(form):
    def width(kind: str) -> float:
        sheet = sew_trousers(form, form.vertices, TROUSERS[kind], 1).sheet
        shin = sheet.vertices[(sheet.vertices[:, 1] > 0.0) & (sheet.labels == 6)]
        low = shin[shin[:, 2] < np.quantile(shin[:, 2], 0.1)]
        return float(np.ptp(low[:, 1]))

    assert width("wide") > width("tight") + 0.05


def test_sleeves_end_where_they_should(form):
    for sleeve in (0.5, 1.0, 1.8):
        sheet = sew_top(form, form.vertices, Top(sleeve), 1).sheet
        reach = form.arms.at[sheet.base[sheet.base >= 0]].max()
        assert sleeve - 0.1 < reach < sleeve


def test_a_skirt_bridges_the_legs_and_takes_their_labels(form):
    sheet = sew_skirt(form, form.vertices, Skirt(), 1).sheet
    low = sheet.vertices[:, 2] < form.origin("l_thigh")[2] - 0.3
    middle = np.abs(sheet.vertices[:, 1]) < 0.03
    assert (low & middle & (sheet.vertices[:, 0] > 0.05)).any()
    assert set(sheet.labels[low & (sheet.vertices[:, 1] > 0.05)]) == {6}
    assert set(sheet.labels[low & (sheet.vertices[:, 1] < -0.05)]) == {5}
    names = form.person.skin.link_names
    for side in "lr":
        leg = [names.index(f"{side}_{link}") for link in ("thigh", "shank", "foot")]
        assert sheet.weights[:, leg].sum(axis=1)[low & middle].min() > 0.1


def test_weights_of_cloth_add_up_to_one(form):
    for layer in (
        sew_top(form, form.vertices, TOPS["dress"], 1),
        sew_trousers(form, form.vertices, TROUSERS["wide"], 1),
    ):
        np.testing.assert_allclose(layer.sheet.weights.sum(axis=1), 1.0, atol=1e-9)
        assert layer.sheet.room_m.min() >= 0.0


def test_what_a_garment_hides_lies_within_it(form):
    layer = sew_top(form, form.vertices, TOPS["jacket"], 1)
    assert layer.hides.any()
    kept = np.zeros(len(form.vertices), bool)
    kept[layer.sheet.base[layer.sheet.base >= 0]] = True
    high = form.vertices[:, 2] > form.origin("l_thigh")[2] + 0.06
    assert kept[layer.hides & high].all()


def test_shoes_stand_on_the_sole_and_hold_the_toes(form):
    person = form.person
    for side, sign in (("l", 1.0), ("r", -1.0)):
        shoe = make_shoe(form, side, Shoe())
        foot = person.bind_vertices[person.bind_vertices[:, 1] * sign > 0.0]
        foot = foot[foot[:, 2] < foot[:, 2].min() + 0.05]
        assert -0.002 <= shoe.vertices[:, 2].min() - foot[:, 2].min() <= 0.0
        assert shoe.vertices[:, 0].max() > foot[:, 0].max() + 0.005
        assert shoe.vertices[:, 0].min() < foot[:, 0].min() - 0.003


def test_shafts_reach_their_height_above_the_skin(form):
    sheet, hides = make_shafts(form, 0.2, 0.008)
    top = form.origin("l_foot")[2] + 0.2
    assert sheet.vertices[:, 2].max() == pytest.approx(top, abs=0.004)
    assert height_over_skin(form, sheet.vertices).min() > 0.003
    assert hides.any()


def test_an_unknown_collar_is_named():
    with pytest.raises(SceneError, match="ruff.*crew"):
        Top(collar="ruff")

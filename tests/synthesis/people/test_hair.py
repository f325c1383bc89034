# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.people.beard import grow_beard
from synthesis.people.form import form_of
from synthesis.people.hair import Hair, grow_hair
from synthesis.people.hats import HATS, put_on_hat
from synthesis.people.person import load_person
from synthesis.people.scalp import head_of

STYLES = {
    "short": Hair(),
    "bob": Hair(0.025, 0.02, 0.13),
    "long": Hair(0.02, 0.02, 0.4),
    "bun": Hair(0.012, 0.008, tied="bun"),
    "tail": Hair(0.012, 0.008, tied="tail"),
}


@pytest.fixture(scope="module")
def form():
    return form_of(load_person(3))


@pytest.fixture(scope="module")
def head(form):
    return head_of(form.person)


def grown(head, form, style, pressed=0.0):
    return grow_hair(head, style, form.vertices[form.arms.share < 0.2], pressed, 1)


def over_skull(head, vertices):
    away = vertices - head.centre
    distance = np.linalg.norm(away, axis=1)
    return distance - head.reach(away / distance[:, None])


@pytest.mark.parametrize("kind", STYLES)
def test_hair_covers_the_crown_and_leaves_the_face(form, head, kind):
    cap = grown(head, form, STYLES[kind])[0]
    away = (cap.vertices - head.centre) / head.scale
    assert away[:, 2].max() > 0.105
    assert not ((away[:, 0] > 0.06) & (np.abs(away[:, 1]) < 0.03) & (away[:, 2] < 0.03)).any()
    assert over_skull(head, cap.vertices[cap.vertices[:, 2] > head.centre[2]]).min() > 0.001
    assert set(cap.labels) == {1}


def test_long_hair_falls_behind_the_back(form, head):
    hair = grown(head, form, STYLES["long"])[0]
    low = hair.vertices[hair.vertices[:, 2] < head.origin("neck")[2] - 0.08]
    assert len(low)
    spine = form.vertices[(np.abs(form.vertices[:, 1]) < 0.08) & (form.arms.share < 0.2)]
    for place in low[::15]:
        level = np.abs(spine[:, 2] - place[2]) < 0.02
        column = np.abs(spine[:, 1] - place[1]) < 0.02
        assert place[0] < spine[level & column, 0].min() + 0.004
    names = form.person.skin.link_names
    assert hair.weights[:, names.index("chest")].max() > 0.9
    assert hair.room_m.max() > 0.02


def test_longer_hair_reaches_lower(form, head):
    def lowest(kind):
        return min(sheet.vertices[:, 2].min() for sheet in grown(head, form, STYLES[kind]))

    assert lowest("long") < lowest("bob") - 0.1 < lowest("short") - 0.1


def test_a_receding_hairline_bares_the_forehead(form, head):
    def foremost(receding):
        hair = grown(head, form, Hair(receding=receding))[0].vertices
        return hair[np.abs(hair[:, 1]) < 0.02, 0].max()

    assert foremost(1.0) < foremost(0.0) - 0.02


def test_a_beard_lies_on_the_jaw_and_leaves_the_lips(form, head):
    beard = grow_beard(head, 0.012, 2)
    away = (beard.vertices - head.centre) / head.scale
    assert away[:, 2].max() < 0.035
    lips = np.hypot(away[:, 1] / 0.018, (away[:, 2] + 0.064) / 0.006) < 1.0
    assert not (lips & (away[:, 0] > 0.06)).any()
    assert len(beard.faces) > 200


@pytest.mark.parametrize("kind", HATS)
def test_a_hat_lies_over_the_hair_that_it_presses(form, head, kind):
    hat = put_on_hat(head, kind, 1)
    hair = grown(head, form, Hair(0.04, 0.01), pressed=1.0)[0]
    top = over_skull(head, hair.vertices[hair.vertices[:, 2] > head.centre[2] + 0.08])
    assert over_skull(head, hat.vertices).min() > 0.001
    assert np.quantile(top, 0.95) < over_skull(head, hat.vertices[:1])[0]

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.floor import Floor, soles_of
from kintrack.floor_config import ContactConfig
from kintrack.human import load_human
from kintrack.residuals.contact import Contact, contact_residual
from kintrack.skin import skinned_vertices

UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def human():
    return load_human()


def term_of(human, above_m, stands, raised_m=0.0):
    """Soles of a standing body whose floor is so far below its feet, the left foot raised."""
    state = run_kinematics(human.body, human.body.neutral())
    vertices, soles = skinned_vertices(state, human.skin), soles_of(human)
    vertices = vertices.copy()
    vertices[soles[0], 2] += raised_m
    low = vertices[soles.ravel(), 2].min()
    contact = Contact(Floor(UP, float(low - above_m)), soles, np.array(stands))
    return contact, vertices, contact_residual(human.skin, contact, vertices, ContactConfig())


def test_a_foot_that_stands_is_drawn_down_to_the_floor(human):
    contact, vertices, term = term_of(human, 0.05, [True, True])
    assert set(term.vertex) == set(contact.soles.ravel())
    assert np.allclose(contact.floor.above_m(term.points_world), 0.0)


def test_a_foot_that_does_not_stand_may_be_above_the_floor_but_not_below(human):
    _, _, above = term_of(human, 0.05, [False, False])
    assert len(above.vertex) == 0
    contact, _, below = term_of(human, -0.05, [False, False])
    assert set(below.vertex) == set(contact.soles.ravel())


def test_each_foot_is_asked_by_itself(human):
    contact, _, term = term_of(human, 0.05, [True, False])
    assert set(term.vertex) == set(contact.soles[0])


def test_the_lower_foot_is_the_one_that_stands(human):
    contact, vertices, _ = term_of(human, 0.0, [False, False], raised_m=0.1)
    lower = contact.lower(vertices)
    assert lower.soles.tolist() == [contact.soles[1].tolist()]
    assert lower.stands.all()

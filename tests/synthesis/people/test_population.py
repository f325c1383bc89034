# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import ModelError, SceneError
from kintrack.rig import load_rig, model_folder
from kintrack.skin import load_skin
from synthesis.people.population import (
    FILE,
    PEOPLE,
    held_out_people,
    load_population,
    training_people,
)

SOME = (0, 123, 250, 499)


@pytest.fixture(scope="module")
def population():
    return load_population()


def test_the_file_is_small_and_holds_everybody(population):
    assert len(population) == PEOPLE
    assert FILE.stat().st_size < 5e6


def test_nobody_is_both_trained_on_and_held_out():
    assert [*training_people(), *held_out_people()] == list(range(PEOPLE))
    assert len(held_out_people()) == PEOPLE // 5


def test_women_and_men_are_as_tall_and_heavy_as_adults_are(population):
    bmi = population.masses_kg / population.heights_m**2
    for sex, height_m in ((population.woman, 1.62), (~population.woman, 1.76)):
        assert 0.4 < sex.mean() < 0.6
        assert abs(population.heights_m[sex].mean() - height_m) < 0.02
        assert 0.05 < population.heights_m[sex].std() < 0.10
        assert 22.0 < bmi[sex].mean() < 26.0
    assert population.ages_years.min() >= 18.0 and population.ages_years.max() <= 75.0


@pytest.mark.parametrize("index", SOME)
def test_the_stored_facts_are_those_of_the_stored_surface(population, index):
    vertices, _ = population.body(index)
    facts = population.facts(index)
    assert abs(np.ptp(vertices[:, 2]) - facts.height_m) < 0.003
    a, b, c = (vertices[load_skin("display").faces[:, i]] for i in range(3))
    volume = np.einsum("fi,fi->", np.cross(a, b), c) / 6.0
    assert 980.0 * volume == pytest.approx(facts.mass_kg, rel=0.01)
    assert facts.sex == ("woman" if facts.phenotype["gender"] > 0.5 else "man")


def test_the_mean_person_is_close_to_the_models_average_adult(population):
    points = dict(
        zip(
            population.point_names,
            population.mean_m[-len(population.point_names) :],
            strict=True,
        )
    )
    rig = load_rig(model_folder())
    for name, T in zip(rig.link_names, rig.Ts_root_link, strict=True):
        assert np.linalg.norm(points[name] - T[:3, 3]) < 0.005, name
    assert set(points) == set(rig.link_names) | set(rig.extra_offsets)


@pytest.mark.parametrize("index", SOME)
def test_the_root_is_between_the_hips_and_bodies_are_symmetric(population, index):
    _, points = population.body(index)
    assert np.allclose(points["pelvis"], 0.0, atol=1e-6)
    for name in ("thigh", "forearm", "toe_base", "hand_center"):
        left, right = points[f"l_{name}"], points[f"r_{name}"]
        assert left[1] > 0.03
        assert np.allclose(left * [1, -1, 1], right, atol=2e-3)


@pytest.mark.parametrize("index", SOME)
def test_fingers_curl_towards_the_palm(population, index):
    flat, points = population.body(index, "open")
    reach = {}
    for shape in ("open", "relaxed", "closed"):
        vertices, _ = population.body(index, shape)
        for side in "lr":
            hand = vertices[population.hand_vertices[side]]
            away = np.linalg.norm(hand - points[f"{side}_hand_center"], axis=1)
            reach[side, shape] = away.max()
        still = np.ones(len(flat), bool)
        still[np.concatenate(list(population.hand_vertices.values()))] = False
        assert np.array_equal(vertices[still], flat[still])
    for side in "lr":
        assert reach[side, "closed"] < 0.09
        assert reach[side, "closed"] < reach[side, "relaxed"] < reach[side, "open"]
        assert reach[side, "open"] > 0.11
    assert reach["l", "closed"] == pytest.approx(reach["r", "closed"], abs=2e-3)


def test_unknown_people_and_hands_are_refused_by_name(population):
    with pytest.raises(SceneError, match="person 500: 0 to 499"):
        population.body(500)
    with pytest.raises(SceneError, match="person -1"):
        population.facts(-1)
    with pytest.raises(SceneError, match="left.*sides l, r"):
        population.body(0, {"left": "open"})


def test_a_broken_file_is_named(tmp_path):
    (tmp_path / "broken.npz").write_bytes(b"nothing")
    with pytest.raises(ModelError, match="broken.npz"):
        load_population(tmp_path / "broken.npz")

# SPDX-License-Identifier: Apache-2.0
import time

import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import SceneError
from kintrack.geometry import LABELS
from kintrack.skin import skinned_vertices
from synthesis.people.figure import move
from synthesis.people.garments import Skirt, Top
from synthesis.people.outfits import Outfit, draw_outfit
from synthesis.people.person import load_person
from synthesis.people.sway import STILL_M
from synthesis.people.wardrobe import dress

DT_S = 1.0 / 30.0


@pytest.fixture(scope="module")
def someone():
    return load_person(3)


@pytest.fixture(scope="module")
def figure(someone):
    outfit = Outfit(top=Top(1.8, 0.02, 0.035), bottom=Skirt(-0.5, flare=0.2))
    return dress(someone, np.random.default_rng(0), outfit)


def states(person, hinge, values):
    out = []
    for value in values:
        q = person.body.neutral()
        q[person.body.dof(hinge) + 1] = value
        out.append(run_kinematics(person.body, q))
    return out


def test_the_same_seed_dresses_alike_and_another_differently(someone):
    a, b, c = (dress(someone, np.random.default_rng(seed)) for seed in (4, 4, 5))
    np.testing.assert_array_equal(a.mesh.vertices, b.mesh.vertices)
    np.testing.assert_array_equal(a.skin.weights, b.skin.weights)
    assert a.mesh.vertices.shape != c.mesh.vertices.shape


def test_in_bind_pose_skinning_gives_the_mesh_back(figure):
    T = figure.person.rig.Ts_root_link[figure.skin.links]
    points = np.einsum("vbij,vbj->vbi", T[..., :3, :3], figure.skin.points_link) + T[..., :3, 3]
    back = (figure.skin.weights[..., None] * points).sum(axis=1)
    np.testing.assert_allclose(back, figure.mesh.vertices, atol=1e-9)


def test_a_figure_is_whole(figure):
    mesh = figure.mesh
    assert set(np.unique(mesh.labels)) == set(range(1, len(LABELS)))
    assert len(mesh.faces) < 80_000
    np.testing.assert_allclose(figure.skin.weights.sum(axis=1), 1.0)
    assert 0.02 < max(m.infrared for m in mesh.materials) <= 1.0


def test_clothes_stand_off_the_bare_body(figure, someone):
    bare = someone.bind_vertices[:, 1]
    worn = figure.mesh.vertices[figure.mesh.labels == 6, 1]
    assert worn.max() > bare[someone.skin.labels == 6].max() + 0.02


def test_a_body_at_rest_keeps_its_clothes_still(figure, someone):
    frames = list(move(figure, states(someone, "chest_rotation", [0.0] * 4), DT_S))
    np.testing.assert_allclose(frames[-1], frames[0], atol=2e-3)


def test_cloth_lags_behind_a_swinging_arm_and_comes_back(figure, someone):
    angles = np.r_[np.linspace(0.0, 1.2, 8), np.full(60, 1.2)]
    swing = states(someone, "r_shoulder_elevation", angles)
    frames = list(move(figure, swing, DT_S))
    lag = [
        np.linalg.norm(frame - skinned_vertices(state, figure.skin), axis=1)
        for frame, state in zip(frames, swing, strict=True)
    ]
    rest = np.abs(frames[-1] - frames[-2]).max()
    assert lag[6].max() > 0.005
    assert rest < 5e-4
    still = np.setdiff1d(np.arange(len(lag[0])), figure.cloth.vertex)
    assert max(frame[still].max() for frame in lag) == 0.0


def test_displacement_keeps_within_room_and_gap(figure, someone):
    angles = 1.0 * np.sin(np.arange(20) * 1.3)
    swing = states(someone, "l_hip_flexion", angles)
    cloth = figure.cloth
    longest = np.hypot(cloth.room_m, np.maximum(cloth.room_m, cloth.gap_m))
    for frame, state in zip(move(figure, swing, DT_S), swing, strict=True):
        apart = frame - skinned_vertices(state, figure.skin)
        moved = np.linalg.norm(apart[cloth.vertex], axis=1)
        assert (moved <= longest + 1e-9).all()
    assert (np.maximum(cloth.room_m, cloth.gap_m) > STILL_M).all()


def test_a_skirt_follows_the_thighs_of_a_seated_person(figure, someone):
    q = someone.body.neutral()
    for side in "lr":
        q[someone.body.dof(f"{side}_hip_flexion") + 1] = 1.4
        q[someone.body.dof(f"{side}_knee_flexion") + 1] = 1.4
    state = run_kinematics(someone.body, q)
    seated = next(move(figure, [state], DT_S))
    skirt = np.flatnonzero(np.isin(np.arange(len(seated)), figure.cloth.vertex))
    low = skirt[figure.mesh.vertices[skirt, 2] < -0.4]
    assert len(low)
    assert np.median(seated[low, 0]) > 0.25


def test_dressing_is_quick(someone):
    start = time.perf_counter()
    dress(someone, np.random.default_rng(6))
    assert time.perf_counter() - start < 4.0


def test_every_kind_of_clothing_is_drawn():
    woman = next(p.facts for p in map(load_person, range(20)) if p.facts.sex == "woman")
    man = next(p.facts for p in map(load_person, range(20)) if p.facts.sex == "man")
    rng = np.random.default_rng(0)
    hers = [draw_outfit(woman, rng) for _ in range(300)]
    his = [draw_outfit(man, rng) for _ in range(300)]
    both = hers + his
    assert {type(outfit.bottom).__name__ for outfit in hers} == {"Skirt", "Trousers", "NoneType"}
    assert all(outfit.bottom is not None and not isinstance(outfit.bottom, Skirt) for outfit in his)
    assert {outfit.hat for outfit in both} == {"", "cap", "wool", "brim"}
    assert {outfit.hair.tied for outfit in hers if outfit.hair} == {"", "bun", "tail"}
    assert any(outfit.hair is None for outfit in his) and any(outfit.beard_m for outfit in his)
    assert not any(outfit.beard_m for outfit in hers)
    assert any(outfit.jacket and outfit.jacket.open_m for outfit in both)
    infrared = np.array([outfit.material("top").infrared for outfit in both])
    assert 0.05 < np.mean(infrared < 0.2) < 0.3


def test_a_bare_person_can_be_drawn_too(someone):
    nothing = Outfit(top=None, bottom=None, shoe=None, socks=False, hair=None)
    figure = dress(someone, np.random.default_rng(0), nothing)
    assert len(figure.mesh.faces) > 20_000
    assert len(figure.cloth.vertex) == 0


def test_an_unknown_hat_is_named():
    with pytest.raises(SceneError, match="crown.*cap"):
        Outfit(hat="crown")

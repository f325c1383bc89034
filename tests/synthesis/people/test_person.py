# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import SceneError
from kintrack.joints import JOINT_NAMES
from kintrack.skin import skinned_vertices
from synthesis.people.person import load_person
from synthesis.people.population import load_population

TALL_WOMAN, SHORT_MAN, HEAVY_MAN = (3, 14, 423)


@pytest.fixture(scope="module", params=(TALL_WOMAN, SHORT_MAN, HEAVY_MAN))
def index(request):
    return request.param


def test_every_link_hangs_on_its_parent_at_the_persons_own_joint(index):
    person, (_, points) = load_person(index), load_population().body(index)
    names, joints = person.rig.link_names, [int(j) for j in person.body.link_joints]
    rng = np.random.default_rng(index)
    q = person.body.integrate(person.body.neutral(), rng.uniform(-1.0, 1.0, person.body.nv))
    state = run_kinematics(person.body, q)
    for child, name in enumerate(names[1:], start=1):
        joint = person.body.model.parents[joints[child]]
        while joint not in joints:
            joint = person.body.model.parents[joint]
        parent = joints.index(joint)
        T, bind = state.Ts_world_link[parent], person.rig.Ts_root_link[parent]
        seen = T[:3, :3].T @ (state.Ts_world_link[child][:3, 3] - T[:3, 3])
        own = bind[:3, :3].T @ (points[name] - points[names[parent]])
        assert np.allclose(seen, own, atol=1e-4), name


def test_fixed_frames_lie_at_the_persons_own_points(index):
    person, (_, points) = load_person(index), load_population().body(index)
    state = run_kinematics(person.body, person.body.neutral())
    places = {"head": ("head", "head_center")}
    for s in "lr":
        places[f"{s}_hand"] = (f"{s}_hand", f"{s}_hand_center")
        places[f"{s}_foot"] = (f"{s}_foot", f"{s}_toe_base")
    for reported, (link, name) in places.items():
        T = state.Ts_world_link[person.rig.link_names.index(link)]
        bind = person.rig.Ts_root_link[person.rig.link_names.index(link)]
        seen = T[:3, :3].T @ (state.joint_positions_world[JOINT_NAMES.index(reported)] - T[:3, 3])
        assert np.allclose(seen, bind[:3, :3].T @ (points[name] - bind[:3, 3]), atol=1e-4), name


def test_the_skin_on_the_bind_frames_is_the_persons_surface(index):
    person, (vertices, points) = load_person(index, "open"), load_population().body(index)
    for name, T in zip(person.rig.link_names, person.rig.Ts_root_link, strict=True):
        assert np.allclose(T[:3, 3], points[name])
    skin, T = person.skin, person.rig.Ts_root_link[person.skin.links]
    each = np.einsum("vbij,vbj->vbi", T[..., :3, :3], skin.points_link) + T[..., :3, 3]
    blended = np.einsum("vb,vbi->vi", skin.weights, each)
    assert np.abs(blended - vertices).max() < 1e-6
    assert np.array_equal(person.bind_vertices, vertices)


def test_a_standing_person_is_as_tall_as_stated(index):
    person = load_person(index)
    posed = skinned_vertices(run_kinematics(person.body, person.body.neutral()), person.skin)
    assert abs(np.ptp(posed[:, 2]) - person.facts.height_m) < 0.03


def test_hands_are_chosen_per_side():
    relaxed, holding = load_person(0), load_person(0, {"r": "closed"})
    moved = np.linalg.norm(holding.bind_vertices - relaxed.bind_vertices, axis=1) > 1e-4
    assert set(relaxed.skin.labels[moved]) == {3}
    with pytest.raises(SceneError, match="fist.*open, relaxed, closed"):
        load_person(0, "fist")


def test_a_sole_runs_from_heel_to_toe(person):
    for side in "lr":
        assert 0.20 < person.toe[side][0] - person.heel[side][0] < 0.32

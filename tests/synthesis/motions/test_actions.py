# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.errors import SceneError
from kintrack.skin import skinned_vertices
from synthesis.mesh import Material, join, mesh_of
from synthesis.motions.actions import (
    ACTIONS,
    GRIPPING_ACTIONS,
    HELD_OUT_ACTIONS,
    act,
    default_things,
    training_actions,
)
from synthesis.motions.actions.frames import pose
from synthesis.motions.holding import frame_path, palm_path
from synthesis.motions.motion import RATE_HZ
from synthesis.objects.thing import Thing
from synthesis.people.person import load_person

PEOPLE, SEEDS, DURATION_S = (3, 250), (0, 1), 3.4
MOST_RAD_S = 15.0
GREY = Material(lambda coords: np.full((len(coords), 3), 0.5))
CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (0.0, 1.0)])
FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
         [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]  # fmt: skip
UP, DOWN, AHEAD, BACK, LEFT, RIGHT = (
    np.array(v, float)
    for v in ((0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
)


def block(size, at=(0.0, 0.0, 0.0)):
    return mesh_of(CORNERS * size + at, FACES, GREY)


def bar(at, y, z):
    return pose(np.cross(y, z), z, at)


def thing(name, size, **places):
    return lambda rng: Thing(name, block(np.array(size) * rng.uniform(0.95, 1.05)), places)


def box(rng):
    x, y, z = rng.uniform((0.2, 0.25, 0.15), (0.4, 0.45, 0.4))
    places = {
        "left": bar((0, y / 2, z / 2), DOWN, LEFT),
        "right": bar((0, -y / 2, z / 2), UP, RIGHT),
    }
    return Thing("box", block((x, y, z)), places)


def guitar(rng):
    mesh = join([block((0.1, 0.38, 0.48)), block((0.02, 0.05, 0.45), (0.03, 0.0, 0.4))])
    return Thing("guitar", mesh, {"neck": bar((0.05, 0, 0.66), LEFT, UP),
                                  "strings": bar((0.06, 0, 0.2), LEFT, UP)})  # fmt: skip


def seat(rng):
    high = rng.uniform(0.40, 0.50)
    return Thing("stool", block((0.38, 0.4, high)), {"seat": bar((0, 0, high), LEFT, UP)})


THINGS = {
    "suitcase": thing("suitcase", (0.2, 0.5, 0.45), handle=bar((0, 0, 0.47), LEFT, UP)),
    "trolley": thing("trolley", (0.25, 0.4, 0.6), handle=bar((-0.1, 0, 1.0), LEFT, UP)),
    "box": box,
    "guitar": guitar,
    "cup": thing("cup", (0.08, 0.08, 0.1), handle=bar((-0.07, 0, 0.05), UP, BACK)),
    "phone": thing("phone", (0.01, 0.07, 0.15), handle=bar((0, 0, 0.07), UP, BACK)),
    "stool": seat,
}


@pytest.fixture(scope="module")
def people():
    return [load_person(index) for index in PEOPLE]


@pytest.fixture(scope="module")
def performed(people):
    cache = {}

    def of(name):
        if name not in cache:
            cache[name] = [
                (p, done, [run_kinematics(p.body, q) for q in done.motion.q])
                for p in people
                for seed in SEEDS
                for done in [act(name, p, np.random.default_rng(seed), DURATION_S, THINGS)]
            ]
        return cache[name]

    return of


def thing_places(prop, name):
    return (prop.Ts_world_thing @ prop.thing.places[name])[:, :3, 3]


def feet(person, states, side):
    link = person.skin.link_names.index(f"{side}_foot")
    T = np.array([state.Ts_world_link[link] for state in states])
    return np.einsum("nij,kj->nki", T[:, :3, :3], person.foot_points[side][::9]) + T[:, None, :3, 3]


every_action = pytest.mark.parametrize("name", list(ACTIONS))


@every_action
def test_a_performance_has_a_pose_for_every_frame_and_keeps_all_limits(performed, name):
    for person, performance, _ in performed(name):
        q = performance.motion.q
        assert performance.name == name
        assert len(q) == round(DURATION_S * RATE_HZ) and np.isfinite(q).all()
        assert (q[:, 7:] >= person.body.lower[6:]).all()
        assert (q[:, 7:] <= person.body.upper[6:]).all()
        for prop in performance.props:
            assert prop.Ts_world_thing.shape == (len(q), 4, 4)


@every_action
def test_joints_turn_no_faster_than_peoples_do(performed, name):
    for _, performance, _ in performed(name):
        assert np.abs(np.diff(performance.motion.q[:, 7:], axis=0)).max() * RATE_HZ < MOST_RAD_S


@every_action
def test_no_hinge_jumps_from_one_frame_to_the_next(performed, name):
    for _, performance, _ in performed(name):
        v = np.diff(performance.motion.q[:, 7:], axis=0) * RATE_HZ
        assert np.abs(np.diff(v, axis=0)).max() < 0.75 * MOST_RAD_S


@every_action
def test_planted_feet_stay_and_nothing_sinks_into_the_floor(performed, name):
    for person, performance, states in performed(name):
        for side in "lr":
            points, planted = feet(person, states, side), performance.motion.planted[side]
            assert points[..., 2].min() > -0.003
            stays = planted[1:] & planted[:-1]
            assert np.linalg.norm(np.diff(points, axis=0), axis=2)[stays].max(initial=0.0) < 0.001
            assert points[planted, :, 2].min(axis=1).max(initial=0.0) < 0.003


@every_action
def test_held_things_stay_in_the_hand_and_above_the_floor(performed, name):
    for person, performance, _ in performed(name):
        palms = {s: palm_path(person, performance.motion, s)[:, :3, 3] for s in "lr"}
        for prop in (prop for prop in performance.props if prop.held):
            lowest = [(prop.thing.mesh.vertices @ T[2, :3]).min() + T[2, 3]
                      for T in prop.Ts_world_thing]  # fmt: skip
            assert min(lowest) > -0.005
            if prop.thing.name == "box":
                moving = np.linalg.norm(np.diff(prop.Ts_world_thing[:, :3, 3], axis=0), axis=1)
                held = np.append(moving > 1e-4, False) | (name != "bending_and_lifting")
                for side, place in (("l", "left"), ("r", "right")):
                    off = np.linalg.norm(palms[side] - thing_places(prop, place), axis=1)
                    assert off[held].max() < 0.02
            elif prop.thing.name == "guitar":
                neck, strings = thing_places(prop, "neck"), thing_places(prop, "strings")
                along = (neck - strings) / np.linalg.norm(neck - strings, axis=1)[:, None]
                fret = min("lr", key=lambda s: np.linalg.norm(palms[s] - neck, axis=1).mean())
                aside = palms[fret] - neck
                aside -= (aside * along).sum(axis=1)[:, None] * along
                assert np.linalg.norm(aside, axis=1).max() < 0.02
                face = prop.Ts_world_thing[:, :3, 0]
                plucking = palms["r" if fret == "l" else "l"] - strings
                assert np.abs((plucking * face).sum(axis=1)).max() < 0.02
                assert np.linalg.norm(plucking, axis=1).max() < 0.10
            else:
                handle = thing_places(prop, "handle")
                off = [np.linalg.norm(palms[s] - handle, axis=1).max() for s in "lr"]
                assert min(off) < 0.02


@pytest.mark.parametrize("name", ["sitting_down_and_rising", "sitting_and_gesturing"])
def test_who_sits_touches_the_seat(performed, name):
    for person, performance, states in performed(name):
        (prop,) = performance.props
        assert not prop.held and np.ptp(prop.Ts_world_thing, axis=0).max() == 0.0
        T = prop.Ts_world_thing[0] @ prop.thing.places["seat"]
        half = 0.5 * np.ptp(prop.thing.mesh.vertices, axis=0)[:2]
        skin, height = person.skin, performance.motion.q[:, 2]
        links = [skin.link_names.index(n) for n in ("pelvis", "l_thigh", "r_thigh")]
        of = (skin.weights * np.isin(skin.links, links)).sum(axis=1) > 0.6
        for n in np.flatnonzero(height < height.min() + 0.003)[::10]:
            v = (skinned_vertices(states[n], skin)[of] - T[:3, 3]) @ T[:3, :3]
            above = (np.abs(v[:, :2]) < half).all(axis=1)
            assert abs(v[above, 2].min()) < 0.03
        if name == "sitting_down_and_rising":
            assert height[0] - height.min() > 0.2 and height[-1] - height.min() > 0.2


def test_who_sits_on_a_sofa_rests_on_its_cushion_before_its_back(people):
    for seed, person in enumerate(people):
        things = default_things(on_sofa=True)
        done = act("sitting_and_gesturing", person, np.random.default_rng(seed), DURATION_S, things)
        (prop,) = done.props
        assert prop.thing.name == "sofa"
        T = prop.Ts_world_thing[0] @ prop.thing.places["seat"]
        links = [person.skin.link_names.index(n) for n in ("pelvis", "l_thigh", "r_thigh")]
        of = (person.skin.weights * np.isin(person.skin.links, links)).sum(axis=1) > 0.6
        state = run_kinematics(person.body, done.motion.q[0])
        v = (skinned_vertices(state, person.skin)[of] - T[:3, 3]) @ T[:3, :3]
        rear = (prop.thing.mesh.vertices - prop.thing.places["seat"][:3, 3])[:, 0].min()
        assert abs(v[np.abs(v[:, 0]) < 0.15, 2].min()) < 0.03
        assert v[:, 0].min() > rear + 0.1


@every_action
def test_another_draw_is_another_performance(performed, name):
    for first, second in (performed(name)[:2], performed(name)[2:]):
        assert np.abs(first[1].motion.q[:, 7:] - second[1].motion.q[:, 7:]).max() > 0.1


@pytest.mark.parametrize("name", ["walking_with_suitcase", "bending_and_lifting"])
def test_the_same_draw_gives_the_same_bytes(people, performed, name):
    again = act(name, people[0], np.random.default_rng(SEEDS[0]), DURATION_S, THINGS)
    first = performed(name)[0][1]
    assert again.motion.q.tobytes() == first.motion.q.tobytes()
    assert again.props[0].Ts_world_thing.tobytes() == first.props[0].Ts_world_thing.tobytes()


def test_a_walker_covers_ground_before_the_camera_and_arms_swing_against_legs(people):
    person = people[0]
    motion = act("walking", person, np.random.default_rng(4), 6.0, THINGS).motion
    way = np.linalg.norm(np.diff(motion.q[:, :2], axis=0), axis=1).sum()
    assert way > 1.5 and np.abs(motion.q[:, :2]).max() < 3.5

    ahead = np.array([run_kinematics(person.body, q).Ts_world_link[0][:3, 0] for q in motion.q])
    feet = [frame_path(person, motion, f"{side}_foot")[:, :3, 3] for side in "lr"]
    palms = [palm_path(person, motion, side)[:, :3, 3] for side in "lr"]
    legs, arms = (((left - right) * ahead).sum(axis=1) for left, right in (feet, palms))
    assert np.corrcoef(legs, arms)[0, 1] < -0.8


def test_who_turns_away_shows_the_back(people):
    facing = [
        run_kinematics(people[0].body, q).Ts_world_link[0][0, 0]
        for q in act("turning_away", people[0], np.random.default_rng(3), 8.0, THINGS).motion.q
    ]
    assert facing[0] > 0.3 and np.mean(np.array(facing) < -0.7) > 0.1


def test_actions_that_are_held_out_are_not_trained_on():
    assert set(HELD_OUT_ACTIONS) | set(training_actions()) == set(ACTIONS)
    assert not set(HELD_OUT_ACTIONS) & set(training_actions())
    assert set(GRIPPING_ACTIONS) <= set(ACTIONS)


@pytest.mark.parametrize(
    ("name", "duration_s", "things", "says"),
    [
        ("flying", 5.0, THINGS, "flying.*standing"),
        ("standing", 1.0, THINGS, "1.0.*at least"),
        ("standing", float("nan"), THINGS, "nan.*at least"),
        ("guitar", 5.0, {}, "guitar"),
        ("drinking", 5.0, {"cup": lambda rng: Thing("mug", block((1, 1, 1)))}, "mug.*handle"),
    ],
)
def test_what_cannot_be_performed_is_named(people, name, duration_s, things, says):
    with pytest.raises(SceneError, match=says):
        act(name, people[0], np.random.default_rng(0), duration_s, things)

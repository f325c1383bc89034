# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import DatasetError
from kintrack.joints import JOINT_NAMES
from synthesis.dataset.recipes import RECIPES, held_out_clips, takes_of, training_clips
from synthesis.motions.actions import HELD_OUT_ACTIONS, HOLDING_ACTIONS, SITTING_ACTIONS
from synthesis.motions.mocap import HELD_OUT
from synthesis.people.population import held_out_people, training_people


@pytest.fixture(scope="module")
def mocap(tmp_path_factory):
    """Clips with names of real ones: two that train, two held out; one of each is short."""
    folder = tmp_path_factory.mktemp("mocap")
    lengths = {"cmu_01_01": 500, "cmu_02_01": 40, HELD_OUT[0]: 500, HELD_OUT[1]: 40}
    for name, frames in lengths.items():
        positions = np.zeros((frames, len(JOINT_NAMES), 3))
        np.savez(
            folder / f"{name}.npz",
            joint_positions_m=positions,
            joint_names=np.array(JOINT_NAMES),
            rate_hz=np.array(30.0),
        )
    return folder


def test_the_papers_set_has_its_sizes():
    takes = takes_of("paper", 0, None)
    count = {part: [t for t in takes if t.part == part] for part in ("train", "test", "objects")}
    assert [len(found) for found in count.values()] == [28, 4, 7]
    assert len({t.person for t in takes}) == 8
    assert all(t.frames == 300 and t.sensor == "kinect_v2" and t.room for t in takes)
    assert len({t.person for t in count["test"]}) == 2


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("recipe", ["paper", "training", "arms", "sofas"])
def test_nothing_held_out_is_trained_on(recipe, seed, mocap):
    for take in takes_of(recipe, seed, mocap):
        if take.part in ("train", "objects"):
            assert take.person in training_people()
            assert take.action not in (*HELD_OUT_ACTIONS, *HELD_OUT)
            assert not take.held_out_things
        else:
            assert take.person in held_out_people()
            assert take.action in (*HELD_OUT_ACTIONS, *HELD_OUT)


def test_the_bench_holds_out_people_motions_and_objects(mocap):
    takes = takes_of("bench", 0, mocap)
    assert all(take.person in held_out_people() for take in takes)
    assert all(take.action in (*HELD_OUT_ACTIONS, *HELD_OUT) for take in takes)
    assert all(take.held_out_things for take in takes)


def test_the_bench_shows_each_motion_alone_and_in_a_room():
    takes = takes_of("bench", 0, None)
    alone = {t.name: t for t in takes if t.part == "alone"}
    room = {t.name: t for t in takes if t.part == "room"}
    assert alone.keys() == room.keys()
    assert all((alone[n].seed, alone[n].person) == (room[n].seed, room[n].person) for n in alone)
    assert all(room[n].room and not alone[n].room for n in alone)


def test_training_takes_differ_and_cover_every_sensor_and_motion(mocap):
    takes = takes_of("training", 0, mocap, 30_000)
    assert sum(take.frames for take in takes) == 30_000
    assert len({take.seed for take in takes}) == len(takes)
    assert len({take.sensor for take in takes}) == 5
    assert "cmu_01_01" in {take.action for take in takes}


def test_arms_roam_in_takes_of_their_own_and_hold_nothing_of_the_actions(mocap):
    takes = takes_of("arms", 0, mocap, 3_000)
    assert all(take.roaming_arms for take in takes)
    assert not {take.action for take in takes} & set(HOLDING_ACTIONS)
    others = takes_of("training", 0, mocap, 3_000)
    assert not any(take.roaming_arms for take in others)
    assert {take.seed for take in takes}.isdisjoint(take.seed for take in others)


def test_everybody_sits_on_a_sofa_and_some_let_their_arms_roam():
    takes = takes_of("sofas", 0, None, 2_000)
    assert all(take.on_sofa and take.action in SITTING_ACTIONS for take in takes)
    assert 0.25 < np.mean([take.roaming_arms for take in takes]) < 0.55
    assert not any(take.on_sofa for take in takes_of("training", 0, None, 2_000))


def test_clips_shorter_than_a_take_are_left_out(mocap):
    assert training_clips(mocap, 100) == ["cmu_01_01"]
    assert held_out_clips(mocap, 100) == [HELD_OUT[0]]
    assert training_clips(None, 100) == []


@pytest.mark.parametrize("recipe", RECIPES)
def test_seeds_draw_other_takes_and_equal_seeds_the_same(recipe):
    assert takes_of(recipe, 1, None, 40) == takes_of(recipe, 1, None, 40)
    assert takes_of(recipe, 1, None, 40) != takes_of(recipe, 2, None, 40)


def test_unknown_recipes_and_empty_lengths_are_refused():
    with pytest.raises(DatasetError, match="paper, training, arms, sofas, bench"):
        takes_of("papre", 0, None)
    with pytest.raises(DatasetError, match="frames = 0"):
        takes_of("paper", 0, None, 0)

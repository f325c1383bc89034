# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from deformation.folded import (
    CONFIG,
    FOLD_M,
    fold_of,
    labels_of,
    learnt,
    seen,
    towards_camera,
    wearing,
)
from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.deformation.relief import relief_of
from kintrack.deformation.surface import met
from kintrack.skin import skinned_vertices


@pytest.fixture(scope="module")
def fold(human):
    return fold_of(human)


@pytest.fixture(scope="module")
def pose(scene):
    return scene.place()


@pytest.fixture(scope="module")
def observation(scene, human, fold, pose):
    folded = wearing(human, fold)
    return seen(scene, pose, folded, labels_of(scene, pose, folded))


@pytest.fixture(scope="module")
def state(human, pose):
    return run_kinematics(human.body, pose)


@pytest.fixture(scope="module")
def surface(human, observation, state):
    return learnt(human, [observation] * 30, state)


def test_an_offset_moves_its_vertex_along_the_normal_in_any_pose(human, legal_pose):
    offsets = np.random.default_rng(0).uniform(-0.02, 0.02, len(human.skin.labels))
    relief = relief_of(human.body, human.skin)
    state = run_kinematics(human.body, legal_pose(3))
    moved = skinned_vertices(state, relief.raised(offsets)) - skinned_vertices(state, human.skin)
    expected = offsets[:, None] * relief.directions_world(state)
    assert np.abs(moved - expected).max() < 1e-12
    rigid = human.skin.weights.max(axis=1) == 1.0
    assert np.allclose(np.linalg.norm(moved[rigid], axis=1), np.abs(offsets[rigid]))


def test_a_fold_of_a_centimetre_is_recovered_within_millimetres(human, surface, fold, state):
    front = towards_camera(human, state)
    top = np.argmax(fold)
    assert front[top]
    assert surface.offsets_m[top] == pytest.approx(FOLD_M, abs=0.002)
    wrong = surface.offsets_m[front] - fold[front]
    assert np.sqrt(np.mean(wrong**2)) < 0.0015


def test_the_surface_of_the_pose_is_held_back(surface):
    most = surface.offsets_m.max()
    assert 0.2 * most < surface.pose_offsets_m.max() < 0.9 * most


def test_what_is_hidden_keeps_its_fold_and_moves_with_the_body(
    scene, human, surface, state, observation
):
    nothing = replace(observation, region=np.zeros_like(observation.region))
    later = learnt(human, [nothing] * 60, state, surface=surface, begin_s=1.0)
    top = np.argmax(surface.offsets_m)
    assert later.offsets_m[top] == pytest.approx(surface.offsets_m[top], abs=3e-4)
    turned = run_kinematics(human.body, scene.place(heading_deg=180.0))
    worn, bare = later.shown(human).skin, human.skin
    away = (skinned_vertices(turned, worn) - skinned_vertices(turned, bare))[top]
    assert away[0] > 0.8 * FOLD_M  # the chest looks away from the camera, along +x


def test_what_was_never_seen_stays_near_the_template(human, surface, state):
    vertices = skinned_vertices(state, human.skin)
    back = vertices[:, 0] > vertices[:, 0].mean() + 0.08
    assert back.sum() > 100
    assert np.abs(surface.offsets_m[back]).max() < 0.003


def test_offsets_stay_within_their_bounds(scene, human, pose, state):
    thick = wearing(human, np.full(len(human.skin.labels), 0.03))
    config = replace(CONFIG, outward_m=0.012, inward_m=0.005)
    out = learnt(human, [seen(scene, pose, thick)] * 20, state, config)
    assert out.offsets_m.max() == 0.012
    thin = wearing(human, np.full(len(human.skin.labels), -0.02))
    out = learnt(human, [seen(scene, pose, thin)] * 20, state, config)
    assert out.offsets_m.min() == -0.005


def test_pixels_of_another_part_teach_nothing(scene, human, fold, pose, state):
    folded = wearing(human, fold)
    labels = labels_of(scene, pose, folded)
    wrong = np.where(labels == 2, 3, labels).astype(np.uint8)
    taught = learnt(human, [seen(scene, pose, folded, wrong)] * 10, state)
    assert np.abs(taught.offsets_m[np.argmax(fold)]) < 0.001


def test_something_in_front_of_the_body_is_not_taken_for_clothes(scene, human, pose, state):
    depth = scene.depth(pose, human)
    depth[depth > 0] -= 0.10
    taught = learnt(human, [observe(scene.frame(depth), 320)] * 10, state)
    assert not taught.offsets_m.any()


def test_a_frozen_surface_no_longer_changes(human, observation, state):
    config = replace(CONFIG, freeze_after_s=0.3)
    early = learnt(human, [observation] * 10, state, config)
    nothing = learnt(human, [observation] * 5, state, replace(CONFIG, freeze_after_s=0.0))
    assert early.offsets_m.max() > 0.002
    late = learnt(human, [observation] * 20, state, config, early, 1.0)
    assert np.array_equal(late.offsets_m, early.offsets_m)
    assert not nothing.offsets_m.any()


def test_the_person_who_is_found_again_wears_the_same_unless_it_is_to_be_forgotten(human, surface):
    again = surface.fitted(human)
    assert met(surface, again, CONFIG) is surface
    forgotten = met(surface, again, replace(CONFIG, reset_when_lost=True))
    assert not forgotten.offsets_m.any() and not forgotten.H.any()
    assert forgotten.relief is surface.relief
    assert not met(surface, human, CONFIG).offsets_m.any()
    assert met(None, human, replace(CONFIG, enabled=False)) is None


def test_the_same_frames_give_the_same_bits(human, surface, observation, state):
    again = learnt(human, [observation] * 30, state)
    assert again.offsets_m.tobytes() == surface.offsets_m.tobytes()
    assert again.pose_offsets_m.tobytes() == surface.pose_offsets_m.tobytes()

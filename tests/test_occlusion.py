# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from kintrack.alignment import view_skin
from kintrack.association.observation import observe
from kintrack.body import run_kinematics
from kintrack.config import OcclusionConfig, TrackerConfig
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid
from kintrack.occlusion import hidden_hinges

CONFIG = OcclusionConfig()


@pytest.fixture(scope="module")
def hidden_by(human, scene):
    """A function of the rows that a board covers: names of the hidden hinges."""
    q = scene.place()
    person = scene.depth(q)
    state = run_kinematics(human.body, q)

    def look(rows, labelled=True):
        depth = np.where(person > 0, person, 4.0).astype(np.float32)
        labels = np.where(person > 0, 2, 0).astype(np.uint8)
        depth[rows], labels[rows] = 1.5, 0
        seen = observe(scene.frame(depth), 320, labels=labels if labelled else None)
        view = view_skin(human, state, invert_rigid(T_LEVEL_WORLD_CAMERA), seen, TrackerConfig())
        one_part = replace(view, labels=np.full_like(view.labels, 2))
        hinges = hidden_hinges(human, one_part, seen, CONFIG)
        assert not hinges[:6].any()
        return {n for n in list(human.body.model.names)[2:] if hinges[human.body.dof(n)]}

    return look


def test_nothing_is_hidden_in_plain_view(hidden_by):
    assert hidden_by(slice(0, 0)) == set()


def test_a_board_before_the_legs_hides_knees_and_ankles_but_no_arm(hidden_by):
    hidden = hidden_by(slice(150, 240))
    assert {"l_knee_flexion", "r_knee_flexion", "l_ankle_dorsiflexion"} <= hidden
    assert not {name for name in hidden if "elbow" in name or "shoulder" in name or "neck" in name}


def test_without_labels_nothing_is_known_to_be_hidden(hidden_by):
    assert hidden_by(slice(150, 240), labelled=False) == set()


def test_a_person_behind_a_wall_is_hidden_altogether(hidden_by, human):
    assert len(hidden_by(slice(0, 240))) == human.body.nv - 6

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.errors import ConfigError, DatasetError
from kintrack.human import leg_hinges, load_human
from kintrack.objective_config import PriorConfig
from kintrack.residuals.pose_prior import STANCE, hinge_names, load_leg_prior
from synthesis.motions import habits
from synthesis.motions.actions import HELD_OUT_ACTIONS
from synthesis.motions.habits import HabitsConfig, learn_habits, mirrored

SMALL = HabitsConfig(components=2, performances=1)


@pytest.fixture(scope="module")
def names():
    body = load_human().body
    return (*STANCE, *np.array(hinge_names(body))[leg_hinges(body)[6:]])


def test_the_mirror_image_of_a_mirror_image_is_the_posture(names):
    postures = np.random.default_rng(0).normal(size=(5, len(names)))
    assert (mirrored(mirrored(postures, names), names) == postures).all()
    once = dict(zip(names, mirrored(postures, names)[0], strict=True))
    here = dict(zip(names, postures[0], strict=True))
    assert once["l_knee_flexion"] == here["r_knee_flexion"]
    assert once["tilt_left"] == -here["tilt_left"]
    assert once["tilt_forward"] == here["tilt_forward"] and once["height"] == here["height"]


def test_what_is_learnt_is_read_and_the_same_seed_learns_the_same(tmp_path, monkeypatch):
    pytest.importorskip("sklearn")
    monkeypatch.setattr(habits, "training_actions", lambda: ("standing", "squatting"))
    seen = []
    for name in ("a.npz", "b.npz"):
        learn_habits(tmp_path / name, None, SMALL, lambda done, total: seen.append((done, total)))
    assert seen[:2] == [(1, 2), (2, 2)]
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    (tmp_path / "a.npz").rename(tmp_path / "pose_prior.npz")
    prior = load_leg_prior(load_human().body, PriorConfig(), tmp_path)
    assert len(prior.weights) == 4


def test_held_out_motions_are_not_learnt_from():
    assert not set(habits.training_actions()) & set(HELD_OUT_ACTIONS)


def test_bad_sizes_and_too_few_postures_are_named(tmp_path, monkeypatch):
    with pytest.raises(ConfigError, match="components"):
        HabitsConfig(components=0)
    pytest.importorskip("sklearn")
    monkeypatch.setattr(habits, "training_actions", lambda: ())
    with pytest.raises(DatasetError, match="no motion"):
        learn_habits(tmp_path / "a.npz", None, SMALL)
    assert not list(tmp_path.iterdir())

# SPDX-License-Identifier: Apache-2.0
"""Somebody's own recordings: what is held out, what is mixed in, how long training takes."""

import numpy as np
import pytest
from training_data import record

from kintrack.errors import ConfigError, DatasetError
from segmentation.architecture import NetworkConfig
from segmentation.dataset import everything
from segmentation.pack import pack
from segmentation.recordings import (
    TuningConfig,
    divide,
    divided,
    mixed,
    split_others,
    tuning_config,
)
from segmentation.training_config import TrainConfig
from segmentation.weights import Weights

TINY = NetworkConfig("fast_fcn", (4, 6, 8, 8))


def test_people_are_held_out_whole():
    frames = {f"{person}{n}": 5 for person in "abcde" for n in range(3)}
    found = divide(frames, {name: name[0] for name in frames}, 0.2)
    assert found.by == "people" and not found.caution
    assert len({name[0] for name in found.held}) == 1 and len(found.held) == 3
    assert {name[0] for name in found.train}.isdisjoint(name[0] for name in found.held)
    assert divide(frames, {name: name[0] for name in frames}, 0.2) == found


def test_recordings_are_held_out_where_people_are_unknown():
    found = divide({name: 5 for name in "abcdef"}, {}, 0.3)
    assert found.by == "recordings" and len(found.held) == 2 and len(found.train) == 4
    assert "not people" in found.caution
    same = divide({name: 5 for name in "ab"}, {"a": "ann", "b": "ann"}, 0.3)
    assert same.by == "recordings" and "ann both trained and was held out" in same.caution


def test_a_choice_that_leaves_one_side_empty_is_named():
    with pytest.raises(DatasetError, match="is left to train on"):
        divide({"a": 5, "b": 5}, {}, 0.2, {"a", "b"})
    with pytest.raises(DatasetError, match="is held out"):
        divide({"a": 5, "b": 0, "c": 4}, {}, 0.2, {"b"})


def test_a_single_recording_is_cut_in_time_with_a_caution(tmp_path):
    found = divide({"a": 60}, {}, 0.2)
    assert found.by == "time" and "one recording only" in found.caution
    record(tmp_path / "a", frames=60)
    pack(tmp_path / "a", tmp_path / ".pack")
    both = divided({"a": tmp_path / ".pack"}, found, 0.2)
    assert both.validation.where[:, 2].tolist() == list(range(48, 60))
    assert both.train.where[:, 2].tolist() == list(range(33))
    most = divided({"a": tmp_path / ".pack"}, found, 0.9)
    assert most.train.where[:, 2].tolist() == list(range(10))
    assert most.validation.where[:, 2].tolist() == list(range(25, 60))
    with pytest.raises(DatasetError, match="30 usable frames of one recording.*second recording"):
        divide({"a": 30}, {}, 0.2)


def test_half_of_the_mixture_is_ones_own(tmp_path):
    for name, frames in (("a", 2), ("b", 7)):
        record(tmp_path / name, frames=frames)
        pack(tmp_path / name, tmp_path / f".{name}")
    own, other = everything([tmp_path / ".a"]), everything([tmp_path / ".b"])
    both = mixed(own, other)
    assert np.bincount(both.where[:, 0]).tolist() == [8, 7]
    assert (both[8].labels == other[0].labels).all() and (both[1].labels == own[1].labels).all()
    assert np.bincount(mixed(other, own).where[:, 0]).tolist() == [7, 8]
    train, kept_apart = split_others([tmp_path / ".b"], TrainConfig())
    assert len(train) == 7 and kept_apart is None


def test_fine_tuning_has_its_own_length_and_rate():
    start = Weights(TINY, {})
    config = tuning_config(TrainConfig(), TuningConfig(minutes=30, rate=1e-4), start)
    assert (config.hours, config.rate, config.network) == (0.5, 1e-4, TINY)
    assert config.warmup_steps <= 20 and config.validation_steps <= 100
    for name, value in (("hours", 1.0), ("rate", 0.1)):
        with pytest.raises(ConfigError, match=rf"{name} = .*--tuning"):
            tuning_config(TrainConfig(**{name: value}), TuningConfig(), start)
    with pytest.raises(ConfigError, match="held_out"):
        TuningConfig(held_out=1.0)

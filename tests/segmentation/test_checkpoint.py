# SPDX-License-Identifier: Apache-2.0
"""Checkpoints: whole or not taken."""

import numpy as np
import pytest

from segmentation.checkpoint import Checkpoint, latest_checkpoint, load_checkpoint, save_checkpoint
from segmentation.errors import WeightsError


def state(step, value=1.0):
    tensors = {"network.a": np.full((3, 4), value, np.float32), "optimiser.a.step": np.array(5.0)}
    return Checkpoint(step, tensors, {"elapsed_s": 0.1 + step, "losses": [0.3, 1 / 3]})


def test_what_is_written_is_what_is_read(tmp_path):
    found = load_checkpoint(save_checkpoint(tmp_path, state(7)))
    assert found.step == 7 and found.facts["losses"] == [0.3, 1 / 3]
    assert found.facts["elapsed_s"] == 7.1
    for name, tensor in state(7).tensors.items():
        assert (found.tensors[name] == tensor).all() and found.tensors[name].dtype == tensor.dtype


def test_the_newest_two_are_kept(tmp_path):
    for step in (5, 10, 200):
        save_checkpoint(tmp_path, state(step))
    assert [int(p.stem.split("-")[1]) for p in sorted(tmp_path.iterdir())] == [10, 200]
    assert latest_checkpoint(tmp_path).step == 200


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_one_that_is_cut_off_is_passed_over_with_a_warning(tmp_path, share):
    save_checkpoint(tmp_path, state(5))
    path = save_checkpoint(tmp_path, state(10))
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.warns(UserWarning, match="00000010.* is no whole checkpoint.*from checkpoint-0"):
        assert latest_checkpoint(tmp_path).step == 5


def test_one_with_a_changed_bit_is_passed_over(tmp_path):
    save_checkpoint(tmp_path, state(5))
    path = save_checkpoint(tmp_path, state(10))
    content = bytearray(path.read_bytes())
    content[-3] ^= 1
    path.write_bytes(content)
    with pytest.warns(UserWarning, match="checksum"):
        assert latest_checkpoint(tmp_path).step == 5


def test_a_new_one_outlives_a_broken_later_one(tmp_path):
    save_checkpoint(tmp_path, state(5))
    (tmp_path / "checkpoint-00000010.safetensors").write_bytes(b"half")
    (tmp_path / "checkpoint-00000020.safetensors").write_bytes(b"half")
    save_checkpoint(tmp_path, state(8))
    assert latest_checkpoint(tmp_path).step == 8
    assert [p.stem[-2:] for p in sorted(tmp_path.iterdir())] == ["05", "08"]


def test_a_bad_state_replaces_no_good_one(tmp_path):
    before = save_checkpoint(tmp_path, state(5)).read_bytes()
    with pytest.raises(WeightsError, match="network.a holds NaN"):
        save_checkpoint(tmp_path, state(5, np.nan))
    assert [p.read_bytes() for p in tmp_path.iterdir()] == [before]


def test_if_none_is_whole_it_says_so(tmp_path):
    assert latest_checkpoint(tmp_path) is None
    (tmp_path / "checkpoint-00000010.safetensors").write_bytes(b"half")
    with pytest.raises(WeightsError, match="no whole checkpoint.*remove them"):
        latest_checkpoint(tmp_path)

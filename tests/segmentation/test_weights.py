# SPDX-License-Identifier: Apache-2.0
"""Weights files: what is written comes back, what is broken is named."""

import json
from dataclasses import replace

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load, save

from segmentation.architecture import NetworkConfig
from segmentation.errors import WeightsError
from segmentation.weights import ENTRY, load_weights, save_weights


@pytest.fixture
def path(slim, tmp_path):
    path = tmp_path / "w.safetensors"
    save_weights(path, slim)
    return path


def rewrite(path, tensors=None, **changed):
    """Change entries of a file without the checks of `save_weights`."""
    with safe_open(path, framework="numpy") as file:
        facts = json.loads(file.metadata()[ENTRY]) | changed
    held = load(path.read_bytes()) | (tensors or {})
    held = {name: tensor for name, tensor in held.items() if tensor is not None}
    path.write_bytes(save(held, {ENTRY: json.dumps(facts)}))


def test_full_precision_comes_back_bit_for_bit(slim, tmp_path):
    save_weights(tmp_path / "w", slim, "float32")
    again = load_weights(tmp_path / "w")
    assert again.config == slim.config and again.training == slim.training
    assert again.tensors.keys() == slim.tensors.keys()
    assert all((again.tensors[name] == slim.tensors[name]).all() for name in slim.tensors)
    assert again.ranges == pytest.approx({k: pytest.approx(v) for k, v in slim.ranges.items()})


def test_half_precision_takes_half_the_room_and_rounds(slim, path, tmp_path):
    save_weights(tmp_path / "full", slim, "float32")
    assert path.stat().st_size < 0.6 * (tmp_path / "full").stat().st_size
    again = load_weights(path)
    for name, tensor in slim.tensors.items():
        assert again.tensors[name].dtype == np.float32
        assert np.allclose(again.tensors[name], tensor, rtol=1e-3, atol=1e-7)


def test_the_same_weights_make_the_same_bytes(slim, path, tmp_path):
    save_weights(tmp_path / "again", slim)
    assert (tmp_path / "again").read_bytes() == path.read_bytes()


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(WeightsError, match="no weights file .*nothing.safetensors"):
        load_weights(tmp_path / "nothing.safetensors")


@pytest.mark.parametrize("share", [0.0, 0.001, 0.5, 0.999])
def test_a_file_cut_off_is_named(path, share):
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(WeightsError, match="w.safetensors is no whole weights file"):
        load_weights(path)


def test_a_file_of_another_kind_is_named(tmp_path):
    path = tmp_path / "w.safetensors"
    path.write_bytes(save({"a": np.zeros(3)}))
    with pytest.raises(WeightsError, match="not those of kintrack's part segmentation"):
        load_weights(path)


def test_another_label_set_is_named(path):
    rewrite(path, labels=["background", "person"])
    with pytest.raises(WeightsError, match=r"labels = \['background', 'person'\]; .*left_leg"):
        load_weights(path)


def test_another_kind_of_input_is_named(path):
    rewrite(path, input="RGBD 64x53")
    with pytest.raises(WeightsError, match="input = RGBD 64x53; RGBD 128x106"):
        load_weights(path)


def test_an_architecture_that_is_not_wanted_is_named(path):
    with pytest.raises(WeightsError, match="holds fast_fcn weights, unet ones are needed"):
        load_weights(path, "unet")


@pytest.mark.parametrize("entry", [{"architecture": "segnet"}, {"widths": 8}, {"widths": [8]}])
def test_a_network_that_cannot_be_is_named(path, entry):
    rewrite(path, **entry)
    with pytest.raises(WeightsError, match="does not say which network it is for"):
        load_weights(path)


def test_tensors_of_another_network_are_named(path):
    rewrite(path, architecture="unet", widths=[8, 16, 24, 32, 40], reach=1)
    with pytest.raises(WeightsError, match=r"no down1a.bias, .*which .*unet"):
        load_weights(path)


def test_tensors_of_other_widths_are_named(path):
    rewrite(path, widths=[8, 16, 24, 64])
    with pytest.raises(WeightsError, match=r"middle1.weight .*\(32, 24.*\(64, 24"):
        load_weights(path)


def test_weights_written_before_there_was_a_reach_have_none(path):
    with safe_open(path, framework="numpy") as file:
        facts = json.loads(file.metadata()[ENTRY])
    del facts["reach"]
    path.write_bytes(save(load(path.read_bytes()), {ENTRY: json.dumps(facts)}))
    assert load_weights(path).config.reach == 1


def test_a_reach_that_makes_no_network_is_refused(path):
    rewrite(path, reach=9)
    with pytest.raises(WeightsError, match="reach = 9"):
        load_weights(path)


@pytest.mark.parametrize("name", ["extra", "logits.bias"])
def test_a_tensor_too_many_or_too_few_is_named(path, name):
    rewrite(path, tensors={name: np.zeros(3, np.float32) if name == "extra" else None})
    with pytest.raises(WeightsError, match=name):
        load_weights(path)


def test_nan_is_named_with_its_tensor(path):
    rewrite(path, tensors={"up2.bias": np.full(16, np.nan, np.float32)})
    with pytest.raises(WeightsError, match="up2.bias holds NaN"):
        load_weights(path)


@pytest.mark.parametrize("ends", [[0.0, np.nan], [1.0, 2.0], [0.0, 0.0], [1.0]])
def test_an_int8_range_that_is_none_is_named(path, ends):
    rewrite(path, tensors={"quant.up2": np.array(ends, np.float32)})
    with pytest.raises(WeightsError, match="int8 range of up2"):
        load_weights(path)


@pytest.mark.parametrize("value", [np.nan, 1e6])
def test_weights_that_cannot_be_kept_do_not_replace_good_ones(slim, path, value):
    before = path.read_bytes()
    bad = slim.tensors | {"up1.bias": np.full(8, value, np.float32)}
    with pytest.raises(WeightsError, match="w.safetensors was not written: .*up1.bias holds NaN"):
        save_weights(path, replace(slim, tensors=bad))
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_weights_of_another_network_are_not_written(slim, tmp_path):
    with pytest.raises(WeightsError, match="was not written"):
        save_weights(tmp_path / "w", replace(slim, config=NetworkConfig("unet")))
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_not_there_is_named(slim, tmp_path):
    with pytest.raises(WeightsError, match="cannot be written"):
        save_weights(tmp_path / "none" / "w", slim)


def test_an_unknown_precision_is_named(slim, tmp_path):
    with pytest.raises(WeightsError, match="'int4': float16, float32"):
        save_weights(tmp_path / "w", slim, "int4")

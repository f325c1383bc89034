# SPDX-License-Identifier: Apache-2.0
"""What training meets that is broken is named, and nothing good is lost by it."""

import json
import os
import shutil

import cv2
import numpy as np
import pytest
from training_data import record, squares

torch = pytest.importorskip("torch")

from safetensors import safe_open  # noqa: E402
from safetensors.numpy import load, save  # noqa: E402
from small_networks import random_weights  # noqa: E402

from kintrack.commands.train import Train  # noqa: E402
from kintrack.errors import DatasetError  # noqa: E402
from segmentation.architecture import NetworkConfig  # noqa: E402
from segmentation.augment.bank import BankConfig  # noqa: E402
from segmentation.augment.sample import Bank  # noqa: E402
from segmentation.checkpoint import (  # noqa: E402
    Checkpoint,
    latest_checkpoint,
    load_checkpoint,
    save_checkpoint,
)
from segmentation.dataset import split  # noqa: E402
from segmentation.errors import SegmentationError, WeightsError  # noqa: E402
from segmentation.learner import Learner  # noqa: E402
from segmentation.pack import pack  # noqa: E402
from segmentation.train import train  # noqa: E402
from segmentation.training_config import TrainConfig  # noqa: E402
from segmentation.weights import ENTRY, load_weights, save_weights  # noqa: E402

TINY = TrainConfig(
    network=NetworkConfig("fast_fcn", (4, 6, 8, 8)), steps=6, batch=2, precision="fp32",
    device="cpu", workers=0, validation_steps=100, validation_frames=2, log_steps=1,
    checkpoint_minutes=0.0, bank=BankConfig(0, 0),
)  # fmt: skip


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    root = tmp_path_factory.mktemp("bad")
    for n in range(2):
        record(root / f"r{n}", frames=2, seed=n)
    pack(root, root / ".pack")
    return split([root / ".pack"], 0.3)


@pytest.mark.parametrize("what", ["weights", "average", "moments"])
def test_a_network_that_runs_away_costs_no_good_checkpoint(data, tmp_path, monkeypatch, what):
    (tmp_path / "weights.safetensors").write_bytes(b"of an earlier run")
    step = Learner.step

    def poisoned(self, images, labels, rate, number):
        loss = step(self, images, labels, rate, number)
        if number == 3:
            state = {"weights": self.network.up1.bias, "average": self.average.up1.bias,
                     "moments": self.optimiser.state[self.network.up1.bias]["exp_avg"]}  # fmt: skip
            with torch.no_grad():
                state[what].fill_(torch.nan)
        return loss

    monkeypatch.setattr(Learner, "step", poisoned)
    with pytest.raises(SegmentationError, match="NaN"):
        train(TINY, data, Bank(squares()), tmp_path)
    last = latest_checkpoint(tmp_path)
    assert last is not None and last.step == 3
    assert all(np.isfinite(tensor).all() for tensor in last.tensors.values())
    assert (tmp_path / "weights.safetensors").read_bytes() == b"of an earlier run"


def full(*_):
    raise OSError(28, "No space left on device")


def test_a_full_disk_costs_no_good_checkpoint(tmp_path, monkeypatch):
    tensors = {"network.a": np.ones(3, np.float32)}
    before = save_checkpoint(tmp_path, Checkpoint(5, tensors, {}))
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(WeightsError, match="00000009.safetensors cannot be written.*No space"):
        save_checkpoint(tmp_path, Checkpoint(9, tensors, {}))
    assert [path.name for path in tmp_path.iterdir()] == [before.name]
    assert load_checkpoint(before).step == 5


def test_a_full_disk_costs_no_good_weights(tmp_path, monkeypatch):
    path = tmp_path / "w.safetensors"
    save_weights(path, random_weights(TINY.network))
    before = path.read_bytes()
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(WeightsError, match="cannot be written.*No space"):
        save_weights(path, random_weights(TINY.network, seed=3))
    assert path.read_bytes() == before and len(list(tmp_path.iterdir())) == 1


def test_images_of_a_wrong_size_are_left_out_and_counted(tmp_path):
    record(tmp_path / "a", frames=3)
    path = sorted((tmp_path / "a/depth").glob("*.png"))[1]
    cv2.imwrite(str(path), np.full((48, 64), 2000, np.uint16))
    (entry,) = pack(tmp_path / "a", tmp_path / ".pack")
    assert (entry.frames, entry.skipped) == (2, 1)


def test_a_recording_of_nothing_but_wrong_images_is_named(tmp_path):
    record(tmp_path / "a", frames=2)
    for path in (tmp_path / "a/depth").glob("*.png"):
        cv2.imwrite(str(path), np.full((48, 64), 2000, np.uint16))
    with pytest.raises(DatasetError, match="none of 1 recordings has a frame with depth and a"):
        pack(tmp_path / "a", tmp_path / ".pack")


def test_labels_of_another_aspect_are_named_with_their_file(tmp_path):
    record(tmp_path / "a", frames=2)
    path = sorted((tmp_path / "a/labels").glob("*.png"))[1]
    cv2.imwrite(str(path), np.ones((64, 48), np.uint8))
    with pytest.raises(DatasetError, match=rf"{path.name}.*48x64"):
        pack(tmp_path / "a", tmp_path / ".pack")


def rewritten(path, **facts):
    with safe_open(path, framework="numpy") as file:
        said = json.loads(file.metadata()[ENTRY]) | facts
    path.write_bytes(save(load(path.read_bytes()), {ENTRY: json.dumps(said)}))


@pytest.mark.parametrize(
    ("facts", "words"),
    [({"labels": ["background", "person"]}, "labels = .*'person'.* is needed"),
     ({"input": "RGBD 64x53"}, "input = RGBD 64x53"),
     ({"architecture": "unet", "widths": [4, 6, 8, 8, 8], "reach": 1},
       "unet weights, fast_fcn ones are")],
)  # fmt: skip
def test_start_weights_that_do_not_fit_are_named_before_any_work(tmp_path, facts, words):
    record(tmp_path / "a", frames=2)
    path = tmp_path / "w.safetensors"
    save_weights(path, random_weights(TINY.network))
    rewritten(path, **facts)
    with pytest.raises(WeightsError, match=words):
        Train((tmp_path / "a",), tmp_path / "run", start=path, config=TINY).run()
    assert not (tmp_path / "run").exists()


def test_a_run_whose_checkpoints_are_all_cut_in_half_stops_and_touches_nothing(data, tmp_path):
    train(TINY, data, Bank(squares()), tmp_path)
    shutil.copy(tmp_path / "weights.safetensors", tmp_path / "kept")
    for path in tmp_path.glob("checkpoint-*"):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    with pytest.raises(WeightsError, match="no whole checkpoint.*remove them to begin anew"):
        train(TINY, data, Bank(squares()), tmp_path)
    assert (tmp_path / "weights.safetensors").read_bytes() == (tmp_path / "kept").read_bytes()
    assert load_weights(tmp_path / "weights.safetensors").training["steps"] == 6

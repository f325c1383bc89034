# SPDX-License-Identifier: Apache-2.0
"""Training: learning, stopping, going on."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from training_data import record, squares

torch = pytest.importorskip("torch")

from kintrack.commands.train import Train  # noqa: E402
from kintrack.errors import DatasetError  # noqa: E402
from segmentation.architecture import NetworkConfig  # noqa: E402
from segmentation.augment.bank import BankConfig  # noqa: E402
from segmentation.augment.sample import AugmentConfig, Bank  # noqa: E402
from segmentation.dataset import Batches, Shuffled, Split, everything, split  # noqa: E402
from segmentation.errors import SegmentationError, WeightsError  # noqa: E402
from segmentation.labels import LABELS  # noqa: E402
from segmentation.learner import Learner, check_finite, join_group  # noqa: E402
from segmentation.pack import pack  # noqa: E402
from segmentation.train import train, validate  # noqa: E402
from segmentation.training_config import TrainConfig  # noqa: E402
from segmentation.weights import load_weights  # noqa: E402

BANK = Bank(squares())
TINY = TrainConfig(
    network=NetworkConfig("fast_fcn", (4, 6, 8, 8)), steps=8, batch=2, precision="fp32",
    device="cpu", workers=0, validation_steps=4, validation_frames=2, log_steps=3,
    checkpoint_minutes=0.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    root = tmp_path_factory.mktemp("training")
    for n in range(3):
        record(root / f"r{n}", frames=2, seed=n)
    pack(root, root / ".pack")
    return split([root / ".pack"], 0.3)


@pytest.fixture(scope="module")
def whole_run(data, tmp_path_factory):
    output = tmp_path_factory.mktemp("run")
    train(TINY, data, BANK, output, {"command": "kintrack train"})
    return output


def log_of(output):
    lines = (output / "log.jsonl").read_text().splitlines()
    return [{k: v for k, v in json.loads(line).items() if k != "seconds"} for line in lines]


def test_a_run_leaves_weights_that_load_with_their_facts(whole_run):
    weights = load_weights(whole_run / "weights.safetensors")
    assert weights.config == TINY.network and weights.ranges
    assert weights.training["steps"] == 8 and weights.training["command"] == "kintrack train"
    assert set(LABELS[1:]) <= set(weights.training["validation"])
    assert weights.training["config"]["augment"]["inserted"] == AugmentConfig().inserted
    assert (whole_run / "curves.png").stat().st_size > 5000


def test_the_log_has_losses_and_validations(whole_run):
    entries = log_of(whole_run)
    assert [entry["step"] for entry in entries] == [3, 4, 6, 8]
    assert all(entry["loss"] > 0 for entry in entries if entry["step"] % 3 == 0)
    assert "non_background_iou" in entries[1]["validation"]


class Killed(Exception):
    pass


def killed_after(step):
    def look(progress):
        if progress.step == step:
            raise Killed

    return look


@pytest.mark.parametrize("minutes", [0.0, 1e-3])
def test_a_run_that_was_killed_ends_with_the_same_bits(data, whole_run, tmp_path, minutes):
    config = replace(TINY, checkpoint_minutes=minutes)
    with pytest.raises(Killed):
        train(
            config, data, BANK, tmp_path, {"command": "kintrack train"}, on_progress=killed_after(5)
        )
    train(config, data, BANK, tmp_path, {"command": "kintrack train"})
    ours, theirs = (load_weights(p / "weights.safetensors") for p in (tmp_path, whole_run))
    for name, tensor in theirs.tensors.items():
        assert (ours.tensors[name] == tensor).all()
    assert ours.ranges == theirs.ranges
    assert log_of(tmp_path) == log_of(whole_run)


def test_a_run_goes_on_from_the_checkpoint_before_one_cut_in_half(data, whole_run, tmp_path):
    with pytest.raises(Killed):
        train(TINY, data, BANK, tmp_path, on_progress=killed_after(6))
    newest = sorted(tmp_path.glob("checkpoint-*"))[-1]
    newest.write_bytes(newest.read_bytes()[: newest.stat().st_size // 2])
    steps = []
    with pytest.warns(UserWarning, match="no whole checkpoint"):
        train(TINY, data, BANK, tmp_path, on_progress=lambda p: steps.append(p.step))
    assert steps[0] == int(newest.stem.split("-")[1])
    ours, theirs = (load_weights(p / "weights.safetensors") for p in (tmp_path, whole_run))
    assert all((ours.tensors[k] == v).all() for k, v in theirs.tensors.items())


def test_ctrl_c_writes_a_checkpoint_first(data, tmp_path):
    config = replace(TINY, checkpoint_minutes=60.0)

    def interrupt(progress):
        if progress.step == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        train(config, data, BANK, tmp_path, on_progress=interrupt)
    assert [p.name for p in tmp_path.glob("checkpoint-*")] == ["checkpoint-00000002.safetensors"]
    steps = []
    train(config, data, BANK, tmp_path, on_progress=lambda p: steps.append(p.step))
    assert steps == [3, 4, 5, 6, 7, 8]


def test_the_command_packs_trains_and_says_what_it_learnt_from(tmp_path):
    for n in range(2):
        record(tmp_path / f"mine/r{n}", frames=2, seed=n)
    config = replace(TINY, steps=2, bank=BankConfig(0, 0))
    Train((tmp_path / "mine",), tmp_path / "run", config=config).run()
    weights = load_weights(tmp_path / "run/weights.safetensors")
    assert weights.training["data"] == ["mine"] and weights.training["steps"] == 2
    assert weights.training["training_pictures"] == 2
    (tmp_path / "none").mkdir()
    with pytest.raises(DatasetError, match="none holds no recording"):
        Train((tmp_path / "none",), tmp_path / "other", config=config).run()


def test_two_processes_train_one_network(tmp_path):
    for n in range(2):
        record(tmp_path / f"mine/r{n}", frames=2, seed=n)
    command = [str(Path(sys.executable).with_name("kintrack")), "train", "mine", "-o", "run"]
    options = ("--steps 2 --batch 2 --workers 0 --threads 1 --device cpu --precision fp32 "
               "--bank.cutouts 0 --bank.rooms 0 --network.widths 4 6 8 8").split()  # fmt: skip
    launch = [sys.executable, "-m", "torch.distributed.run", "--standalone", "--nproc-per-node"]
    done = subprocess.run(
        [*launch, "2", "--", *command, *options],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    training = load_weights(tmp_path / "run/weights.safetensors").training
    assert training["processes"] == 2 and training["steps"] == 2


def test_another_run_in_the_folder_is_named(data, whole_run):
    with pytest.raises(SegmentationError, match="its rate is 0.001, not 0.5; choose another"):
        train(replace(TINY, rate=0.5), data, BANK, whole_run)
    swapped = Split(data.validation, data.train)
    with pytest.raises(SegmentationError, match="another run: its data"):
        train(TINY, swapped, BANK, whole_run)


def test_a_worker_changes_no_batch(data):
    from segmentation.train import _loader

    group = join_group(TINY)
    batches = Batches(data.train, AugmentConfig(), BANK, 2, 0)
    found = []
    for images, labels in _loader(replace(TINY, workers=1), batches, 3, group):
        found.append((images.numpy(), labels.numpy()))
        if len(found) == 3:
            break
    for step, (images, labels) in enumerate(found, start=3):
        assert (batches[step][0] == images).all() and (batches[step][1] == labels).all()


def test_every_picture_comes_once_an_epoch_whatever_the_number_of_processes(data):
    single = Batches(data.train, None, BANK, 4, 0)
    pair = [Batches(data.train, None, BANK, 2, 0, rank, 2) for rank in (0, 1)]
    order, count = Shuffled(len(data.train), 0), len(data.train)
    epochs = [[order.at(count * epoch + n) for n in range(count)] for epoch in (0, 1)]
    assert sorted(epochs[0]) == sorted(epochs[1]) == [*range(count)] and epochs[0] != epochs[1]
    joined = np.concatenate([batches[1][0] for batches in pair])
    assert (joined == single[1][0]).all()


def test_a_small_network_learns_four_pictures_by_heart(data):
    pictures = everything(data.train.packs).spread(4)
    network = NetworkConfig("fast_fcn", (8, 8, 8, 12))
    config = replace(TINY, network=network, steps=150, rate=0.01, normalised=False)
    learner = Learner(config, join_group(config))
    images, labels = Batches(pictures, None, Bank(), 4, 0)[0]
    losses = []
    for step in range(config.steps):
        rate = config.rate_at(step, config.share(step, 0.0))
        batch = torch.from_numpy(images), torch.from_numpy(labels)
        losses.append(float(learner.step(*batch, rate, step)))
    assert losses[-1] < 0.1 * losses[0]
    assert validate(learner, pictures.spread(1)).non_background_iou > 0.9


def test_a_trained_network_can_begin_another_run_but_only_of_its_kind(data, whole_run):
    start = load_weights(whole_run / "weights.safetensors")
    learner = Learner(TINY, join_group(TINY), start)
    name = "network.down1.weight"
    assert (learner.tensors()[name] == start.tensors["down1.weight"]).all()
    with pytest.raises(WeightsError, match="cannot begin"):
        Learner(replace(TINY, network=NetworkConfig("unet")), join_group(TINY), start)


def test_the_learning_rate_rises_and_then_falls_to_its_end():
    config = TrainConfig(steps=1000, warmup_steps=50, rate=1e-3, final_rate=0.1)
    rates = [config.rate_at(step, config.share(step, 0.0)) for step in range(1001)]
    assert rates[0] < 3e-5 and max(rates) == pytest.approx(1e-3, rel=0.01)
    assert rates[-1] == pytest.approx(1e-4) and np.argmax(rates) == pytest.approx(50, abs=2)


def test_by_the_clock_the_share_is_that_of_the_time():
    config = TrainConfig(hours=0.5)
    assert config.share(10**6, 900.0) == 0.5 and config.share(0, 4000.0) == 1.0


def test_a_loss_that_is_no_number_is_named():
    with pytest.raises(SegmentationError, match="loss is nan at step 12"):
        check_finite(float("nan"), 12)


@pytest.mark.parametrize(
    ("values", "words"),
    [({"device": "tpu"}, "device = 'tpu': auto, cpu, cuda"), ({"precision": "int4"}, "int4"),
     ({"optimiser": "sgd"}, "muon, adamw, adam")],
)  # fmt: skip
def test_an_option_that_is_none_is_named(values, words):
    with pytest.raises(SegmentationError, match=words):
        TrainConfig(**values)

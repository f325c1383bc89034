# SPDX-License-Identifier: Apache-2.0
"""`kintrack train --from-recordings`: label, divide, fine-tune, compare, report."""

import json
import os
import signal
from dataclasses import replace

import cv2
import pytest
from training_data import figure, record, squares

torch = pytest.importorskip("torch")
pytest.importorskip("openvino")

from small_networks import random_weights  # noqa: E402

from kintrack.commands import tuning  # noqa: E402
from kintrack.commands.train import Train  # noqa: E402
from kintrack.errors import ConfigError, DatasetError, ResultError  # noqa: E402
from kintrack.labelling import several  # noqa: E402
from kintrack.labelling.sequence import Report  # noqa: E402
from kintrack.sequence.write import SequenceWriter  # noqa: E402
from segmentation import train as train_module  # noqa: E402
from segmentation import tuning_report  # noqa: E402
from segmentation.architecture import NetworkConfig  # noqa: E402
from segmentation.augment import bank as bank_module  # noqa: E402
from segmentation.augment.bank import BankConfig  # noqa: E402
from segmentation.augment.sample import Bank  # noqa: E402
from segmentation.errors import SegmentationError, WeightsError  # noqa: E402
from segmentation.training_config import TrainConfig  # noqa: E402
from segmentation.weights import load_weights, save_weights  # noqa: E402

DRAW = tuning_report.draw
TINY = NetworkConfig("fast_fcn", (4, 6, 8, 8))
QUICK = TrainConfig(steps=3, batch=2, precision="fp32", device="cpu", workers=0, log_steps=1,
                    validation_frames=2, bank=BankConfig(8, 0))  # fmt: skip


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    path = tmp_path_factory.mktemp("start") / "w.safetensors"
    save_weights(path, random_weights(TINY), "float32")
    return path


@pytest.fixture
def labelled_by_truth(monkeypatch):
    """The figure's own labels stand in for the tracker's; who was labelled."""
    done = []

    def label(sequence, output, config, tracker, T, on_progress):
        done.append(sequence.name)
        on_progress("labelling", len(sequence), len(sequence))
        if "nobody" in sequence.name:
            raise ResultError(f"{sequence.root}: no frame is kept: not tracking (2 of 2 frames)")
        writer = SequenceWriter(output, sequence.camera)
        for frame in sequence:
            seed = 10 * int(sequence.name[1:]) + frame.index
            writer.write(frame.timestamp_s, frame.depth_m, color=frame.color,
                         labels=figure(seed)[2])  # fmt: skip
        return Report([{"frame": n, "kept": True} for n in range(len(sequence))])

    monkeypatch.setattr(several, "label_sequence", label)
    monkeypatch.setattr(bank_module, "load_bank", lambda *rest: Bank(squares()))
    monkeypatch.setattr(tuning_report, "draw", lambda *rest: None)
    monkeypatch.setattr(train_module, "draw_curves", lambda *rest: None)
    return done


@pytest.fixture
def mine(tmp_path):
    """Three recordings without labels, one of them without colour."""
    for n in range(3):
        record(tmp_path / f"mine/r{n}", frames=2, seed=n, labelled=False, colored=n != 1)
    return tmp_path / "mine"


def command(mine, output, start, config=QUICK, **more):
    roots = more.pop("from_recordings", (mine,))
    return Train((), output, from_recordings=roots, start=start, config=config, **more)


def test_recordings_become_weights_and_a_report(mine, tmp_path, start, labelled_by_truth, capsys,
                                                monkeypatch):  # fmt: skip
    monkeypatch.setattr(tuning_report, "draw", DRAW)
    output = tmp_path / "run"
    record(mine / "nobody", frames=2, labelled=False)
    record(mine / "r7", frames=2, seed=7, labelled=False)
    (mine / "r7/camera.json").unlink()
    command(mine, output, start).run()
    weights = load_weights(output / "weights.safetensors")
    assert weights.config == TINY and weights.ranges and weights.training["steps"] == 3
    assert weights.training["data"] == ["mine"] and weights.training["start"] == "w.safetensors"
    report = json.loads((output / "report.json").read_text())
    rows = {row["name"]: row for row in report["recordings"]}
    assert {name: row["kept"] for name, row in rows.items()} == {
        "nobody": 0, "r0": 2, "r1": 2, "r2": 2, "r7": 0}  # fmt: skip
    assert sorted(rows[name]["use"] for name in ("r0", "r1", "r2")) == ["judge", "train", "train"]
    assert "no frame is kept" in rows["nobody"]["problem"] and "camera" in rows["r7"]["problem"]
    scores = {one["condition"]: one for one in report["scores"]}
    assert {"as recorded", "objects in front"} <= set(scores)
    assert scores["as recorded"]["start"] != scores["as recorded"]["tuned"]
    assert scores["as recorded"]["pictures"] == 2
    text = (output / "report.md").read_text()
    assert report["verdict"] in text and "| nobody | - | nothing | 2 | 0 |" in text
    picture = cv2.imread(str(output / "report.png"))
    assert picture.shape[1] > 800 and picture.std() > 20
    told = capsys.readouterr().out
    assert "left out nobody" in told and "report.md" in told and "caution" in told


def test_a_stopped_run_goes_on_without_labelling_again(mine, tmp_path, start, labelled_by_truth,
                                                       monkeypatch):  # fmt: skip
    output, bar = tmp_path / "run", Train.bar

    class Interrupting:
        def __enter__(self):
            return lambda progress: progress.step == 1 and os.kill(os.getpid(), signal.SIGINT)

        def __exit__(self, *_):
            pass

    monkeypatch.setattr(Train, "bar", lambda self: Interrupting())
    with pytest.raises(KeyboardInterrupt):
        command(mine, output, start).run()
    assert [path.name for path in output.glob("checkpoint-*")] == [
        "checkpoint-00000001.safetensors"
    ]
    assert not (output / "weights.safetensors").exists()
    monkeypatch.setattr(Train, "bar", bar)
    command(mine, output, start).run()
    command(mine, tmp_path / "other", start).run()
    assert labelled_by_truth == ["r0", "r1", "r2"] * 2
    ours, theirs = (load_weights(p / "weights.safetensors") for p in (output, tmp_path / "other"))
    assert all((ours.tensors[k] == v).all() for k, v in theirs.tensors.items())


def test_other_start_weights_are_another_run(mine, tmp_path, start, labelled_by_truth):
    command(mine, tmp_path / "run", start).run()
    before = (tmp_path / "run/weights.safetensors").read_bytes()
    save_weights(tmp_path / "b.safetensors", random_weights(TINY, seed=5), "float32")
    with pytest.raises(SegmentationError, match="another run: its start"):
        command(mine, tmp_path / "run", tmp_path / "b.safetensors").run()
    assert (tmp_path / "run/weights.safetensors").read_bytes() == before


def test_other_recordings_are_mixed_in_and_judged_for_themselves(mine, tmp_path, start,
                                                                 labelled_by_truth):  # fmt: skip
    for n in (4, 5):
        record(tmp_path / f"rooms/r{n}", frames=3, seed=n)
    train = replace(command(mine, tmp_path / "run", start), data=(tmp_path / "rooms",))
    train.run()
    report = json.loads((tmp_path / "run/report.json").read_text())
    other = [one for one in report["scores"] if one["condition"] == "other recordings"]
    assert len(other) == 1 and not other[0]["own"] and other[0]["pictures"] == 3
    assert report["training"]["other pictures"] == 3 and report["training"]["your pictures"] == 4


def test_chosen_recordings_are_labelled_and_held_out(mine, tmp_path, start, labelled_by_truth):
    aside = record(tmp_path / "aside/r8", frames=2, seed=8, labelled=False)
    command(mine, tmp_path / "run", start, validation=(tmp_path / "aside",)).run()
    report = json.loads((tmp_path / "run/report.json").read_text())
    uses = {row["name"]: row["use"] for row in report["recordings"]}
    assert uses == {"r0": "train", "r1": "train", "r2": "train", "r8": "judge"}
    with pytest.raises(ConfigError, match="r8 is both to train and to validate"):
        command(mine, tmp_path / "x", start, from_recordings=(mine, aside),
                validation=(aside,)).run()  # fmt: skip


def test_a_choice_that_cannot_be_used_is_not_replaced(mine, tmp_path, start, labelled_by_truth):
    aside = record(tmp_path / "nobody", frames=2, labelled=False)
    with pytest.raises(DatasetError, match="no recording with usable frames is held out"):
        command(mine, tmp_path / "run", start, validation=(aside,)).run()
    assert not (tmp_path / "run/weights.safetensors").exists()


def test_a_folder_without_usable_frames_is_named(tmp_path, start, labelled_by_truth):
    record(tmp_path / "nobody", frames=2, labelled=False)
    with pytest.raises(DatasetError, match="none of 1 recordings can be trained on; .*no frame is"):
        command(tmp_path / "nobody", tmp_path / "run", start).run()
    (tmp_path / "empty").mkdir()
    with pytest.raises(DatasetError, match="empty holds no recording"):
        command(tmp_path / "empty", tmp_path / "run", start).run()
    assert not (tmp_path / "run/weights.safetensors").exists()


def test_start_weights_are_checked_before_any_work(mine, tmp_path, start, labelled_by_truth,
                                                   monkeypatch):  # fmt: skip
    monkeypatch.setattr(tuning, "find_recordings", None)
    with pytest.raises(WeightsError, match="no weights file .*gone"):
        command(mine, tmp_path / "run", tmp_path / "gone").run()
    half = tmp_path / "half"
    half.write_bytes(start.read_bytes()[:500])
    with pytest.raises(WeightsError, match="half is no whole weights file"):
        command(mine, tmp_path / "run", half).run()
    config = replace(QUICK, network=NetworkConfig("unet"))
    with pytest.raises(WeightsError, match="fast_fcn.* cannot begin .*unet"):
        command(mine, tmp_path / "run", start, config).run()
    monkeypatch.setattr("segmentation.weights.SHIPPED", tmp_path / "none")
    with pytest.raises(ConfigError, match="no weights to begin with.*--start"):
        command(mine, tmp_path / "run", None).run()
    monkeypatch.setenv("WORLD_SIZE", "2")
    with pytest.raises(ConfigError, match="one process"):
        command(mine, tmp_path / "run", start).run()


def test_labels_lie_in_the_cache_if_there_is_one(tmp_path):
    assert command(tmp_path, tmp_path / "run", None).labels == tmp_path / "run/labels"
    shared = command(tmp_path, tmp_path / "run", None, cache=tmp_path / "cache")
    assert shared.labels == tmp_path / "cache/labels"

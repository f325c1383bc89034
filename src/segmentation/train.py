# SPDX-License-Identifier: Apache-2.0
"""Training: from packed pictures to a weights file, resumable at every checkpoint.

A run folder holds `run.json`, `log.jsonl`, `curves.png`, the last checkpoints and, at the end,
`weights.safetensors`. Training goes on from the newest whole checkpoint of the folder. Counted in
steps, and on one CPU, a run that was stopped ends with the same bits as one that was not.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy import ndarray
from torch.utils.data import DataLoader

from kintrack import __version__
from kintrack.files import write_json
from segmentation.augment.sample import AugmentConfig, Bank
from segmentation.calibrate import calibrated
from segmentation.curves import CURVES_FILE, LOG_FILE, append_log, draw_curves, read_log
from segmentation.dataset import Batches, Pictures, Split
from segmentation.evaluate import N, Scores, scores_of
from segmentation.learner import Group, Learner, check_finite, join_group
from segmentation.networks import folded
from segmentation.prepared import Prepared, PreparedBatches
from segmentation.resuming import Run, keep, mark_of, plain, resume
from segmentation.training_config import TrainConfig
from segmentation.weights import Weights, save_weights

WEIGHTS_FILE, RUN_FILE = "weights.safetensors", "run.json"
VALIDATION_BATCH = 16
CALIBRATION_FRAMES = 200
"""Training frames from which int8 ranges are found; every other one is changed."""
UNFOLDED = 64
"""Samples from which the normalisation of weights to begin with takes its statistics."""
ENDLESS = 1 << 40


@dataclass(frozen=True)
class TrainProgress:
    """How far training is."""

    step: int
    """Steps done."""
    share: float
    """Share of the training that is done."""
    loss: float
    """Mean training loss since the last line of the log."""
    left_s: float
    """Time left [s]."""
    scores: Scores | None
    """Of the last validation."""


def train(
    config: TrainConfig,
    data: Split,
    bank: Bank,
    output: Path,
    facts: dict[str, Any] | None = None,
    start: Weights | None = None,
    prepared: Prepared | None = None,
    on_progress: Callable[[TrainProgress], None] = lambda progress: None,
) -> Path:
    """Train a network, or go on where the run in the folder stopped.

    Args:
        config: How.
        data: Pictures to train on and to validate with.
        bank: Things and rooms to put into pictures.
        output: Folder of the run.
        facts: What the weights file is to say beyond config and scores: data, command.
        start: Weights to begin with; random ones if None.
        prepared: Samples to learn from; None makes them anew for each step.
        on_progress: Called after every step, in the leading process.

    Returns:
        The weights file.

    Raises:
        SegmentationError: if the folder holds another run, or the loss is no number.
        WeightsError: if no checkpoint of the folder is whole, or a file cannot be written.
        KeyboardInterrupt: after Ctrl-C, once a checkpoint is written.
    """
    group = join_group(config)
    learner = Learner(config, group, start)
    if start is not None and config.normalised:
        learner.unfold(Batches(data.train, config.augment, bank, UNFOLDED, config.seed)[0][0])
    identity = {
        "config": config.identity(),
        "data": [data.train.crc(), data.validation.crc()],
        "start": None if start is None else mark_of(start),
    }
    run = resume(output, learner, identity)
    if group.leads:
        output.mkdir(parents=True, exist_ok=True)
        write_json(output / RUN_FILE, {**asdict(config), "facts": facts or {}})
    _loop(config, learner, run, data, bank, prepared, output, identity, on_progress)
    path = output / WEIGHTS_FILE
    if group.leads:
        run.scores = validate(learner, data.validation.spread(config.validation_frames))
        keep(output, learner, run, identity)
        weights = Weights(config.network, folded(learner.average))
        weights = calibrated(weights, _calibration(config, data.train, bank), group.device)
        shown = _facts(config, data, run, facts or {}, learner)
        save_weights(path, Weights(weights.config, weights.tensors, weights.ranges, shown))
        draw_curves(read_log(output / LOG_FILE), output / CURVES_FILE)
    group.agree(0.0)
    if group.world > 1:
        learner.part()
        torch.distributed.destroy_process_group()
    return path


def validate(learner: Learner, pictures: Pictures) -> Scores:
    """Scores of the averaged network on unchanged pictures.

    They take turns: whole with colour, whole without, a closer look with colour, one without.
    """
    from segmentation.augment.sample import plain_sample

    counts = np.zeros((N, N), dtype=np.int64)
    for first in range(0, len(pictures), VALIDATION_BATCH):
        numbers = range(first, min(first + VALIDATION_BATCH, len(pictures)))
        samples = [plain_sample(pictures[n], n % 2 == 1, n % 4 > 1) for n in numbers]
        counts += learner.judge(
            np.stack([sample.image for sample in samples]),
            np.stack([sample.labels for sample in samples]),
        )
    return scores_of(counts)


def _loop(config, learner, run, data, bank, prepared, output, identity, on_progress) -> None:
    group, validation = learner.group, data.validation.spread(config.validation_frames)
    share_of_batch = (config.batch // group.world, config.seed, group.rank, group.world)
    batches = (
        PreparedBatches(prepared, *share_of_batch)
        if prepared
        else Batches(data.train, config.augment, bank, *share_of_batch)
    )
    began, saved = time.monotonic() - run.elapsed_s, time.monotonic()
    with _stop_signals() as stopped:
        for images, labels in _loader(config, batches, run.step, group):
            run.elapsed_s, stop = group.agree(time.monotonic() - began, float(stopped.is_set()))
            share = config.share(run.step, run.elapsed_s)
            if stop:
                if group.leads:
                    keep(output, learner, run, identity)
                raise KeyboardInterrupt
            if share >= 1.0:
                break
            rate = config.rate_at(run.step, share)
            loss = learner.step(images, labels, rate, run.step)
            run.step += 1
            if not group.leads:
                continue
            run.losses.append(float(loss))
            check_finite(run.losses[-1], run.step)
            mean = float(np.mean(run.losses))
            entry: dict[str, Any] = {}
            if run.step % config.log_steps == 0:
                entry = {"loss": mean, "rate": rate}
                run.losses.clear()
            if run.step % config.validation_steps == 0:
                run.scores = validate(learner, validation)
                entry["validation"] = run.scores.summary()
            if entry:
                when = {"step": run.step, "seconds": round(time.monotonic() - began, 1)}
                append_log(output / LOG_FILE, when | entry)
            if "validation" in entry:
                draw_curves(read_log(output / LOG_FILE), output / CURVES_FILE)
            if time.monotonic() - saved >= 60 * config.checkpoint_minutes:
                run.elapsed_s = time.monotonic() - began
                keep(output, learner, run, identity)
                saved = time.monotonic()
            done = max(config.share(run.step, time.monotonic() - began), 1e-9)
            left_s = (time.monotonic() - began) * (1.0 - done) / done
            on_progress(TrainProgress(run.step, done, mean, left_s, run.scores))


def _loader(
    config: TrainConfig, batches: Batches | PreparedBatches, first: int, group: Group
) -> DataLoader:
    """Batches from a step on, prepared ahead by other processes."""
    return DataLoader(
        batches,  # type: ignore[arg-type]
        batch_size=None,
        sampler=range(first, ENDLESS),
        num_workers=config.workers,
        prefetch_factor=4 if config.workers else None,
        multiprocessing_context="spawn" if config.workers else None,
        worker_init_fn=_prepare_worker,
        pin_memory=group.device.type == "cuda",
    )


def _prepare_worker(number: int) -> None:
    """One thread each, and Ctrl-C is for the parent."""
    import cv2

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)


@contextmanager
def _stop_signals() -> Iterator[threading.Event]:
    """An event that Ctrl-C or a termination sets, so that no step is cut in two."""
    stopped = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield stopped
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stopped.set()) for number in numbers]
    try:
        yield stopped
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _calibration(config: TrainConfig, pictures: Pictures, bank: Bank) -> Iterator[ndarray]:
    plain = Batches(pictures.spread(CALIBRATION_FRAMES), None, bank, 1, config.seed)
    changed = Batches(pictures, AugmentConfig() if config.augment is None else config.augment,
                      bank, 1, config.seed + 1)  # fmt: skip
    for n in range(min(CALIBRATION_FRAMES, len(pictures))):
        yield (changed if n % 2 else plain)[n][0][0]


def _facts(config: TrainConfig, data: Split, run: Run, facts, learner: Learner) -> dict[str, Any]:
    assert run.scores is not None
    return {
        "kintrack": __version__,
        "torch": torch.__version__,
        "device": str(learner.group.device),
        "processes": learner.group.world,
        "precision": "bf16" if learner.bf16 else "fp32",
        "config": plain(asdict(config)),
        "steps": run.step,
        "hours": round(run.elapsed_s / 3600, 4),
        "training_pictures": len(data.train),
        "validation_pictures": len(data.validation),
        "validation": run.scores.summary(),
        **facts,
    }


def sources_of(roots: Sequence[Path]) -> list[str]:
    """Names of data folders as a weights file tells them."""
    return [root.resolve().name for root in roots]

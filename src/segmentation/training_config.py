# SPDX-License-Identifier: Apache-2.0
"""How a network is trained."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any

from kintrack.bounds import check_bounds
from segmentation.architecture import NetworkConfig
from segmentation.augment.bank import BankConfig
from segmentation.augment.sample import AugmentConfig
from segmentation.errors import SegmentationError

PRECISIONS = ("auto", "fp32", "bf16")
DEVICES = ("auto", "cpu", "cuda")
OPTIMISERS = ("muon", "adamw", "adam")


@dataclass(frozen=True)
class TrainConfig:
    """What is trained, how long, and how fast it learns."""

    network: NetworkConfig = field(default_factory=NetworkConfig)
    """Architecture and widths."""
    steps: int = 0
    """Length in steps; 0 to train for `hours` instead. A run counted in steps can be repeated bit
    for bit."""
    hours: float = 2.0
    """Length by the clock, stops and resumptions left out [h]."""
    batch: int = 16
    """Samples a step, of all processes together."""
    rate: float = 1e-3
    """Highest learning rate."""
    final_rate: float = 0.01
    """Learning rate at the end, share of the highest."""
    warmup_steps: int = 200
    """Steps in which the learning rate rises; at most a tenth of `steps`."""
    optimiser: str = "muon"
    """muon, adamw or adam."""
    weight_decay: float = 1e-4
    """Decay of weights, times the learning rate, per step."""
    clip: float = 1.0
    """Greatest norm of a gradient."""
    background_weight: float = 0.5
    """lambda of the background modifier."""
    average: float = 0.999
    """Decay of the moving average of the weights, which is what is kept."""
    normalised: bool = True
    """Batch normalisation while training, folded into the weights that are kept."""
    seed: int = 0
    """Draws weights, order and changes."""
    augment: AugmentConfig = field(default_factory=AugmentConfig)
    """How samples are changed."""
    bank: BankConfig = field(default_factory=BankConfig)
    """Things and rooms that are put into them."""
    prepared: int = 0
    """Samples that are made once and learnt from many times, mirrored by chance, where a GPU
    outruns the processor or runs share them (110 kB each in the cache); 0 makes every sample
    anew."""
    validation_share: float = 0.05
    """Share of people, or of recordings, that validate."""
    validation_part: str = "test"
    """Part of a dataset that validates, if there is one, instead of a share."""
    validation_frames: int = 400
    """Frames of a validation."""
    validation_steps: int = 500
    """Steps between validations."""
    log_steps: int = 20
    """Steps between lines of the log."""
    checkpoint_minutes: float = 5.0
    """Time between checkpoints [min]."""
    precision: str = "auto"
    """fp32, bf16, or auto for bf16 where the processor has it."""
    device: str = "auto"
    """cpu, cuda, or auto for a GPU where there is one."""
    threads: int = 0
    """Threads on a CPU; 0 leaves the number to the library."""
    workers: int = 1
    """Processes that prepare samples; 0 prepares them between steps. No result depends on it."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            steps=(0, 10**8), hours=(1e-4, 1e4), batch=(1, 4096), rate=(1e-8, 1.0),
            final_rate=(0.0, 1.0), warmup_steps=(0, 10**6), weight_decay=(0.0, 1.0),
            clip=(1e-6, 1e6), background_weight=(0.0, 100.0), average=(0.0, 0.99999),
            seed=(0, 2**31), prepared=(0, 10**8), validation_share=(0.0, 0.9),
            validation_frames=(1, 10**6), validation_steps=(1, 10**8), log_steps=(1, 10**6),
            checkpoint_minutes=(0.0, 1e4), threads=(0, 1024), workers=(0, 64),
        )  # fmt: skip
        for name, allowed in (
            ("precision", PRECISIONS),
            ("device", DEVICES),
            ("optimiser", OPTIMISERS),
        ):
            if getattr(self, name) not in allowed:
                raise SegmentationError(
                    f"{name} = {getattr(self, name)!r}: {', '.join(allowed)} are possible"
                )

    def identity(self) -> dict[str, Any]:
        """What a checkpoint must agree in to be gone on from."""
        free = ("workers", "threads", "device", "checkpoint_minutes")
        return {k: v for k, v in asdict(self).items() if k not in free}

    def share(self, step: int, elapsed_s: float) -> float:
        """How much of the training is done, 0 to 1."""
        return min(1.0, step / self.steps if self.steps else elapsed_s / (3600 * self.hours))

    def rate_at(self, step: int, share: float) -> float:
        """Learning rate: a linear rise, then half a cosine (Loshchilov & Hutter 2017)."""
        warmup = min(self.warmup_steps, self.steps // 10) if self.steps else self.warmup_steps
        rise = min(1.0, (step + 1) / (warmup + 1))
        wave = 0.5 * (1.0 + math.cos(math.pi * share))
        return self.rate * rise * (self.final_rate + (1.0 - self.final_rate) * wave)

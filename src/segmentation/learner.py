# SPDX-License-Identifier: Apache-2.0
"""A network under training: one step, its moving average, and its state as tensors."""

from __future__ import annotations

import gc
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import timedelta

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from numpy import ndarray
from torch import Tensor, nn

from segmentation.errors import SegmentationError, WeightsError
from segmentation.evaluate import N, confusion
from segmentation.loss import segmentation_loss
from segmentation.muon import Muon
from segmentation.networks import PartNetwork, tensors_of, unfold
from segmentation.training_config import TrainConfig
from segmentation.weights import Weights

LONGEST_WAIT = timedelta(hours=12)
"""So long the others wait while the first one packs pictures and prepares samples."""


@dataclass(frozen=True)
class Group:
    """The processes that train together; torchrun sets their number."""

    rank: int
    """Which one this is."""
    world: int
    """How many there are."""
    device: torch.device
    """What this one computes on."""

    @property
    def leads(self) -> bool:
        """Whether this is the one that writes files."""
        return self.rank == 0

    def agree(self, *values: float) -> list[float]:
        """The leader's values, in every process."""
        if self.world == 1:
            return list(values)
        shared = torch.tensor(values, dtype=torch.float64, device=self.device)
        torch.distributed.broadcast(shared, 0)
        return [float(value) for value in shared]


def join_group(config: TrainConfig) -> Group:
    """Meet the other processes that torchrun has started, if any.

    Raises:
        SegmentationError: if a GPU is wanted and there is none, or the batch cannot be divided.
    """
    rank, world = int(os.environ.get("RANK", 0)), int(os.environ.get("WORLD_SIZE", 1))
    if config.device == "cuda" and not torch.cuda.is_available():
        raise SegmentationError("device = 'cuda': torch finds no GPU; auto and cpu are possible")
    if config.batch % world:
        raise SegmentationError(f"batch = {config.batch} cannot be divided among {world} processes")
    on_gpu = config.device != "cpu" and torch.cuda.is_available()
    local = int(os.environ.get("LOCAL_RANK", 0))
    device = torch.device("cuda", local) if on_gpu else torch.device("cpu")
    if on_gpu:
        torch.cuda.set_device(device)
    if config.threads and not on_gpu:
        torch.set_num_threads(config.threads)
    if world > 1 and not torch.distributed.is_initialized():
        torch.distributed.init_process_group("nccl" if on_gpu else "gloo", timeout=LONGEST_WAIT)
    return Group(rank, world, device)


class Learner:
    """Network, moving average and optimiser."""

    def __init__(self, config: TrainConfig, group: Group, start: Weights | None = None):
        """Begin with random weights, or with those of a trained network of the same kind."""
        if start is not None and start.config != config.network:
            raise WeightsError(f"weights of {start.config} cannot begin {config.network}")
        self.config, self.group = config, group
        self.network = PartNetwork(config.network, config.seed, config.normalised)
        self.average = PartNetwork(config.network, config.seed, config.normalised)
        if start is not None:
            for network in (self.network, self.average):
                _load(network, start.tensors, whole=False)
        for network in (self.network, self.average):
            network.to(group.device).to(memory_format=torch.channels_last)  # type: ignore[call-overload]
        self.average.requires_grad_(False).eval()
        self.bf16 = _takes_bf16(config, group.device)
        self.optimiser = _optimiser(config, self.network, self.bf16)
        self._forward: nn.Module = self.network
        if group.world > 1:
            from torch.nn.parallel import DistributedDataParallel

            self._forward = DistributedDataParallel(self.network)

    def part(self) -> None:
        """Let go of the other processes, so that the threads that talk to them end in order."""
        self._forward = self.network
        gc.collect()

    def unfold(self, images: Float[ndarray, "b 4 106 128"]) -> None:
        """Let the normalisation of weights to begin with change nothing, see `networks.unfold`."""
        for network in (self.network, self.average):
            unfold(network, self._image(torch.from_numpy(images)))

    def step(self, images: Tensor, labels: Tensor, rate: float, step: int) -> Tensor:
        """Learn from a batch.

        Returns:
            The loss before the step, a scalar on the device.
        """
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        self.optimiser.zero_grad(set_to_none=True)
        with torch.autocast(self.group.device.type, torch.bfloat16, enabled=self.bf16):
            logits = self._forward(self._image(images))
        target = labels.to(self.group.device, non_blocking=True)
        loss = segmentation_loss(logits, target, self.config.background_weight)
        loss.backward()
        nn.utils.clip_grad_norm_(self.network.parameters(), self.config.clip)
        self.optimiser.step()
        decay = min(self.config.average, (1.0 + step) / (10.0 + step))
        with torch.no_grad():
            torch._foreach_lerp_(_floats(self.average), _floats(self.network), 1.0 - decay)
        return loss.detach()

    def judge(
        self, images: Float[ndarray, "b 4 106 128"], labels: UInt8[ndarray, "b 106 128"]
    ) -> Int[ndarray, "7 7"]:
        """Confusion matrix of the averaged network on a batch."""
        with torch.inference_mode():
            device = self.group.device.type
            with torch.autocast(device, torch.bfloat16, enabled=self.bf16):
                logits = self.average(self._image(torch.from_numpy(images)))
            found = logits.argmax(dim=1).to(torch.uint8).cpu().numpy()
        return confusion(labels, found).reshape(N, N)

    def tensors(self) -> dict[str, ndarray]:
        """All that a checkpoint must hold of it."""
        out = {f"network.{k}": v for k, v in tensors_of(self.network).items()}
        out |= {f"average.{k}": v for k, v in tensors_of(self.average).items()}
        for name, parameter in self.network.named_parameters():
            for key, value in self.optimiser.state.get(parameter, {}).items():
                out[f"optimiser.{name}.{key}"] = value.detach().cpu().float().numpy().copy()
        return out

    def restore(self, tensors: Mapping[str, ndarray]) -> None:
        """Go back to the state of a checkpoint."""
        _load(self.network, _below(tensors, "network."))
        _load(self.average, _below(tensors, "average."))
        state = {}
        for n, (name, _) in enumerate(self.network.named_parameters()):
            moments = _below(tensors, f"optimiser.{name}.")
            if moments:
                state[n] = {key: torch.from_numpy(np.array(v)) for key, v in moments.items()}
        groups = self.optimiser.state_dict()["param_groups"]
        self.optimiser.load_state_dict({"state": state, "param_groups": groups})

    def _image(self, images: Tensor) -> Tensor:
        images = images.to(self.group.device, non_blocking=True)
        return images.contiguous(memory_format=torch.channels_last)


def check_finite(loss: float, step: int) -> None:
    """Raise if training has run away.

    Raises:
        SegmentationError: if the loss is no number.
    """
    if not math.isfinite(loss):
        raise SegmentationError(
            f"the loss is {loss} at step {step}: training has run away; take a lower --rate. The "
            "last checkpoint is from before"
        )


def _floats(network: PartNetwork) -> list[Tensor]:
    """Weights and running statistics."""
    return [t for t in network.state_dict(keep_vars=True).values() if t.is_floating_point()]


def _optimiser(config: TrainConfig, network: PartNetwork, bf16: bool) -> torch.optim.Optimizer:
    if config.optimiser == "adam":
        return torch.optim.Adam(network.parameters(), config.rate)
    if config.optimiser == "adamw":
        return torch.optim.AdamW(
            network.parameters(), config.rate, weight_decay=config.weight_decay
        )
    dtype = torch.bfloat16 if bf16 else torch.float32
    return Muon(network.parameters(), config.rate, config.weight_decay, dtype=dtype)


def _takes_bf16(config: TrainConfig, device: torch.device) -> bool:
    if config.precision != "auto":
        return config.precision == "bf16"
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported())
    return bool(torch.ops.mkldnn._is_mkldnn_bf16_supported())


def _load(network: PartNetwork, tensors: Mapping[str, ndarray], whole: bool = True) -> None:
    state = {k: torch.from_numpy(np.array(v)) for k, v in tensors.items()}
    network.load_state_dict(state, strict=whole)


def _below(tensors: Mapping[str, ndarray], prefix: str) -> dict[str, ndarray]:
    return {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}

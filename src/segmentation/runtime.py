# SPDX-License-Identifier: Apache-2.0
"""The trained network as a function of a frame, on whatever the machine offers."""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

from kintrack.sequence.frame import Frame
from segmentation.errors import InputError, RuntimeFallbackWarning, SegmentationError
from segmentation.labels import INPUT_CHANNELS, INPUT_HEIGHT, INPUT_WIDTH, LABELS, MIRRORED
from segmentation.preprocess import frame_input
from segmentation.weights import Weights, load_weights

Infer = Callable[[ndarray], ndarray]
"""From pictures (2, 4, 106, 128) to logits (2, 7, 106, 128), both float32."""

PRECISIONS = ("auto", "fp32", "bf16")
DOUBT = 4.0
"""A part is in doubt while another label's logit is no further below it than this."""
FAINT_DOUBT = 6.0
"""The same for background, which takes what is thin, far or new to a network for itself."""


@dataclass(frozen=True)
class RuntimeConfig:
    """What computes the labels."""

    runtime: str = "auto"
    """One of `RUNTIMES`, or `auto` for the first of them that works here."""
    precision: str = "auto"
    """`fp32`, `bf16`, or `auto` for bf16 where the processor has it; int8 stays int8."""
    threads: int = 0
    """Processor threads; 0 leaves the number to the library."""

    def __post_init__(self) -> None:
        if self.runtime not in ("auto", *RUNTIMES):
            raise SegmentationError(f"runtime = {self.runtime!r}: auto, {', '.join(RUNTIMES)} "
                                    "are possible")  # fmt: skip
        if self.precision not in PRECISIONS:
            raise SegmentationError(f"precision = {self.precision!r}: {', '.join(PRECISIONS)} "
                                    "are possible")  # fmt: skip
        if type(self.threads) is not int or not 0 <= self.threads <= 1024:
            raise SegmentationError(f"threads = {self.threads!r}: 0 to 1024 are possible")


class Segmenter(Protocol):
    """Labels a frame at the network's size; `labels_to_image` brings them to the frame's."""

    @property
    def runtime(self) -> str:
        """What computes the labels."""
        ...

    def segment(self, frame: Frame) -> UInt8[ndarray, "106 128"]:
        """The most probable label of every pixel of the network's picture."""
        ...

    def logits(self, frame: Frame) -> Float[ndarray, "7 106 128"]:
        """What `labels_of` and `probabilities_of` start from."""
        ...


@dataclass(frozen=True)
class NetworkSegmenter:
    """A segmenter that runs a trained network; not for several threads at once."""

    runtime: str
    """One of `RUNTIMES`."""
    infer: Infer
    """The network on that runtime."""

    def segment(self, frame: Frame) -> UInt8[ndarray, "106 128"]:
        """See `Segmenter`.

        Raises:
            InputError: if the frame has no depth or a broken one.
        """
        return labels_of(self.logits(frame))

    def logits(self, frame: Frame) -> Float[ndarray, "7 106 128"]:
        """See `Segmenter`."""
        return self.logits_of(frame_input(frame))

    def logits_of(self, image: Float[ndarray, "4 106 128"]) -> Float[ndarray, "7 106 128"]:
        """Logits of a network input that has been made before.

        They are the mean of those of the picture and of its mirror image, left and right swapped
        back: whose limb a pixel is depends less on the way a person happens to face.

        Raises:
            InputError: if its shape or type is wrong.
        """
        shape = (len(INPUT_CHANNELS), INPUT_HEIGHT, INPUT_WIDTH)
        if image.shape != shape or image.dtype != np.float32:
            raise InputError(f"network input of shape {image.shape} and type {image.dtype}: "
                             f"{shape} in float32 is needed")  # fmt: skip
        straight, mirrored = self.infer(np.stack([image, image[:, :, ::-1]]))
        return np.float32(0.5) * (straight + mirrored[MIRRORED, :, ::-1])


def labels_of(logits: Float[ndarray, "7 106 128"]) -> UInt8[ndarray, "106 128"]:
    """The label of the largest logit, the lowest of equals."""
    labels = np.empty(logits.shape[1:], dtype=np.uint8)
    _largest(logits.reshape(len(LABELS), -1), labels.reshape(-1))
    return labels


def guesses_of(logits: Float[ndarray, "7 106 128"]) -> UInt8[ndarray, "2 106 128"]:
    """The label of the largest logit, and that of the second if it is not much less likely.

    Args:
        logits: What a network says.

    Returns:
        First and second guess; the first again where there is no doubt: where the second is less
        likely by `DOUBT`, or by `FAINT_DOUBT` where the first is background.
    """
    guesses = np.empty((2, *logits.shape[1:]), dtype=np.uint8)
    _two_largest(logits.reshape(len(LABELS), -1), guesses.reshape(2, -1), DOUBT, FAINT_DOUBT)
    return guesses


def probabilities_of(logits: Float[ndarray, "7 106 128"]) -> Float[ndarray, "7 106 128"]:
    """Softmax over the labels."""
    powers = np.exp(logits - logits.max(axis=0))
    return powers / powers.sum(axis=0)


def load_segmenter(path: Path, config: RuntimeConfig | None = None) -> NetworkSegmenter:
    """The network of a weights file, ready to label frames.

    Args:
        path: Weights file.
        config: What to run it on; None chooses.

    Raises:
        WeightsError: if the file cannot be used.
        SegmentationError: if no runtime is installed.
    """
    return segmenter(load_weights(path), config)


def segmenter(weights: Weights, config: RuntimeConfig | None = None) -> NetworkSegmenter:
    """The same from weights in memory.

    One `RuntimeFallbackWarning` says so if the runtime that was asked for cannot be used here, or
    if `auto` has to pass over one; a missing GPU is no reason to warn unless it was asked for.
    """
    config = config or RuntimeConfig()
    wanted = [config.runtime] if config.runtime in RUNTIMES else []
    problems: list[str] = []
    for name in [*wanted, *(name for name in RUNTIMES if name not in wanted)]:
        reason = _obstacle(name, weights)
        if reason is None:
            try:
                infer = RUNTIMES[name](weights, config)
            except (ImportError, OSError, RuntimeError) as error:
                reason = f"it does not start: {error}"
        if reason is None:
            if problems:
                message = f"{name} computes the labels, since {'; '.join(problems)}"
                warnings.warn(message, RuntimeFallbackWarning, stacklevel=2)
            return NetworkSegmenter(name, infer)
        if name in wanted or name != "torch-cuda":
            problems.append(f"{name} cannot: {reason}")
    raise SegmentationError(f"nothing here can compute labels: {'; '.join(problems)}")


def _obstacle(name: str, weights: Weights) -> str | None:
    """Why a runtime cannot be used, found without importing it; None if nothing speaks against."""
    package = name.partition("-")[0]
    if find_spec(package) is None:
        return f"{package} is not installed"
    if name == "openvino-int8" and not weights.ranges:
        return "the weights are not calibrated"
    if name == "torch-cuda" and not _has_cuda_driver():
        return "there is no CUDA driver"
    return None


def _has_cuda_driver() -> bool:
    """Whether importing torch to look for a GPU is worth the seconds."""
    for library in ("libcuda.so.1", "nvcuda.dll"):
        try:
            ctypes.CDLL(library)
        except OSError:
            continue
        return True
    return False


def _takes_bf16(config: RuntimeConfig, has_bf16: bool) -> bool:
    return config.precision == "bf16" or (config.precision == "auto" and has_bf16)


def _openvino_float(weights: Weights, config: RuntimeConfig) -> Infer:
    return _openvino(weights, config, quantised=False)


def _openvino_int8(weights: Weights, config: RuntimeConfig) -> Infer:
    return _openvino(weights, config, quantised=True)


def _openvino(weights: Weights, config: RuntimeConfig, quantised: bool) -> Infer:
    from segmentation.graph import openvino_model

    core = _core()
    has_bf16 = "BF16" in core.get_property("CPU", "OPTIMIZATION_CAPABILITIES")
    small = not quantised and _takes_bf16(config, has_bf16)
    properties = {
        "PERFORMANCE_HINT": "LATENCY",
        "INFERENCE_PRECISION_HINT": "bf16" if small else "f32",
    }
    if config.threads:
        properties["INFERENCE_NUM_THREADS"] = str(config.threads)
    compiled = core.compile_model(openvino_model(weights, quantised), "CPU", properties)
    request = compiled.create_infer_request()

    def infer(image: ndarray) -> ndarray:
        request.infer({0: image}, share_inputs=True)
        return request.get_output_tensor(0).data

    return infer


@cache
def _core() -> Any:
    """OpenVINO, once per process.

    Each `Core` puts a signal stack of its own in place of the one before it and puts that back
    when it goes; of two that do not go in reverse order the last puts back one that is unmapped,
    and the next signal ends the process.
    """
    import openvino as ov

    return ov.Core()


def _torch_cpu(weights: Weights, config: RuntimeConfig) -> Infer:
    return _torch(weights, config, "cpu")


def _torch_cuda(weights: Weights, config: RuntimeConfig) -> Infer:
    import torch

    if not torch.cuda.is_available():
        raise RuntimeError("torch finds no GPU")
    return _torch(weights, config, "cuda")


def _torch(weights: Weights, config: RuntimeConfig, device: str) -> Infer:
    import torch

    from segmentation.networks import network_of

    if config.threads and device == "cpu":
        torch.set_num_threads(config.threads)
    if device == "cuda":
        has_bf16 = torch.cuda.is_bf16_supported()
    else:
        has_bf16 = torch.ops.mkldnn._is_mkldnn_bf16_supported()
    dtype = torch.bfloat16 if _takes_bf16(config, has_bf16) else torch.float32
    layout = torch.channels_last
    network = network_of(weights).to(device, dtype).to(memory_format=layout)  # type: ignore[call-overload]

    def infer(image: ndarray) -> ndarray:
        with torch.inference_mode():
            x = torch.from_numpy(image).to(device, dtype, memory_format=layout)
            return network(x).float().contiguous().cpu().numpy()

    return infer


@njit(cache=True)
def _largest(logits, labels):
    for i in range(labels.size):
        best = 0
        for label in range(1, logits.shape[0]):
            if logits[label, i] > logits[best, i]:
                best = label
        labels[i] = best


@njit(cache=True)
def _two_largest(logits, guesses, doubt, faint):
    for i in range(guesses.shape[1]):
        best = 0
        for label in range(1, logits.shape[0]):
            if logits[label, i] > logits[best, i]:
                best = label
        second = 1 if best == 0 else 0
        for label in range(second + 1, logits.shape[0]):
            if label != best and logits[label, i] > logits[second, i]:
                second = label
        near = logits[best, i] - logits[second, i] < (faint if best == 0 else doubt)
        guesses[0, i] = best
        guesses[1, i] = second if near else best


RUNTIMES: dict[str, Callable[[Weights, RuntimeConfig], Infer]] = {
    "torch-cuda": _torch_cuda,
    "openvino-int8": _openvino_int8,
    "openvino": _openvino_float,
    "torch": _torch_cpu,
}
"""Runtimes by name, the preferred ones first."""

# SPDX-License-Identifier: Apache-2.0
"""A network in one safetensors file: its weights, what they are for, and the int8 ranges.

Nothing of it needs torch. A file is written beside its place, read back, and only then renamed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from segmentation.architecture import NetworkConfig, plan
from segmentation.errors import SegmentationError, WeightsError
from segmentation.labels import LABELS
from segmentation.preprocess import SPECIFICATION

SHIPPED = Path(__file__).parent / "pretrained" / "unet_small.safetensors"
"""The weights that come with kintrack."""
ENTRY = "kintrack.segmentation"
"""The file's only metadata entry, in JSON: several would come in a random order."""
VERSION = 1
"""Of this layout."""
RANGE = "quant."
"""Prefix of the int8 ranges among the file's tensors."""


@dataclass(frozen=True)
class Weights:
    """All that a runtime needs to know of a trained network."""

    config: NetworkConfig
    """Which network."""
    tensors: Mapping[str, ndarray]
    """`layer.weight` and `layer.bias` of every layer, float32, in torch's layout."""
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Least and largest value that int8 keeps of a layer's result; empty if not calibrated."""
    training: Mapping[str, Any] = field(default_factory=dict)
    """Facts for the model card: data, seeds, command, scores; anything that JSON can hold."""


def save_weights(path: Path, weights: Weights, dtype: str = "float16") -> None:
    """Write a weights file; an older one there is replaced only by one that can be read.

    Args:
        path: File to write.
        weights: What to write.
        dtype: `float16`, half the size, or `float32`.

    Raises:
        WeightsError: if a tensor is missing, has another shape or is not finite in that type, or
            the file cannot be written.
    """
    if dtype not in ("float16", "float32"):
        raise WeightsError(f"weights cannot be kept as {dtype!r}: float16, float32 are possible")
    with np.errstate(over="ignore"):
        tensors = {k: np.ascontiguousarray(v, dtype=dtype) for k, v in weights.tensors.items()}
    ranges = {RANGE + k: np.array(v, dtype=np.float32) for k, v in weights.ranges.items()}
    facts = _facts(weights.config) | {"training": dict(weights.training)}
    beside = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with beside.open("wb") as file:
            file.write(save(tensors | ranges, metadata={ENTRY: json.dumps(facts)}))
            file.flush()
            os.fsync(file.fileno())
        load_weights(beside)
        beside.replace(path)
    except WeightsError as error:
        message = str(error).replace(str(beside), "these weights")
        raise WeightsError(f"{path} was not written: {message}") from None
    except OSError as error:
        raise WeightsError(f"{path} cannot be written: {error}") from None
    finally:
        beside.unlink(missing_ok=True)


def load_weights(path: Path, architecture: str | None = None) -> Weights:
    """Read a weights file and check all of it.

    Args:
        path: File to read.
        architecture: The only one that is wanted; None takes any.

    Raises:
        WeightsError: if the file is missing, cut off or of another kind, was made for another
            network, label set or input, or holds NaN.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            entry = (file.metadata() or {}).get(ENTRY)
            tensors = {name: file.get_tensor(name) for name in file.keys()}
    except FileNotFoundError:
        raise WeightsError(f"no weights file {path}") from None
    except (SafetensorError, OSError) as error:
        raise WeightsError(f"{path} is no whole weights file: {error}") from None
    facts = _parsed(path, entry)
    config = _config(path, facts)
    if architecture not in (None, config.architecture):
        raise WeightsError(
            f"{path} holds {config.architecture} weights, {architecture} ones are needed"
        )
    ranges = {k.removeprefix(RANGE): tensors.pop(k) for k in [*tensors] if k.startswith(RANGE)}
    _check_tensors(path, config, tensors)
    return Weights(
        config,
        {name: tensor.astype(np.float32) for name, tensor in tensors.items()},
        {name: _checked_range(path, name, ends) for name, ends in ranges.items()},
        facts.get("training", {}),
    )


def _facts(config: NetworkConfig) -> dict[str, Any]:
    return {
        "version": VERSION,
        "architecture": config.architecture,
        "widths": list(config.widths),
        "reach": config.reach,
        "labels": list(LABELS),
        "input": SPECIFICATION,
    }


def _parsed(path: Path, entry: str | None) -> dict[str, Any]:
    """What the file says of itself."""
    try:
        facts = json.loads(entry or "")
    except ValueError:
        facts = None
    if not isinstance(facts, dict):
        raise WeightsError(f"{path} holds tensors, but not those of kintrack's part segmentation")
    return facts


def _config(path: Path, facts: Mapping[str, Any]) -> NetworkConfig:
    """What network the file is for, once it is clear that it fits this program."""
    for key in ("version", "labels", "input"):
        expected = _facts(NetworkConfig())[key]
        if facts.get(key) != expected:
            raise WeightsError(f"{path}: {key} = {facts.get(key)}; {expected} is needed")
    try:
        return NetworkConfig(facts["architecture"], tuple(facts["widths"]), facts.get("reach", 1))
    except (KeyError, TypeError, SegmentationError) as error:
        raise WeightsError(f"{path} does not say which network it is for: {error}") from None


def _check_tensors(path: Path, config: NetworkConfig, tensors: Mapping[str, ndarray]) -> None:
    shapes: dict[str, tuple[int, ...]] = {}
    for layer in plan(config).layers:
        shapes |= {
            f"{layer.name}.weight": layer.weight_shape,
            f"{layer.name}.bias": (layer.outputs,),
        }
    if missing := shapes.keys() - tensors.keys():
        raise WeightsError(f"{path}: no {', '.join(sorted(missing))}, which {config} has")
    if unknown := tensors.keys() - shapes.keys():
        raise WeightsError(f"{path}: {', '.join(sorted(unknown))} is no part of {config}")
    for name, shape in shapes.items():
        tensor = tensors[name]
        if tensor.shape != shape or not np.issubdtype(tensor.dtype, np.floating):
            raise WeightsError(f"{path}: {name} is {tensor.dtype} of shape {tensor.shape}, "
                               f"{config} needs floats of shape {shape}")  # fmt: skip
        if not np.isfinite(tensor).all():
            raise WeightsError(f"{path}: {name} holds NaN or infinity")


def _checked_range(path: Path, name: str, ends: ndarray) -> tuple[float, float]:
    if ends.shape != (2,) or not np.isfinite(ends).all() or not ends[0] <= 0 < ends[1]:
        raise WeightsError(f"{path}: the int8 range of {name} is {ends}; two finite ends around 0 "
                           "are needed")  # fmt: skip
    return float(ends[0]), float(ends[1])

# SPDX-License-Identifier: Apache-2.0
"""How fast each runtime is, and how far its labels are from those of full precision."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy import ndarray

from kintrack.bench.segmentation.samples import Sample
from kintrack.segmenter import Region
from kintrack.sequence.frame import Frame
from segmentation.architecture import count_flops, count_operations, count_parameters
from segmentation.errors import SegmentationError
from segmentation.evaluate import N, confusion, scores_of
from segmentation.labels import IGNORED
from segmentation.preprocess import frame_input
from segmentation.region import region_of_person
from segmentation.runtime import NetworkSegmenter, RuntimeConfig, labels_of, segmenter
from segmentation.tracking import ImageSegmenter
from segmentation.weights import Weights

VARIANTS = {
    "torch fp32": RuntimeConfig("torch", "fp32"),
    "torch bf16": RuntimeConfig("torch", "bf16"),
    "openvino fp32": RuntimeConfig("openvino", "fp32"),
    "openvino bf16": RuntimeConfig("openvino", "bf16"),
    "openvino-int8": RuntimeConfig("openvino-int8"),
    "torch-cuda fp32": RuntimeConfig("torch-cuda", "fp32"),
    "torch-cuda bf16": RuntimeConfig("torch-cuda", "bf16"),
}
"""Everything that can compute labels; the first that works is what the others are compared with."""
WARM_UP, LEAST, MOST = 5, 20, 500
"""Calls before timing starts; least and most calls that are timed."""


@dataclass(frozen=True)
class Variant:
    """One runtime at work."""

    name: str
    """One of `VARIANTS`."""
    segmenter: NetworkSegmenter
    """It."""


def variants(weights: Weights) -> tuple[list[Variant], dict[str, str]]:
    """Every runtime that works here with these weights, and why the others do not."""
    working: list[Variant] = []
    obstacles: dict[str, str] = {}
    for name, config in VARIANTS.items():
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                made = segmenter(weights, config)
        except SegmentationError as error:
            obstacles[name] = str(error)
            continue
        if made.runtime == config.runtime:
            working.append(Variant(name, made))
        else:
            told = "; ".join(str(warning.message) for warning in caught)
            obstacles[name] = told.partition(", since ")[2] or told
    return working, obstacles


def count(weights: Weights) -> dict[str, Any]:
    """Operations and sizes of a network, as the paper counts them."""
    convolutions, poolings, deconvolutions = count_operations(weights.config)
    return {
        "architecture": weights.config.architecture,
        "widths": list(weights.config.widths),
        "convolutions": convolutions,
        "poolings": poolings,
        "deconvolutions": deconvolutions,
        "parameters": count_parameters(weights.config),
        "gflop": count_flops(weights.config) / 1e9,
    }


def agreement(
    working: Sequence[Variant],
    samples: Sequence[Sample],
    on_frame: Callable[[], None] = lambda: None,
) -> dict[str, dict[str, Any]]:
    """Labels of every runtime against those of the first.

    Args:
        working: Runtimes of one network.
        samples: Frames with true labels.
        on_frame: Called after every frame.

    Returns:
        Runtime -> share of pixels whose label differs, bars left out, and the scores against the
        truth on the same frames.
    """
    counts = {variant.name: np.zeros((N, N), np.int64) for variant in working}
    differing = dict.fromkeys(counts, 0)
    pixels = 0
    for sample in samples:
        assert sample.truth is not None
        inside = sample.truth != IGNORED
        pixels += int(inside.sum())
        reference: ndarray | None = None
        for variant in working:
            labels = labels_of(variant.segmenter.logits_of(sample.image))
            reference = labels if reference is None else reference
            differing[variant.name] += int((labels != reference)[inside].sum())
            counts[variant.name] += confusion(sample.truth, labels)
        on_frame()
    return {
        name: {"differing": differing[name] / max(pixels, 1), **scores_of(table).summary()}
        for name, table in counts.items()
    }


def timing(
    variant: Variant, frames: Sequence[Frame], seconds: float
) -> dict[str, dict[str, float]]:
    """Milliseconds a frame.

    Args:
        variant: A runtime.
        frames: Frames with true labels to go round.
        seconds: How long to measure each [s].

    Returns:
        The network alone; from a frame to labels of its image while the person is tracked, so that
        one look at her is enough; and at a start, which takes two.
    """
    images = [frame_input(frame) for frame in frames]
    regions = [_region(frame) for frame in frames]
    looking = ImageSegmenter(variant.segmenter)
    count = len(frames)
    return {
        "network": _timed(lambda n: variant.segmenter.logits_of(images[n % count]), seconds),
        "tracking": _timed(
            lambda n: looking.segment(frames[n % count], regions[n % count]), seconds
        ),
        "start": _timed(lambda n: looking.segment(frames[n % count]), seconds),
    }


def _region(frame: Frame) -> Region | None:
    """Where the true person is."""
    if frame.labels is None or frame.depth_m is None:
        return None
    return region_of_person(frame.labels, frame.depth_m, frame.camera.fx)


def _timed(call: Callable[[int], object], seconds: float) -> dict[str, float]:
    """Median, 95th percentile and count of calls [ms]."""
    for n in range(WARM_UP):
        call(n)
    found: list[float] = []
    began = time.perf_counter()
    for n in _until(began + seconds):
        start = time.perf_counter()
        call(n)
        found.append(1e3 * (time.perf_counter() - start))
    return {
        "median_ms": float(np.median(found)),
        "p95_ms": float(np.percentile(found, 95)),
        "calls": len(found),
    }


def _until(end: float) -> Iterable[int]:
    for n in range(MOST):
        if n >= LEAST and time.perf_counter() > end:
            return
        yield n

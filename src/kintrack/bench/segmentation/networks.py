# SPDX-License-Identifier: Apache-2.0
"""The networks that are measured."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import segmentation
from kintrack.bench.digest import code_of
from segmentation.runtime import NetworkSegmenter, RuntimeConfig, segmenter
from segmentation.weights import Weights, load_weights

DECIDING = ("architecture", "evaluate", "graph", "labels", "networks", "preprocess", "region",
            "runtime", "tracking")  # fmt: skip
"""Modules of `segmentation` that decide what a network of given weights labels."""
JUDGING = ("judging", "samples", "witness")
"""Modules beside this one that decide how it is judged."""


@dataclass(frozen=True)
class Network:
    """One weights file, ready to label."""

    name: str
    """What it is called in the tables."""
    path: Path
    """Its file."""
    digest: str
    """SHA-256 of the file."""
    weights: Weights
    """What is in it."""
    segmenter: NetworkSegmenter
    """It at work."""

    @property
    def kept_in(self) -> str:
        """Folder of its results, the same under any name."""
        return f"{self.digest[:16]}-{self.segmenter.runtime}"

    @property
    def saw_objects(self) -> bool | None:
        """Whether objects were put into its training pictures; None if it does not say."""
        try:
            config = self.weights.training["config"]
            return config["augment"]["inserted"] > 0 and config["bank"]["cutouts"] > 0
        except (KeyError, TypeError):
            return None


def load_networks(files: Mapping[str, Path], runtime: str = "auto") -> list[Network]:
    """Load weights files.

    Args:
        files: Name -> weights file.
        runtime: What computes their labels.

    Raises:
        WeightsError: if one cannot be used.
        SegmentationError: if nothing here can compute labels.
    """
    loaded = {name: load_weights(path) for name, path in files.items()}
    return [
        Network(
            name,
            files[name],
            hashlib.sha256(files[name].read_bytes()).hexdigest(),
            weights,
            segmenter(weights, RuntimeConfig(runtime)),
        )
        for name, weights in loaded.items()
    ]


def judging_digest() -> str:
    """SHA-256 over the code that decides labels and counts; comments and docstrings do not."""
    deciding = Path(segmentation.__file__).parent
    paths = [deciding / f"{name}.py" for name in DECIDING]
    paths += [Path(__file__).parent / f"{name}.py" for name in JUDGING]
    digest = hashlib.sha256()
    for path in paths:
        digest.update(code_of(path))
    return digest.hexdigest()

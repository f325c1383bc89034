# SPDX-License-Identifier: Apache-2.0
"""Segmenters as the tracker wants them: labels that cover the image, without the picture's bars."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.sequence.frame import Frame
from segmentation.evaluate import true_labels
from segmentation.labels import BACKGROUND, IGNORED
from segmentation.preprocess import letterbox
from segmentation.runtime import RuntimeConfig, Segmenter, load_segmenter
from segmentation.weights import SHIPPED


def image_segmenter(
    weights: Path | None = None, config: RuntimeConfig | None = None
) -> ImageSegmenter:
    """The part segmentation as the tracker takes it.

    Args:
        weights: Weights file; the one that ships if None.
        config: What to run it on; None chooses.

    Raises:
        WeightsError: if the file cannot be used.
        SegmentationError: if no runtime is installed.
    """
    return ImageSegmenter(load_segmenter(weights or SHIPPED, config))


@dataclass(frozen=True)
class ImageSegmenter:
    """A network whose labels cover the image (`kintrack.segmenter.Segmenter`)."""

    network: Segmenter
    """Labels the network's picture."""

    @property
    def name(self) -> str:
        """How the labels are computed."""
        return f"network, {self.network.runtime}"

    def segment(self, frame: Frame) -> UInt8[ndarray, "r c"]:
        """The labels of the cells that lie in the image.

        Raises:
            InputError: if the frame has no depth or a broken one.
        """
        return inside_bars(self.network.segment(frame), frame)


@dataclass(frozen=True)
class TrueSegmenter:
    """The labels that came with the recording, at the network's size: the ceiling of any network.

    A frame without labels shows nobody.
    """

    name = "labels of the recording"
    """As it stands in a result's summary."""

    def segment(self, frame: Frame) -> UInt8[ndarray, "r c"]:
        """True labels of the cells that lie in the image."""
        if frame.labels is None:
            fit = letterbox(frame.camera.width, frame.camera.height)
            return np.zeros((fit.rows, fit.columns), dtype=np.uint8)
        labels = inside_bars(true_labels(frame), frame)
        return np.where(labels == IGNORED, np.uint8(BACKGROUND), labels)


def inside_bars(labels: UInt8[ndarray, "106 128"], frame: Frame) -> UInt8[ndarray, "r c"]:
    """The part of the network's picture that the frame's image fills."""
    fit = letterbox(frame.camera.width, frame.camera.height)
    return labels[fit.top : fit.top + fit.rows, fit.left : fit.left + fit.columns]

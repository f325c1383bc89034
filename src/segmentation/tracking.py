# SPDX-License-Identifier: Apache-2.0
"""Segmenters as the tracker wants them: labels that cover the image, sharpest at the person."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.segmenter import Region
from kintrack.sequence.frame import Frame
from segmentation.errors import InputError
from segmentation.labels import BACKGROUND, IGNORED
from segmentation.preprocess import letterbox, network_input
from segmentation.region import Window, cells_per_pixel, region_of_person, window
from segmentation.runtime import NetworkSegmenter, RuntimeConfig, guesses_of, load_segmenter
from segmentation.weights import SHIPPED

WIDTH_PX = 320
"""Labels of an image come thinned to at most so many columns."""


def thinning(width: int) -> int:
    """n, where labels of an image of this width come for every n-th pixel."""
    return -(-width // WIDTH_PX)


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
    """A network that looks at the whole image first and then closer at the person."""

    network: NetworkSegmenter
    """Labels the network's picture."""
    closer: bool = True
    """Whether the second look is taken; for comparison."""

    @property
    def name(self) -> str:
        """How the labels are computed."""
        return f"network, {self.network.runtime}"

    def segment(self, frame: Frame, region: Region | None = None) -> UInt8[ndarray, "2 r c"]:
        """First and second guess at the labels of the image.

        Args:
            frame: A good frame.
            region: Where the person is, if that is known: then the first look is saved, and what
                lies outside of the region's window is background. Whoever is so near that her
                window is no closer than the image gets one look at the image.

        Returns:
            Labels 0 to 6 of every n-th pixel, so that at most `WIDTH_PX` columns are left; see
            `guesses_of`.

        Raises:
            InputError: if the frame has no depth or a broken one.
        """
        width, height = frame.camera.width, frame.camera.height
        view = _closer(region, frame)
        step = thinning(width)
        out = np.zeros((2, -(-height // step), -(-width // step)), dtype=np.uint8)
        if view is None:
            whole = Window(slice(0, height), slice(0, width), letterbox(width, height))
            self._look(frame, whole, step, out)
            if not self.closer:
                return out
            assert frame.depth_m is not None
            found = region_of_person(out[0], frame.depth_m, frame.camera.fx)
            view = _closer(found, frame)
            if view is None:
                return out
        self._look(frame, view, step, out)
        return out

    def _look(self, frame: Frame, view: Window, step: int, out: UInt8[ndarray, "2 r c"]) -> None:
        """Label what a window shows."""
        if frame.depth_m is None:
            raise InputError(f"frame {frame.index} has no depth: {frame.problem}")
        part = np.s_[view.rows, view.columns]
        color = None if frame.color is None else frame.color[part]
        try:
            image = network_input(frame.depth_m[part], frame.camera.fx, color, view.fit)
        except InputError as error:
            raise InputError(f"frame {frame.index}: {error}") from None
        cells = guesses_of(self.network.logits_of(image))
        rows, first_row = _cells(view.rows, step, view.fit.rows, view.fit.top)
        columns, first_column = _cells(view.columns, step, view.fit.columns, view.fit.left)
        seen = cells[:, rows].take(columns, axis=2)
        out[:, first_row : first_row + len(rows), first_column : first_column + len(columns)] = seen


@dataclass(frozen=True)
class TrueSegmenter:
    """The labels that came with the recording, as fine as a network's come: the ceiling of any.

    A frame without labels shows nobody.
    """

    name = "labels of the recording"
    """As it stands in a result's summary."""

    def segment(self, frame: Frame, region: Region | None = None) -> UInt8[ndarray, "r c"]:
        """True labels of every n-th pixel, wherever a region is; what is unknown is background."""
        labels = frame.labels
        if labels is None:
            labels = np.zeros((frame.camera.height, frame.camera.width), dtype=np.uint8)
        step = thinning(labels.shape[1])
        labels = labels[::step, ::step]
        return np.where(labels == IGNORED, np.uint8(BACKGROUND), labels)


def _closer(region: Region | None, frame: Frame) -> Window | None:
    """The window of a region; None if there is none or if the whole image shows her as large."""
    if region is None:
        return None
    camera = frame.camera
    whole = letterbox(camera.width, camera.height).columns / camera.width
    if cells_per_pixel(region.depth_m, camera.fx) <= whole:
        return None
    return window(region, camera.width, camera.height, camera.fx)


def _cells(span: slice, step: int, count: int, first: int) -> tuple[ndarray, int]:
    """The cells in which every n-th pixel of a span lies, and the number of the first of them."""
    begin = -(-span.start // step)
    pixels = np.arange(begin * step, span.stop, step) - span.start
    return (2 * pixels + 1) * count // (2 * (span.stop - span.start)) + first, begin

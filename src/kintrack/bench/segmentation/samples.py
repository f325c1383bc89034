# SPDX-License-Identifier: Apache-2.0
"""Frames of a case with all that is known of them, ready to be judged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.bench.segmentation.cases import MASK_FOLDER, WITNESS_FILE, Case
from kintrack.bench.segmentation.witness import OWN, VISIBLE
from kintrack.sequence.folder import open_folder
from kintrack.sequence.frame import Frame
from kintrack.sequence.recording import Recording
from kintrack.sequence.reference import read_reference_pixels
from segmentation.errors import InputError
from segmentation.evaluate import labels_shown, true_labels
from segmentation.labels import BACKGROUND, IGNORED
from segmentation.preprocess import (
    HOLE,
    frame_input,
    labels_to_image,
    labels_to_network,
)
from segmentation.runtime import NetworkSegmenter, labels_of
from segmentation.tracking import ImageSegmenter, thinning

RGBD, DEPTH = "RGB-D", "depth only"
"""What a network is shown; the whole image first, then the person."""
RGBD_ONCE, DEPTH_ONCE = "RGB-D, one look", "depth only, one look"
"""The same, the whole image alone."""
MODALITIES = (RGBD, RGBD_ONCE, DEPTH, DEPTH_ONCE)
ROUNDING_M = 0.0015
"""Readings that differ less are the same, written twice [m]."""


class Labelled(NamedTuple):
    """What a network says of a frame."""

    cells: UInt8[ndarray, "106 128"]
    """At the network's size; bars have any label."""
    pixels: UInt8[ndarray, "r c"]
    """Of every n-th pixel of the image, as a tracker gets them."""


@dataclass(frozen=True)
class Sample:
    """A frame ready to be judged."""

    index: int
    """Its number in the recording."""
    image: Float[ndarray, "4 106 128"]
    """The network's input."""
    frame: Frame
    """The frame itself."""
    truth: UInt8[ndarray, "106 128"] | None = None
    """True labels."""
    truth_of_pixels: UInt8[ndarray, "r c"] | None = None
    """The same of every n-th pixel of the image, `IGNORED` where it has no reading."""
    mask: UInt8[ndarray, "106 128"] | None = None
    """1 for the person, 0 for all else, `IGNORED` in the bars."""
    joints: dict[str, Float[ndarray, " 2"]] = field(default_factory=dict)
    """Visible joints that a witness saw [px]."""

    @property
    def read(self) -> Bool[ndarray, "106 128"]:
        """Where there is a depth reading."""
        return np.asarray(self.image[3] != HOLE)

    @property
    def colored(self) -> bool:
        """Whether the frame has colour."""
        return bool(self.image[:3].any())

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the frame [px]."""
        return self.frame.camera.width, self.frame.camera.height

    def labels_by(self, network: NetworkSegmenter, modality: str) -> Labelled:
        """What a network says when it is shown one of `MODALITIES`."""
        bare = modality in (DEPTH, DEPTH_ONCE)
        if modality in (RGBD, DEPTH):
            frame = replace(self.frame, color=None) if bare else self.frame
            pixels = ImageSegmenter(network).segment(frame)[0]
            assert frame.depth_m is not None
            return Labelled(labels_shown(frame.depth_m, pixels), pixels)
        image = self.image
        if bare:
            image = image.copy()
            image[:3] = 0.0
        cells = labels_of(network.logits_of(image))
        step = thinning(self.size[0])
        return Labelled(cells, labels_to_image(cells, *self.size)[::step, ::step])


def samples(case: Case, numbers: Sequence[int] | None = None) -> Iterator[Sample]:
    """The usable ones of some frames of a recording, or of all, read ahead."""
    recording = open_folder(case.sequence)
    joints = _witness(case.sequence / WITNESS_FILE)
    bare = None if case.bare is None else open_folder(case.bare)
    numbers = range(len(recording)) if numbers is None else numbers
    pool = ThreadPoolExecutor(1)
    try:
        read = pool.map(lambda n: _sample(case, recording, bare, joints, n), numbers)
        yield from (sample for sample in read if sample is not None)
    finally:
        pool.shutdown(cancel_futures=True)


def _sample(
    case: Case,
    recording: Recording,
    bare: Recording | None,
    joints: list[dict[str, ndarray]],
    number: int,
) -> Sample | None:
    """A frame with all that is known of it; None if its depth cannot be read or nothing is."""
    frame = recording.frame(number)
    if frame.depth_m is None:
        return None
    try:
        known = _known(frame, bare.frame(number) if bare is not None else None)
        truth = None if known is None else true_labels(known)
        image = frame_input(frame)
        mask = _mask(case.sequence / MASK_FOLDER / f"{number:06d}.png")
    except InputError as error:
        raise InputError(f"{case.sequence}: {error}") from None
    seen = joints[number] if number < len(joints) else {}
    if truth is None and mask is None and not seen:
        return None
    return Sample(number, image, frame, truth, _of_pixels(known), mask, seen)


def _of_pixels(known: Frame | None) -> UInt8[ndarray, "r c"] | None:
    """True labels of the pixels that a tracker gets labels of."""
    if known is None or known.labels is None or known.depth_m is None:
        return None
    step = thinning(known.camera.width)
    labels, depth_m = known.labels[::step, ::step], known.depth_m[::step, ::step]
    return np.where(depth_m > 0, labels, np.uint8(IGNORED))


def _known(frame: Frame, bare: Frame | None) -> Frame | None:
    """The frame with `IGNORED` where the bare person has a reading that nobody labelled.

    None if the frame has no labels.
    """
    if frame.labels is None:
        return None
    if bare is None or bare.depth_m is None or bare.labels is None:
        return frame
    assert frame.depth_m is not None
    own = (bare.depth_m > 0) & (np.abs(frame.depth_m - bare.depth_m) < ROUNDING_M)
    unknown = own & (bare.labels == BACKGROUND)
    marked = np.where(unknown, np.uint8(IGNORED), frame.labels)
    return Frame(frame.index, 0.0, frame.camera, frame.depth_m, labels=marked)


def _mask(path: Path) -> UInt8[ndarray, "106 128"] | None:
    if not path.is_file():
        return None
    image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    if image is None:
        raise InputError(f"{path} is no image")
    return labels_to_network((image > 0).astype(np.uint8))


def _witness(path: Path) -> list[dict[str, ndarray]]:
    """Visible joints of every frame; none without the file."""
    if not path.is_file():
        return []
    names, pixels, visibility = read_reference_pixels(path)
    return [
        {
            name: pixels[n, j]
            for j, name in enumerate(names)
            if name in OWN and visibility[n, j] > VISIBLE and np.isfinite(pixels[n, j]).all()
        }
        for n in range(len(pixels))
    ]

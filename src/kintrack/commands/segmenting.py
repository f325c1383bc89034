# SPDX-License-Identifier: Apache-2.0
"""Options that say what labels the pixels."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from kintrack.segmenter import Segmenter


@dataclass(frozen=True)
class Segmentation:
    """The part segmentation that tells the person from chairs, and arms from legs."""

    labels: Literal["network", "recording", "none"] = "network"
    """network: the part segmentation; recording: labels that came with the recording; none: the
    geometry alone, for one person in front of little else."""
    weights: Path | None = None
    """Other weights than those that ship, from kintrack train."""
    runtime: str = "auto"
    """auto, torch-cuda, openvino-int8, openvino or torch."""

    def segmenter(self) -> Segmenter | None:
        """What the tracker is given.

        Raises:
            WeightsError: if the weights file cannot be used.
            SegmentationError: if nothing installed can run it.
        """
        if self.labels == "none":
            return None
        from segmentation.runtime import RuntimeConfig
        from segmentation.tracking import TrueSegmenter, image_segmenter

        if self.labels == "recording":
            return TrueSegmenter()
        return image_segmenter(self.weights, RuntimeConfig(self.runtime))

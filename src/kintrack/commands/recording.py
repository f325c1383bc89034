# SPDX-License-Identifier: Apache-2.0
"""Options that say how to read a recording."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from kintrack.sequence import SequenceReader


@dataclass(frozen=True)
class Recording:
    """How to read the recording."""

    format: str = "auto"
    """Layout: folder, tum, azure, or auto to tell by the files present."""
    camera: Path | None = None
    """Camera file with the intrinsics; TUM folders need one."""
    depth_scale_m: float | None = None
    """Metres per unit of the depth images, if the recording does not say."""
    fps: float | None = None
    """Frames per second of a recording without time stamps."""
    camera_pitch_deg: float = 0.0
    """How far the camera looks down [deg]."""

    def open(self, path: Path) -> SequenceReader:
        """The recording at a path."""
        from kintrack.sequence import open_sequence

        return open_sequence(
            path,
            format=self.format,
            camera=self.camera,
            depth_scale_m=self.depth_scale_m,
            fps=self.fps,
        )

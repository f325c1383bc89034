# SPDX-License-Identifier: Apache-2.0
"""`kintrack export`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from kintrack.commands.console import console
from kintrack.commands.recording import Recording


@dataclass(frozen=True)
class Export:
    """Write the surface of every tracked frame as PLY and glTF."""

    result: tyro.conf.Positional[Path]
    """Result folder, or the recording that holds it."""
    output: Annotated[Path | None, tyro.conf.arg(aliases=["-o"])] = None
    """Where to; RESULT/surface if not given."""
    sequence: Path | None = None
    """Recording, for residuals; the folder that holds the result if not given."""
    skin: Literal["tracking", "display"] = "tracking"
    """About 3,000 vertices, or 14,000 that carry the offsets of the others."""
    color: Literal["part", "offset", "residual"] = "offset"
    """What the colours mean; red is outwards, blue inwards."""
    formats: tuple[Literal["ply", "gltf"], ...] = ("ply", "gltf")
    """Which files."""
    every: int = 1
    """Every how many frames."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""

    def run(self) -> None:
        """Write one file per frame and format."""
        from kintrack.fit import RESULT_FOLDER
        from kintrack.result import TRACK_FILE
        from kintrack.surfaces import write_surfaces

        folder = self.result if (self.result / TRACK_FILE).exists() else self.result / RESULT_FOLDER
        output = self.output or folder / "surface"
        sequence = None
        if self.color == "residual":
            sequence = self.recording.open(self.sequence or folder.parent)
        written = write_surfaces(
            folder, output, sequence, self.skin, self.color, self.formats, self.every
        )
        console.print(f"{written} frames written to {output}")

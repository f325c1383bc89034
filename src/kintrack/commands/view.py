# SPDX-License-Identifier: Apache-2.0
"""`kintrack view`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from kintrack.commands.console import console
from kintrack.commands.recording import Recording

if TYPE_CHECKING:
    from kintrack.viewer import Viewer


@dataclass(frozen=True)
class View:
    """Replay a result in a browser."""

    result: tyro.conf.Positional[Path]
    """Result folder, or the recording that holds it."""
    sequence: Path | None = None
    """Recording; the folder that holds the result if not given."""
    port: int | None = None
    """Port on this machine; any free one if not given."""
    replay_fps: float | None = None
    """Replay speed [frames/s]; the recording's own if not given."""
    once: bool = False
    """Stop after one replay."""
    color: Literal["part", "offset", "residual"] = "part"
    """What the skin's colours mean: body parts; how far it is raised (red) or lowered (blue); or
    how far outside (red) or inside (blue) of it the observed points lie."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""

    def run(self) -> None:
        """Serve until interrupted."""
        from kintrack.fit import RESULT_FOLDER
        from kintrack.result import TRACK_FILE
        from kintrack.surfaces import load_surfaces
        from kintrack.viewer import replay

        folder = self.result if (self.result / TRACK_FILE).exists() else self.result / RESULT_FOLDER
        surfaces = load_surfaces(folder)
        sequence = self.recording.open(self.sequence or folder.parent)
        viewer = live_viewer(self.port)
        try:
            replay(
                folder,
                sequence,
                viewer,
                surfaces.human.body,
                surfaces.human.skin,
                T_world_camera=surfaces.T_world_camera,
                fps=self.replay_fps,
                loop=not self.once,
                offsets_m=surfaces.offsets_m,
                coloring=self.color,
            )
        finally:
            viewer.close()


def live_viewer(port: int | None) -> Viewer:
    """A viewer on a port of this machine, whose address is printed."""
    from kintrack.human import load_human
    from kintrack.viewer import MeshcatViewer

    viewer = MeshcatViewer(load_human().skin, port)
    console.print(f"watch at {viewer.url}")
    return viewer

# SPDX-License-Identifier: Apache-2.0
"""`kintrack view`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from kintrack.commands.console import console
from kintrack.commands.recording import Recording
from kintrack.fit import RESULT_FOLDER, load_person
from kintrack.human import load_human
from kintrack.result import TRACK_FILE
from kintrack.viewer import MeshcatViewer, Viewer, replay


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
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""

    def run(self) -> None:
        """Serve until interrupted."""
        folder = self.result if (self.result / TRACK_FILE).exists() else self.result / RESULT_FOLDER
        human, T_world_camera = load_person(folder)
        sequence = self.recording.open(self.sequence or folder.parent)
        viewer = live_viewer(self.port)
        try:
            replay(
                folder,
                sequence,
                viewer,
                human.body,
                human.skin,
                T_world_camera=T_world_camera,
                fps=self.replay_fps,
                loop=not self.once,
            )
        finally:
            viewer.close()


def live_viewer(port: int | None) -> Viewer:
    """A viewer on a port of this machine, whose address is printed."""
    viewer = MeshcatViewer(load_human().skin, port)
    console.print(f"watch at {viewer.url}")
    return viewer

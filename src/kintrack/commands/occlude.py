# SPDX-License-Identifier: Apache-2.0
"""`kintrack occlude`."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from kintrack.commands.console import StepProgress, console
from kintrack.commands.recording import Recording
from kintrack.errors import SceneError
from kintrack.geometry import camera_pose
from synthesis.objects.catalogue import THINGS
from synthesis.objects.cutout import load_cutout, load_scene_frame
from synthesis.objects.files import load_thing
from synthesis.objects.thing import Thing
from synthesis.occlusion.occlude import OccludeConfig, occlude


@dataclass(frozen=True)
class Occlude:
    """Insert an object, a real scene, or both into any recording, by depth."""

    sequence: tyro.conf.Positional[Path]
    """Folder of the recording; the person is known by its labels or by an empty background."""
    output: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Sequence folder to write."""
    object: str | None = None
    """What to insert: a kind of thing (any for a random one), a mesh file, or a folder with an
    RGB-D cut-out."""
    scene: Path | None = None
    """Folder of RGB-D frames of a real room to put around the person."""
    scene_frame: int = 0
    """Which of its frames."""
    config: Annotated[OccludeConfig, tyro.conf.OmitArgPrefixes] = field(
        default_factory=OccludeConfig
    )
    """Distance, share, side, sensor, seed."""
    recording: Annotated[Recording, tyro.conf.OmitArgPrefixes] = field(default_factory=Recording)
    """How to read the recording."""

    def run(self) -> None:
        """Write the occluded recording with progress."""
        sequence = self.recording.open(self.sequence)
        thing = None if self.object is None else chosen_thing(self.object, self.config.seed)
        scene = None if self.scene is None else load_scene_frame(self.scene, self.scene_frame)
        with StepProgress() as progress:
            written = occlude(
                sequence,
                self.output,
                thing,
                scene,
                self.config,
                camera_pose(self.recording.camera_pitch_deg),
                lambda n: progress("inserting", n, len(sequence)),
            )
        skipped = f", {written.skipped} bad ones left out" if written.skipped else ""
        console.print(
            f"{written.frames} frames{skipped}, {100 * written.hidden_share:.0f} % of the person "
            f"hidden\nwritten: {self.output}"
        )


def chosen_thing(name: str, seed: int) -> Thing:
    """A thing by kind, file or folder.

    Raises:
        SceneError: if it is none of them.
    """
    rng = np.random.default_rng((seed, 8))
    if name == "any":
        name = str(rng.choice(sorted(THINGS)))
    if name in THINGS:
        return THINGS[name](rng)
    path = Path(name)
    if path.is_dir():
        return load_cutout(path)
    if path.is_file():
        return load_thing(path)
    raise SceneError(
        f"object {name!r}: no file or folder of that name; kinds of things: any, "
        f"{', '.join(sorted(THINGS))}"
    )

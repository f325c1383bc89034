# SPDX-License-Identifier: Apache-2.0
"""Recordings with a real room around the person, an object before her, or both."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from kintrack.bench.cases import REDRAWS, SHARE, Case
from kintrack.bench.made import finish, is_made, recipe_of
from kintrack.errors import SceneError
from kintrack.geometry import camera_pose
from kintrack.sequence import open_sequence
from synthesis.mesh import Mesh
from synthesis.objects.catalogue import held_out_things
from synthesis.objects.cutout import load_scene_frame
from synthesis.occlusion.occlude import OccludeConfig, occlude
from synthesis.occlusion.placing import PlacingConfig


@dataclass(frozen=True)
class Insertion:
    """A recording to be made from a clean one."""

    case: Case
    """What is to be made."""
    clean: Case
    """The recording without anything."""
    seed: int
    """Draws object, view, place and noise; the condition does not change the draws."""
    scenes: Path | None = None
    """Folder of views of a real room; None for no room."""

    def recipe(self) -> str:
        """What the folder must have been made of."""
        scenes = None if self.scenes is None else self.scenes.name
        return recipe_of(self.clean.fingerprint(), self.case.condition, self.seed, scenes)

    def is_made(self) -> bool:
        """Whether it is there, whole, and made of what is asked for."""
        return is_made(self.case.sequence, self.recipe())

    def run(self, on_frame: Callable[[], None]) -> None:
        """Make it; another object or view is drawn where one cannot be placed.

        Args:
            on_frame: Called after every frame.

        Raises:
            SceneError: if none of the draws can.
        """
        folder = self.case.sequence
        problem = SceneError(f"{self.case.name}: nothing to insert")
        for draw in range(REDRAWS):
            rng = np.random.default_rng((self.seed, draw, *self.case.name.encode()))
            things = held_out_things()
            thing = things[str(rng.choice(sorted(things)))](rng)
            seed, view = int(rng.integers(2**31)), rng.random()
            distance_m = self.case.distance_m
            shutil.rmtree(folder, ignore_errors=True)
            try:
                occlude(
                    open_sequence(self.clean.sequence),
                    folder,
                    None if distance_m is None else thing,
                    None if self.scenes is None else view_of(self.scenes, view),
                    OccludeConfig(PlacingConfig(distance_m or 0.45, SHARE), seed=seed),
                    camera_pose(self.case.pitch_deg),
                    on_frame=lambda n: on_frame(),
                )
            except SceneError as error:
                problem = error
                continue
            return finish(folder, self.recipe())
        shutil.rmtree(folder, ignore_errors=True)
        raise problem


def view_of(scenes: Path, share: float) -> Mesh:
    """One of the views of a room, by a number in 0..1.

    Raises:
        SceneError: if there is none.
    """
    count = len(list(scenes.glob("*.depth.png")))
    if count == 0:
        raise SceneError(f"{scenes} holds no NNNNNN.depth.png to put people into")
    return load_scene_frame(scenes, int(share * count))

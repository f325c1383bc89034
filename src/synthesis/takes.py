# SPDX-License-Identifier: Apache-2.0
"""What decides a synthetic recording, in a form that fits into a manifest."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Take:
    """One recording before it is made; the same take gives the same bytes."""

    name: str
    """Folder name."""
    part: str
    """Part of the dataset it belongs to, a folder too."""
    seed: tuple[int, ...]
    """Draws everything that is not named here."""
    person: int
    """Index into the population."""
    action: str
    """An authored action, or the name of a motion capture clip."""
    sensor: str
    """A sensor of the catalogue."""
    frames: int
    """Length."""
    stride: int = 1
    """Motion frames (30 Hz) per recorded frame."""
    room: bool = True
    """Whether floor, walls and furniture surround the person; nothing does otherwise."""
    barrier: bool = False
    """Whether a thing stands between camera and person, if there is room for one."""
    facing: bool = False
    """Whether the person faces the camera to begin with, as somebody does who is recorded."""
    moving_camera: bool = False
    """Whether the camera drifts as a hand or a robot lets it."""
    truncated: bool = False
    """Whether the person may leave the image in part."""
    roaming_arms: bool = False
    """Whether the arms go anywhere instead of what the action does with them."""
    on_sofa: bool = False
    """Whether who sits does so on a sofa or in an armchair; else on a stool or a chair."""
    held_out_things: bool = False
    """Whether its objects are of the kinds that are never trained on."""

# SPDX-License-Identifier: Apache-2.0
"""From a packed picture to a sample for training."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.bounds import check_bounds
from segmentation.augment.absorption import absorbed
from segmentation.augment.color import recolored
from segmentation.augment.geometry import Warp, around, cut, draw_around, draw_warp, warped, whole
from segmentation.augment.insertion import Cutouts, insert, put_behind, without_background
from segmentation.augment.noise import draw_faults, spoilt
from segmentation.errors import SegmentationError
from segmentation.labels import BACKGROUND, IGNORED, person_of
from segmentation.picture import Picture
from segmentation.preprocess import network_input

EMPTY_SHARE = 0.2
"""A picture with readings on less of what is not person has no background."""
EMPTY_ROOMED = 0.5
"""Chance that a picture without background gets a room."""
MOST_INSERTED = 3
"""Objects put into one picture."""
CROPS = 8
"""Views tried to find one without the person."""


@dataclass(frozen=True)
class AugmentConfig:
    """How often what happens to a sample."""

    region: float = 0.5
    """Chance of the window around the person that a closer look shows (`region.py`)."""
    zoomed: float = 0.7
    """Else, chance of zoom, shift, crop, roll and another image shape."""
    zooms: tuple[float, float] = (0.9, 2.2)
    """Least and greatest magnification."""
    roll_deg: float = 6.0
    """Standard deviation of the camera's roll [deg]; half of the zoomed samples have none."""
    cut: float = 0.25
    """Chance that a window around the person ends at an edge of the image."""
    mirrored: float = 0.5
    """Chance that left and right are swapped."""
    inserted: float = 0.75
    """Chance of inserted objects; 0 for the ablation without."""
    most_hidden: float = 0.6
    """Greatest share of the person that one object may hide."""
    nobody: float = 0.1
    """Chance of a picture without person."""
    other_room: float = 0.12
    """Chance that the person stands in another room."""
    background_removed: float = 0.15
    """Chance that only the person's depth is left."""
    depth_only: float = 0.3
    """Chance that colour is dropped."""
    recolored: float = 0.8
    """Chance that colours change."""
    spoilt: float = 0.8
    """Chance of further sensor noise."""
    absorbed: float = 0.3
    """Chance that dark surfaces return no depth."""
    focal_spread: float = 0.02
    """Standard deviation of the relative error of the focal length."""

    def __post_init__(self) -> None:
        chances = ("region", "zoomed", "cut", "mirrored", "inserted", "most_hidden", "nobody",
                   "other_room", "background_removed", "depth_only", "recolored",
                   "spoilt", "absorbed")  # fmt: skip
        check_bounds(self, roll_deg=(0, 45), focal_spread=(0, 0.2),
                     **dict.fromkeys(chances, (0.0, 1.0)))  # fmt: skip
        if len(self.zooms) != 2 or not 0.25 <= self.zooms[0] <= self.zooms[1] <= 8.0:
            raise SegmentationError(f"zooms = {self.zooms!r}: two ascending numbers from 0.25 to 8")


@dataclass(frozen=True)
class Bank:
    """What is put into pictures."""

    cutouts: Cutouts = field(
        default_factory=lambda: Cutouts(
            np.zeros((0, 1, 1), np.float32), np.zeros((0, 1, 1, 3), np.uint8), np.zeros(0)
        )
    )
    """Things."""
    rooms: tuple[Picture, ...] = ()
    """Rooms without people."""


class Sample(NamedTuple):
    """What a network is trained with."""

    image: Float[ndarray, "4 106 128"]
    """Network input."""
    labels: UInt8[ndarray, "106 128"]
    """Its labels, with `IGNORED`."""


def plain_sample(picture: Picture, depth_only: bool = False, closer: bool = False) -> Sample:
    """The picture as it is, or as a closer look at the person shows it."""
    person = np.flatnonzero(person_of(picture.labels)) if closer else np.zeros(0, dtype=int)
    view = warped(picture, around(picture, person) if len(person) else whole(picture))
    return as_sample(view._replace(color=None) if depth_only else view)


def augmented(
    picture: Picture, config: AugmentConfig, bank: Bank, rng: np.random.Generator
) -> Sample:
    """The picture as another camera might have seen it, among other things.

    Args:
        picture: A packed picture.
        config: How often what happens.
        bank: Things and rooms.
        rng: Draws all.
    """
    return as_sample(changed(picture, config, bank, rng), config.focal_spread, rng)


def changed(
    picture: Picture, config: AugmentConfig, bank: Bank, rng: np.random.Generator
) -> Picture:
    """The same before it becomes a network input: depth in metres, shape (106, 128)."""
    chance = dict(zip(("nobody", "background", "room", "color", "tint", "noise"), rng.random(6),
                      strict=True))  # fmt: skip
    if chance["nobody"] < config.nobody:
        view = _empty(picture, config, bank, rng)
    else:
        view = _view(picture, config, rng)
        readings = (view.depth_m > 0)[view.labels == BACKGROUND]
        bare = readings.size > 0 and readings.mean() < EMPTY_SHARE
        if chance["background"] < config.background_removed and not bare:
            view = without_background(view)
        elif bank.rooms and chance["room"] < (EMPTY_ROOMED if bare else config.other_room):
            view = put_behind(view, _room(bank, rng, like=view), 0.4, rng)
    if rng.random() < config.inserted:
        for _ in range(1 + int(rng.integers(0, MOST_INSERTED))):
            view = insert(view, bank.cutouts, config.most_hidden * rng.uniform(0.3, 1.0), rng)
    if rng.random() < config.absorbed:
        view = absorbed(view, rng)
    color, depth = view.color, view.depth_m
    if chance["color"] < config.depth_only:
        color = None
    if color is not None and chance["tint"] < config.recolored:
        color = recolored(color, rng)
    if chance["noise"] < config.spoilt:
        depth = spoilt(depth, draw_faults(rng), rng)
    labels = np.where((depth == 0) & (view.labels != IGNORED), np.uint8(BACKGROUND), view.labels)
    return Picture(depth, color, labels, view.focal_px)


def as_sample(
    view: Picture, focal_spread: float = 0.0, rng: np.random.Generator | None = None
) -> Sample:
    """Network input and labels of a view of the network's size."""
    focal = view.focal_px
    if rng is not None and focal_spread > 0:
        focal *= float(np.exp(rng.normal(0.0, focal_spread)))
    image = network_input(view.depth_m, focal, view.color)
    if view.color is not None:
        image[:3, view.labels == IGNORED] = 0.0
    return Sample(image, view.labels)


def _view(picture: Picture, config: AugmentConfig, rng: np.random.Generator) -> Picture:
    """A view of a picture, most often with the person in it."""
    shift = (0.0, 0.0) if rng.random() < 0.6 else tuple(rng.normal(0.0, 1.0, 2))
    person = np.flatnonzero(person_of(picture.labels))
    near = len(person) > 0 and rng.random() < config.region
    if near:
        warp = draw_around(picture, person, rng, config.roll_deg)
    elif rng.random() < config.zoomed:
        at = None
        if len(person) and rng.random() < 0.9:
            spot = int(person[rng.integers(len(person))])
            at = (spot % picture.labels.shape[1], spot // picture.labels.shape[1])
        warp = draw_warp(picture, rng, config.zooms, config.roll_deg, at)
    else:
        warp = whole(picture)
    mirrored = bool(rng.random() < config.mirrored)
    warp = Warp(warp.zoom, warp.center, warp.roll_rad, mirrored, warp.window)
    view = warped(picture, warp, (shift[0], shift[1]))
    return cut(view, rng) if near and rng.random() < config.cut else view


def _room(bank: Bank, rng: np.random.Generator, like: Picture | None = None) -> Picture:
    """A view of a room; it fills the picture, so that no bar comes with it."""
    room = bank.rooms[int(rng.integers(len(bank.rooms)))]
    warp = draw_warp(room, rng, (1.15, 2.0), 0.0)
    if like is not None:
        warp = Warp(warp.zoom, warp.center, 0.0, warp.mirrored)
    return warped(room, warp)


def _empty(
    picture: Picture, config: AugmentConfig, bank: Bank, rng: np.random.Generator
) -> Picture:
    """A room, or a part of the picture without the person, or its background alone."""
    if bank.rooms:
        return _room(bank, rng)
    for _ in range(CROPS):
        view = warped(picture, draw_warp(picture, rng, (1.3, 3.0), config.roll_deg))
        if not person_of(view.labels).any():
            return view
    view = _view(picture, config, rng)
    person = person_of(view.labels)
    depth = np.where(person, np.float32(0.0), view.depth_m)
    labels = np.where(person, np.uint8(BACKGROUND), view.labels)
    return Picture(depth, None, labels, view.focal_px)

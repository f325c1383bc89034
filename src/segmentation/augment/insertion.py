# SPDX-License-Identifier: Apache-2.0
"""RGB-D cut-outs put before, beside and onto the person, and rooms behind her, by depth [Wan19]."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, UInt8
from numba import njit
from numpy import ndarray

from segmentation.labels import BACKGROUND, IGNORED, person_of
from segmentation.picture import Picture

SCALES = (0.6, 1.6)
"""How much larger than life a cut-out may be."""
STRETCH = 0.2
"""Standard deviation of the logarithm of its width over its height, which were 1."""
BEFORE, HELD = 0.5, 0.25
"""Share of the cut-outs that stand before the person, and of those that touch her as if she held
them or had them in her lap; the others are anywhere about her depth."""
HELD_SIDE_M, HELD_GAP_M = (0.15, 0.9), (-0.05, 0.05)
"""Side of a cut-out that she holds, and from its far side to her surface there [m]."""
GAP_M = (0.02, 0.9)
"""From a cut-out's far side to the person's near side [m]."""
NEAREST_M = 0.4
"""No part of a cut-out comes nearer [m]."""
SPREAD = 0.35
"""How far beside a pixel of the person it is put, share of the root of her pixels."""
PLACES = 6
"""Places tried for a cut-out that is to hide the person."""
ENOUGH = 0.7
"""A place that hides this share of what may be hidden is taken; else the best one is."""
RETREATS = (1.0, 1.15, 1.35, 1.6, 2.0, 2.6)
"""Factors by which a room moves away until it hides little enough of the person."""


@dataclass(frozen=True)
class Cutouts:
    """Views of things, all of one size, one after the other."""

    relief_m: Float[ndarray, "n s s"]
    """Depth beyond the thing's middle [m]; NaN outside of it."""
    color: UInt8[ndarray, "n s s 3"]
    """R G B."""
    meters_per_px: Float[ndarray, " n"]
    """Metres that a pixel spans at the middle."""

    def __len__(self) -> int:
        return len(self.relief_m)


def insert(
    picture: Picture, cutouts: Cutouts, most_hidden: float, rng: np.random.Generator
) -> Picture:
    """Put one cut-out into a picture, before or beside the person, or anywhere if there is nobody.

    Scale, turn, place and depth are drawn; whatever is farther than the cut-out is replaced and
    becomes background. Of some places before the person, one that hides much of her is taken. If
    there is nobody, some other reading takes her place.

    Args:
        picture: Where to put it; not changed.
        cutouts: What to choose from.
        most_hidden: Share of the person's pixels that it may hide.
        rng: Draws.

    Returns:
        The picture with it, or as it was if no place fits.
    """
    reads = picture.depth_m.reshape(-1) > 0
    if not len(cutouts) or not reads.any():
        return picture
    person = np.flatnonzero(person_of(picture.labels).reshape(-1) & reads)
    if not len(person):
        person = rng.choice(np.flatnonzero(reads), 1)
    depths = np.sort(picture.depth_m.reshape(-1)[person])
    near_m, far_m = float(depths[len(depths) // 20]), float(depths[-1 - len(depths) // 20])
    which = int(rng.integers(len(cutouts)))
    relief, color = cutouts.relief_m[which], cutouts.color[which]
    kind = rng.random()
    before, held = kind < BEFORE, BEFORE <= kind < BEFORE + HELD
    best, most = picture, -1
    for _ in range(PLACES):
        scale = math.exp(rng.uniform(math.log(SCALES[0]), math.log(SCALES[1])))
        row, column = divmod(int(person[rng.integers(len(person))]), picture.depth_m.shape[1])
        spread = SPREAD * math.sqrt(len(person))
        if before:
            middle_m = near_m - rng.uniform(*GAP_M) - scale * float(np.nanmax(relief))
        elif held:
            side_m = len(relief) * float(cutouts.meters_per_px[which])
            scale, spread = rng.uniform(*HELD_SIDE_M) / side_m, 0.0
            middle_m = float(picture.depth_m[row, column]) - scale * float(np.nanmax(relief))
            middle_m -= rng.uniform(*HELD_GAP_M)
        else:
            middle_m = rng.uniform(near_m - 0.3, far_m + 0.8)
        turn = rng.uniform(-math.pi, math.pi) if rng.random() < 0.15 else rng.normal(0.0, 0.12)
        center = [column, row] + rng.normal(0.0, spread, 2)
        flip = math.exp(rng.normal(0.0, STRETCH)) * (-1.0 if rng.random() < 0.5 else 1.0)
        noise_m = rng.uniform(0.0, 0.002) * middle_m**2
        seed = np.uint64(rng.integers(1 << 62))
        if middle_m + scale * float(np.nanmin(relief)) < NEAREST_M:
            continue
        px = middle_m / (picture.focal_px * float(cutouts.meters_per_px[which]) * scale)
        c, s = px * math.cos(turn), px * math.sin(turn)
        A = np.array([[flip * c, -flip * s], [s, c]])
        offset = 0.5 * (len(relief) - 1) - A @ center
        depth, labels = picture.depth_m.copy(), picture.labels.copy()
        pixels = np.zeros((0, 0, 3), np.uint8) if picture.color is None else picture.color.copy()
        hidden = _insert(relief, color, A, offset, middle_m, scale, noise_m, seed,
                         depth, pixels, labels)  # fmt: skip
        if most < hidden <= most_hidden * len(person):
            color_now = None if picture.color is None else pixels
            best, most = Picture(depth, color_now, labels, picture.focal_px), hidden
        if not before or most >= ENOUGH * most_hidden * len(person):
            break
    return best


def put_behind(
    picture: Picture, room: Picture, most_hidden: float, rng: np.random.Generator
) -> Picture:
    """Take the person out of a picture and into a room without people.

    The room's depth is scaled so that a pixel of it spans as many metres in both pictures, and
    further about the camera until its furniture hides little of the person. Bars stay bars.

    Args:
        picture: Whose person to take.
        room: A view of a room, same size, with another focal length perhaps.
        most_hidden: Largest share of the person that may be hidden.
        rng: Draws nothing but how far the room is.

    Returns:
        The composite; the person alone if any room would hide too much.
    """
    person = person_of(picture.labels)
    depth = np.where(person, picture.depth_m, np.float32(0.0))
    behind_m = room.depth_m * np.float32(picture.focal_px / room.focal_px * rng.uniform(1.0, 1.3))
    for retreat in RETREATS:
        beyond = behind_m * np.float32(retreat)
        shown = (beyond > 0) & ((depth == 0) | (beyond < depth)) & (picture.labels != IGNORED)
        if (shown & person).sum() <= most_hidden * max(1, person.sum()):
            break
    else:
        return without_background(picture)
    color = None
    if picture.color is not None and room.color is not None:
        color = np.where((person & ~shown)[..., None], picture.color, room.color)
    labels = np.where(shown & person, np.uint8(BACKGROUND), picture.labels)
    return Picture(np.where(shown, beyond, depth), color, labels, picture.focal_px)


def without_background(picture: Picture) -> Picture:
    """The person's depth alone, as recordings have it whose publisher removed the background."""
    depth = np.where(person_of(picture.labels), picture.depth_m, np.float32(0.0))
    return Picture(depth, None, picture.labels, picture.focal_px)


@njit(cache=True)
def _insert(relief, color, A, offset, middle_m, scale, noise_m, seed, depth, pixels, labels):
    """Returns how many of the person's pixels are replaced."""
    height, width = depth.shape
    side = relief.shape[0]
    state = np.uint64(seed) | np.uint64(1)
    hidden = 0
    for i in range(height):
        for j in range(width):
            x = int(np.floor(A[0, 0] * j + A[0, 1] * i + offset[0] + 0.5))
            y = int(np.floor(A[1, 0] * j + A[1, 1] * i + offset[1] + 0.5))
            if not (0 <= x < side and 0 <= y < side) or labels[i, j] == 255:
                continue
            r = relief[y, x]
            if np.isnan(r):
                continue
            d = middle_m + scale * r
            if depth[i, j] > 0.0 and d >= depth[i, j]:
                continue
            state ^= state << np.uint64(13)
            state ^= state >> np.uint64(7)
            state ^= state << np.uint64(17)
            d += noise_m * 3.4641 * (float(state >> np.uint64(11)) / 9007199254740992.0 - 0.5)
            if depth[i, j] > 0.0 and d >= depth[i, j]:
                continue
            hidden += 0 < labels[i, j] < 7
            depth[i, j] = d
            labels[i, j] = 0
            for k in range(3 if pixels.size > 0 else 0):
                pixels[i, j, k] = color[y, x, k]
    return hidden

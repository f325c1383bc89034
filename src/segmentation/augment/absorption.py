# SPDX-License-Identifier: Apache-2.0
"""Dark surfaces that return no depth: leather, hair, trousers."""

from __future__ import annotations

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from segmentation.augment.color import GREY
from segmentation.labels import BACKGROUND, LABELS, person_of
from segmentation.picture import Picture

DARKEST = 0.4
"""Share of the pictures with colour in which whatever is dark goes, not what is drawn."""
MOST_DARK = 0.3
"""Greatest share of an image's readings that its dark surfaces swallow."""
LUMA_GRAIN, LUMA_BLUR_PX = 20.0, 1.0
"""Standard deviation of what decides besides brightness [grey levels], and over how far the sensor
takes the mean of both [px]."""
TROUSERS, HAIR, SEAT = 0.7, 0.4, 0.6
"""Chance that each of them is lost."""
SEAT_DEEP_M = (0.2, 0.9)
"""A seat is as far as its sitter, give or take this much [m]."""
SEAT_WIDE, SEAT_HIGH = (0.2, 1.5), (0.0, 0.6)
"""How far it reaches beside her, share of her width, and how far below her top it begins, share of
her height; both in the picture."""
LOST = (0.4, 1.2)
"""Share of a surface that is lost; from 1 on, all of it."""
DARKER = (0.1, 0.5)
"""What is lost keeps this share of its brightness."""
COARSE_PX, GRAIN = 6, 0.15
"""Size of the blots in which a surface is lost [px], and how much noise frays their edges."""


def absorbed(picture: Picture, rng: np.random.Generator) -> Picture:
    """The picture without the depth of some dark surfaces.

    Either what is darkest in its colours, or trousers, hair and the seat around the person, which
    become dark; so that whoever sits on dark leather in dark trousers, and shows a chest alone, is
    known by that. Labels are left as they are.

    Args:
        picture: Not changed.
        rng: Draws what, how much, and the fraying.
    """
    if picture.color is not None and rng.random() < DARKEST:
        lost = _darkest(picture.depth_m, picture.color, rng)
        return picture._replace(depth_m=_without(picture.depth_m, lost))
    lost = np.zeros(picture.depth_m.shape, dtype=bool)
    for surface, chance in ((_trousers, TROUSERS), (_hair, HAIR), (_seat, SEAT)):
        if rng.random() < chance:
            lost |= _blots(surface(picture, rng), rng)
    color = picture.color
    if color is not None:
        dark = np.rint(color * rng.uniform(*DARKER)).astype(np.uint8)
        color = np.where(lost[..., None], dark, color)
    return picture._replace(depth_m=_without(picture.depth_m, lost), color=color)


def _without(depth_m: Float[ndarray, "h w"], lost: Bool[ndarray, "h w"]) -> Float[ndarray, "h w"]:
    return np.where(lost, np.float32(0.0), depth_m)


def _darkest(
    depth_m: Float[ndarray, "h w"], color: UInt8[ndarray, "h w 3"], rng: np.random.Generator
) -> Bool[ndarray, "h w"]:
    """The darkest of the surfaces; cloth of one colour frays."""
    share = MOST_DARK * rng.random()
    grain = rng.normal(0.0, LUMA_GRAIN, depth_m.shape)
    luma = cv2.GaussianBlur(color @ GREY + grain, (0, 0), LUMA_BLUR_PX)
    read = depth_m > 0
    if not read.any():
        return read
    return np.asarray(luma < np.quantile(luma[read], share))


def _trousers(picture: Picture, rng: np.random.Generator) -> Bool[ndarray, "h w"]:
    legs = [LABELS.index(name) for name in ("right_leg", "left_leg")]
    return np.isin(picture.labels, legs)


def _hair(picture: Picture, rng: np.random.Generator) -> Bool[ndarray, "h w"]:
    return np.asarray(picture.labels == LABELS.index("head"))


def _seat(picture: Picture, rng: np.random.Generator) -> Bool[ndarray, "h w"]:
    """What is no person, about as far as she and about as wide and high."""
    person = person_of(picture.labels) & (picture.depth_m > 0)
    deep_m, wide, high = (float(rng.uniform(*s)) for s in (SEAT_DEEP_M, SEAT_WIDE, SEAT_HIGH))
    if not person.any():
        return person
    rows, columns = np.nonzero(person)
    left, right, top, bottom = columns.min(), columns.max(), rows.min(), rows.max()
    v, u = np.arange(person.shape[0])[:, None], np.arange(person.shape[1])
    reach = wide * (right - left + 1)
    near = np.abs(picture.depth_m - np.median(picture.depth_m[person])) < deep_m
    beside = (u >= left - reach) & (u <= right + reach)
    below = v >= top + high * (bottom - top + 1)
    return np.asarray((picture.labels == BACKGROUND) & near & beside & below)


def _blots(surface: Bool[ndarray, "h w"], rng: np.random.Generator) -> Bool[ndarray, "h w"]:
    """A share of a surface that is drawn, in blots with frayed edges."""
    height, width = surface.shape
    share = min(1.0, rng.uniform(*LOST))
    coarse = rng.random((height // COARSE_PX + 2, width // COARSE_PX + 2), dtype=np.float32)
    field = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    field = field + np.float32(GRAIN) * rng.standard_normal((height, width), dtype=np.float32)
    if not surface.any():
        return surface
    return np.asarray(surface & (field <= np.quantile(field[surface], share)))

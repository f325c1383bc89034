# SPDX-License-Identifier: Apache-2.0
"""Clothes cut from the body's surface: tops, trousers, skirts and dresses."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.errors import SceneError
from synthesis.people.drape import (
    GROUND_M,
    folds,
    near,
    outside,
    step,
    stretched,
    tube_of,
)
from synthesis.people.form import Form
from synthesis.people.hems import COLLARS, HEM, NECK, collared, hung
from synthesis.people.sheet import Sheet, cut

SLEEVE, FRONT = 2, 4
"""Numbers of further cuts."""
HIDDEN_M = 0.09
"""What lies this far from a garment's edge is never seen [m]."""
HIDDEN_SNUG_M = 0.05
"""The same at necklines and sleeves [m]."""
LONG_M = -0.25
"""What ends lower follows the legs like a skirt [m]."""
SHOULDER_EASE_M = 0.005
"""Distance of cloth that lies on the shoulders [m]."""


@dataclass(frozen=True)
class Top:
    """A garment of the trunk."""

    sleeve: float = 0.6
    """Where sleeves end: 0 none, 1 elbow, 1.9 wrist."""
    ease_m: float = 0.012
    """Distance from what is under it [m]."""
    sleeve_room_m: float = 0.015
    """How much wider than the arm a sleeve ends [m]."""
    hem_m: float = -0.04
    """Height of the lower edge above the hip joints [m]; far below zero is a dress."""
    slope: float = 0.25
    """How fast it narrows below the chest [m/m]."""
    flare: float = 0.0
    """How fast a dress widens below the waist [m/m]."""
    neckline: float = 0.7
    """How deep the neckline is cut in front, 0.6..1.3."""
    collar: str = "crew"
    """One of `COLLARS`, or `none`."""
    open_m: float = 0.0
    """Half the width that gapes in front [m]; 0 is closed."""
    folds_m: float = 0.010
    """Height of the folds [m]."""
    cuff: float = 0.0
    """How far a sleeve is drawn together at the wrist, 0..1."""

    def __post_init__(self) -> None:
        if self.collar not in COLLARS:
            raise SceneError(f"collar {self.collar!r}: {', '.join(COLLARS)} are allowed")


@dataclass(frozen=True)
class Trousers:
    """Two legs from the waist down."""

    hem: float = 1.95
    """Where they end: 1 knee, 2 ankle."""
    waist_m: float = 0.10
    """Height of the upper edge above the hip joints [m]."""
    ease_m: float = 0.006
    """Distance from the body [m]."""
    hem_radius_m: float = 0.075
    """Radius of a leg's lower edge [m]."""
    folds_m: float = 0.012
    """Height of the folds [m]."""


@dataclass(frozen=True)
class Skirt:
    """One tube around hips and both legs."""

    hem_m: float = -0.45
    """Height of the lower edge above the hip joints [m]."""
    waist_m: float = 0.10
    """Height of the upper edge above the hip joints [m]."""
    flare: float = 0.15
    """How fast it widens [m/m]; below zero it narrows."""
    folds_m: float = 0.012
    """Height of the hanging folds [m]."""
    ease_m: float = 0.006
    """Distance from the body [m]."""


@dataclass(frozen=True)
class Layer:
    """A garment and what it does to the layers below and above."""

    sheet: Sheet
    """Its surface."""
    outside: Float[ndarray, "v 3"]
    """The form with the garment on, which the next one must not enter [m]."""
    hides: Bool[ndarray, " v"]
    """Vertices of the form that are deep under it."""


def sew_top(form: Form, under: Float[ndarray, "v 3"], top: Top, seed: int) -> Layer:
    """A shirt, jacket, hoodie or dress.

    Args:
        form: Body.
        under: The form with the layers below [m], shape (V, 3).
        top: Its cut.
        seed: Of the folds.
    """
    arms, z = form.arms, under[:, 2]
    hip, shoulder = form.origin("l_thigh")[2], form.origin("l_upper_arm")[2]
    waist = form.origin("abdomen")[2] + 0.03
    end, edge, armpit = hip + top.hem_m, max(hip + 0.05, hip + top.hem_m), shoulder - 0.09
    trunk = (arms.share < 0.25) & (z < armpit)
    slopes = (top.slope, -top.flare if top.flare else top.slope)
    tube = tube_of(under[trunk], min(end, edge) - 0.02, armpit, slopes, waist, top.ease_m)
    azimuth, reach = tube.polar(under)
    radial = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * z], axis=1)
    low = step(z, armpit + 0.01, armpit - 0.10) * (1.0 - step(arms.share, 0.15, 0.6))
    push = low * np.maximum(tube.radius(azimuth, z) - reach, 0.0)
    ease = SHOULDER_EASE_M + (top.ease_m - SHOULDER_EASE_M) * np.maximum(
        step(z, shoulder + 0.02, shoulder - 0.12), step(arms.at, 0.1, 0.5)
    )
    widen = arms.share * top.sleeve_room_m * step(arms.at, 0.25, max(top.sleeve, 0.5))
    widen = widen * (1.0 - top.cuff * step(arms.at, top.sleeve - 0.4, top.sleeve - 0.08))
    sides = 0.35 + 0.65 * step(form.normals[:, 2], 0.7, -0.3)
    wanted = under + radial * push[:, None] + form.normals * ((1.0 - low) * ease)[:, None]
    wanted = wanted + arms.outward * (widen * sides)[:, None]
    if top.open_m:
        flap = near(np.abs(under[:, 1]), top.open_m + 0.02, 0.06) * low * (form.normals[:, 0] > 0.2)
        wanted = wanted + np.array([1.0, 0.0, 0.0]) * (0.018 * flap)[:, None]
    neck = form.origin("neck") + [0.0, 0.0, 0.024 - 0.03 * (top.neckline - 0.7)]
    taut = step(np.linalg.norm(under - neck, axis=1), 0.09, 0.17)
    x = stretched(form, wanted, under, np.minimum(ease, 0.004 + 0.4 * ease), tension=taut)
    ridge = folds(form, top.folds_m, (top.sleeve, 9.0, hip + top.hem_m), seed)
    flat = top.cuff * arms.share * step(arms.at, top.sleeve - 0.2, top.sleeve - 0.1)
    x = x + form.normals * (taut * (1.0 - flat) * ridge)[:, None]
    slant = np.array([top.neckline, 0.0, 1.0]) / np.hypot(1.0, top.neckline)
    neckline = np.maximum((neck - x) @ slant, np.linalg.norm(x - neck, axis=1) - 0.19)
    length = np.linalg.norm(form.origin("l_forearm") - form.origin("l_upper_arm"))
    armhole = (0.4 - arms.share) * 0.1
    sleeve = (top.sleeve - arms.at) * length if top.sleeve > 0.3 else armhole
    hanging = arms.share > 0.3
    lower = np.where(hanging, 1.0, x[:, 2] - edge)
    sheet = _cut_out(_sheet(form, x, under), (NECK, neckline), (SLEEVE, sleeve), (HEM, lower))
    if end < edge - 0.01:
        follow = 1.0 if top.hem_m < LONG_M else 0.4
        sheet = hung(form, under, sheet, tube, end, top.folds_m, follow, seed)
    sheet = collared(form, x, sheet, top.collar)
    snug = np.minimum(neckline, sleeve) + HIDDEN_M - HIDDEN_SNUG_M
    fields = np.minimum(snug, np.where(hanging, 1.0, x[:, 2] - end))
    if top.open_m:
        gape = np.maximum(
            _gape(sheet.vertices, top.open_m, edge), tube.axis_x_m - sheet.vertices[:, 0]
        )
        sheet = cut(sheet, gape, FRONT)
        gape = np.maximum(_gape(x, top.open_m, edge), tube.axis_x_m - x[:, 0])
        fields = np.minimum(fields, np.where(hanging, 1.0, gape))
    return Layer(sheet, x, fields > HIDDEN_M)


def sew_trousers(form: Form, under: Float[ndarray, "v 3"], cloth: Trousers, seed: int) -> Layer:
    """Trousers or shorts; arguments as in `sew_top`."""
    legs, hip = form.legs, form.origin("l_thigh")[2]
    thigh = (np.abs(legs.at - 0.35) < 0.08) & (legs.share > 0.5)
    full = legs.radius_m[thigh].mean() + cloth.ease_m
    target = full + (cloth.hem_radius_m - full) * np.clip((legs.at - 0.35) / 1.65, 0.0, 1.1)
    slack = target - legs.radius_m - cloth.ease_m
    soft = 0.5 * (slack + np.sqrt(slack**2 + 0.01**2))
    widen = soft * legs.share * step(legs.at, 0.12, 0.5)
    wanted = under + form.normals * cloth.ease_m + legs.outward * widen[:, None]
    x = stretched(form, wanted, under, np.full(len(under), 0.6 * cloth.ease_m))
    ridge = folds(form, cloth.folds_m, (9.0, cloth.hem, 9.0), seed)
    x = x + form.normals * ridge[:, None]
    inner = (legs.share > 0.5) & (legs.at < 0.8)
    x[:, 1] = np.where(inner, form.side * np.maximum(form.side * x[:, 1], 0.004), x[:, 1])
    x = outside(form, x, under, np.full(len(under), GROUND_M))
    length = np.linalg.norm(form.origin("l_shank") - form.origin("l_thigh"))
    upper = np.where(form.arms.share > 0.3, -1.0, hip + cloth.waist_m - x[:, 2])
    lower = (cloth.hem - legs.at) * length
    sheet = _cut_out(_sheet(form, x, under), (NECK, upper), (HEM, lower))
    return Layer(sheet, x, np.minimum(upper + 0.06, lower) > HIDDEN_M)


def sew_skirt(form: Form, under: Float[ndarray, "v 3"], skirt: Skirt, seed: int) -> Layer:
    """A skirt; arguments as in `sew_top`."""
    hip, z = form.origin("l_thigh")[2], under[:, 2]
    top, edge, end = hip + skirt.waist_m, hip + 0.03, hip + skirt.hem_m
    body = form.arms.share < 0.2
    slopes = (-skirt.flare, -skirt.flare)
    tube = tube_of(under[body], end - 0.02, top + 0.03, slopes, top, skirt.ease_m)
    azimuth, reach = tube.polar(under)
    radial = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * z], axis=1)
    push = np.where(body, np.maximum(tube.radius(azimuth, z) - reach, 0.0), 0.0)
    wanted = under + radial * (push * step(z, top + 0.04, top - 0.02))[:, None]
    x = stretched(form, wanted, under, np.full(len(under), 0.6 * skirt.ease_m), 12)
    upper = np.where(body, top - x[:, 2], -1.0)
    sheet = _cut_out(_sheet(form, x, under), (NECK, upper), (HEM, x[:, 2] - edge))
    sheet = hung(form, under, sheet, tube, end, skirt.folds_m, 1.0, seed)
    worn = np.where((body & (z > edge))[:, None], x, under)
    return Layer(sheet, worn, np.minimum(upper + 0.06, z - end) > HIDDEN_M + 0.05)


def _sheet(form: Form, x: Float[ndarray, "v 3"], under: Float[ndarray, "v 3"]) -> Sheet:
    gap = np.clip(((x - under) * form.normals).sum(axis=1) - GROUND_M, 0.0, 0.06)
    gap = form.smoothed(gap, 4)
    n = len(x)
    return Sheet(
        x,
        form.faces,
        form.weights,
        form.labels,
        gap,
        gap,
        np.zeros(n, np.uint8),
        np.arange(n),
        np.zeros((n, 0)),
    )


def _cut_out(sheet: Sheet, *cuts: tuple[int, Float[ndarray, " v"]]) -> Sheet:
    """The sheet after all cuts, each with its number and its field."""
    sheet = replace(sheet, fields=np.stack([field for _, field in cuts], axis=1))
    for n, (number, _) in enumerate(cuts):
        sheet = cut(sheet, sheet.fields[:, n], number)
    return sheet


def _gape(x: Float[ndarray, "n 3"], half_m: float, bottom_m: float) -> Float[ndarray, " n"]:
    """Distance from the opening in front, which widens downwards [m]."""
    return np.abs(x[:, 1]) - half_m * (1.0 + 1.2 * np.clip(bottom_m + 0.35 - x[:, 2], -0.2, 0.6))

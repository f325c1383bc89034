# SPDX-License-Identifier: Apache-2.0
"""Dressing: every piece of an outfit put on, from the skin outwards."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Bool
from numpy import ndarray

from synthesis.mesh import Material
from synthesis.patterns import Face, Plain, Skin
from synthesis.people.beard import grow_beard
from synthesis.people.figure import Figure, bare_body, figure_of
from synthesis.people.form import Form, dense_weights, form_of
from synthesis.people.garments import Layer, Skirt, Trousers, sew_skirt, sew_top, sew_trousers
from synthesis.people.hair import grow_hair
from synthesis.people.hats import put_on_hat
from synthesis.people.outfits import Outfit, draw_outfit
from synthesis.people.person import SIDES, Person
from synthesis.people.scalp import Head, head_of
from synthesis.people.sheet import Sheet, without
from synthesis.people.shoes import SHAFT_WALL_M, make_shafts, make_shoe

SKIN_INFRARED = 0.55
SOCK_M, SOCK_WALL_M = 0.09, 0.003
"""Height of socks above the ankles and their thickness [m]."""
TUCKED_M = 0.03
"""How far a top that is tucked in reaches below the waist of trousers or skirt [m]."""
EYES = Material(Plain((0.30, 0.27, 0.25)), 0.4, 0.3)


def dress(person: Person, rng: np.random.Generator, outfit: Outfit | None = None) -> Figure:
    """A person with clothes, shoes and hair.

    Args:
        person: Bare person.
        rng: Draws the outfit, folds and locks.
        outfit: What is worn; drawn if None.
    """
    outfit = draw_outfit(person.facts, rng) if outfit is None else outfit
    seed = int(rng.integers(1 << 30))
    form, head = form_of(person), head_of(person)
    layers = _sewn(form, outfit, seed)
    hidden = np.zeros(len(form.vertices), bool)
    worn: list[tuple[str, Sheet, Material]] = []
    for name, layer in reversed(layers):
        deep = np.where(layer.sheet.base >= 0, hidden[layer.sheet.base], False)
        if not deep.all():
            worn.append((name, without(layer.sheet, deep), outfit.material(name)))
        hidden = hidden | layer.hides
    feet, below, bare_feet = _shod(form, outfit)
    worn += feet
    around = layers[-1][1].outside if layers else form.vertices
    worn += _head_gear(head, outfit, around[form.arms.share < 0.2], seed)
    gone = _gone(person, form, hidden | below) | bare_feet
    face = Face(Skin(outfit.tone, seed=seed), outfit.hair_color, tuple(head.centre), head.scale)
    bare = bare_body(person, gone, Material(face, SKIN_INFRARED, 0.08), EYES)
    return figure_of(person, bare, worn)


def _sewn(form: Form, outfit: Outfit, seed: int) -> list[tuple[str, Layer]]:
    """Layers from the inside out."""
    order = ("top", "bottom") if outfit.tucked else ("bottom", "top")
    layers: list[tuple[str, Layer]] = []
    under, waist = form.vertices, getattr(outfit.bottom, "waist_m", None)
    for n, name in enumerate((*order, "jacket")):
        cloth = getattr(outfit, name)
        if cloth is None:
            continue
        if isinstance(cloth, Trousers):
            layer = sew_trousers(form, under, cloth, seed + n)
        elif isinstance(cloth, Skirt):
            layer = sew_skirt(form, under, cloth, seed + n)
        else:
            if name == "top" and outfit.tucked and waist is not None:
                cloth = replace(cloth, hem_m=waist - TUCKED_M)
            layer = sew_top(form, under, cloth, seed + n)
        layers.append((name, layer))
        under = layer.outside
    return layers


def _shod(
    form: Form, outfit: Outfit
) -> tuple[list[tuple[str, Sheet, Material]], Bool[ndarray, " v"], Bool[ndarray, " s"]]:
    """Shoes and socks, and what they hide of the form and of the person's skin."""
    worn: list[tuple[str, Sheet, Material]] = []
    below = np.zeros(len(form.vertices), bool)
    person, names = form.person, form.person.skin.link_names
    gone = np.zeros(len(person.bind_vertices), bool)
    shoe = outfit.shoe
    if outfit.socks:
        sheet, below = make_shafts(form, SOCK_M, SOCK_WALL_M)
        worn.append(("socks", sheet, outfit.material("socks")))
    if shoe is not None:
        worn += [("shoe", make_shoe(form, side, shoe), outfit.material("shoe")) for side in SIDES]
        if shoe.shaft_m:
            sheet, hides = make_shafts(form, shoe.shaft_m, SHAFT_WALL_M)
            worn.append(("shoe", sheet, outfit.material("shoe")))
            below = below | hides
        foot = dense_weights(person)[:, [names.index(f"{side}_foot") for side in SIDES]].sum(axis=1)
        low = person.bind_vertices[:, 2] < form.origin("l_foot")[2] - 0.03
        gone = (foot > 0.6) & low
    return worn, below, gone


def _head_gear(
    head: Head, outfit: Outfit, around: ndarray, seed: int
) -> list[tuple[str, Sheet, Material]]:
    """Hair, beard and hat."""
    worn: list[tuple[str, Sheet, Material]] = []
    if outfit.hair is not None:
        for sheet in grow_hair(head, outfit.hair, around, float(bool(outfit.hat)), seed):
            worn.append(("hair", sheet, outfit.material("hair")))
    if outfit.beard_m:
        worn.append(("hair", grow_beard(head, outfit.beard_m, seed), outfit.material("hair")))
    if outfit.hat:
        worn.append(("hat", put_on_hat(head, outfit.hat, seed), outfit.material("hat")))
    return worn


def _gone(person: Person, form: Form, hidden: Bool[ndarray, " v"]) -> Bool[ndarray, " s"]:
    """Vertices of the person's skin that lie deep under clothes."""
    gone = np.zeros(len(person.bind_vertices), bool)
    coarse = form.skin_vertex >= 0
    gone[form.skin_vertex[coarse]] = hidden[coarse]
    return gone

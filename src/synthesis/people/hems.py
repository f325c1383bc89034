# SPDX-License-Identifier: Apache-2.0
"""What hangs from a cut or stands on it: the lower part of skirts and shirts, collars, hoods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial import cKDTree

from synthesis.noise import noise
from synthesis.people.drape import Tube, step
from synthesis.people.form import Form
from synthesis.people.sheet import Sheet, hem, lengthened, smoother

NECK, HEM = 1, 3
"""Numbers of the upper and the lower cut."""
ROW_M = 0.022
"""Height of a row of hanging cloth [m]."""
PLEAT_M = 0.055
"""Width of a hanging fold [m]."""
BETWEEN = 0.85
"""Half the width of cloth that both legs move, as a share of half the distance of the hips."""
WEIGHT_ROUNDS = 12
"""Rounds in which hanging cloth shares its weights around the body."""
ROOM_M = 0.08
"""Most room of hanging cloth at its lower edge [m]."""
COLLAR_GROUND_M = 0.001
"""Least distance of a collar from what it lies on [m]."""
COLLARS = {
    "none": (),
    "crew": ((-0.001, 0.007), (-0.003, 0.014)),
    "collar": ((0.000, 0.016), (0.002, 0.030), (0.011, 0.030), (0.022, 0.012), (0.030, -0.008)),
    "high": ((-0.001, 0.015), (-0.002, 0.032), (0.003, 0.046), (0.009, 0.044), (0.010, 0.028)),
    "hood": ((0.004, 0.02), (0.016, 0.034), (0.036, 0.036), (0.058, 0.018), (0.068, -0.015),
             (0.064, -0.055), (0.048, -0.085), (0.022, -0.10)),
}  # fmt: skip
"""Steps from the neckline, outward and upward [m]."""


def hung(
    form: Form,
    under: Float[ndarray, "v 3"],
    sheet: Sheet,
    tube: Tube,
    end_m: float,
    folds_m: float,
    follow: float,
    seed: int,
) -> Sheet:
    """The sheet lengthened from its lower cut to a height, round both legs.

    Args:
        form: Body; its legs move what hangs.
        under: The form with the layers below [m], shape (V, 3).
        sheet: Garment that is cut level.
        tube: Where the cloth hangs.
        end_m: Height of the lower edge [m].
        folds_m: Height of the folds at the lower edge [m].
        follow: How far it follows the legs behind, 0..1.
        seed: Of the folds.
    """
    start = hem(sheet, HEM)
    top = sheet.vertices[start]
    azimuth, reach = tube.polar(top)
    excess = reach - tube.radius(azimuth, top[:, 2])
    count = max(2, round((top[:, 2].mean() - end_m) / ROW_M))
    rows, room = [], []
    for n in range(1, count + 1):
        t = n / count
        z = top[:, 2] + (end_m - top[:, 2]) * t
        ring = np.stack([np.cos(azimuth), np.sin(azimuth), 0.25 * (z - end_m)], axis=1)
        fold = folds_m * step(t, 0.0, 0.6) * (0.5 + 0.5 * noise(ring / [0.3, 0.3, 1.0] / 0.9, seed))
        pleat = noise(ring * [1.0, 1.0, 0.3] * (0.2 / PLEAT_M), seed + 1)
        fold = fold + 0.7 * folds_m * step(t, 0.0, 0.5) * pleat
        radius = tube.radius(azimuth, z) + excess * (1.0 - t) + np.maximum(fold, 0.0)
        x = tube.axis_x_m + radius * np.cos(azimuth)
        rows.append(np.stack([x, radius * np.sin(azimuth), z], axis=1))
        room.append(min(ROOM_M, 0.012 + 0.15 * t * (top[:, 2].mean() - end_m)))
    body = np.flatnonzero(form.arms.share < 0.1)
    distance, nearest = cKDTree(under[body]).query(np.concatenate(rows), k=8)
    near = body[nearest]
    weights = form.weights[near].mean(axis=1)
    weights = _shared(form, weights, np.concatenate(rows)[:, 1]).reshape(count, len(start), -1)
    weights = _kept_back(form, weights, follow + (1.0 - follow) * step(np.cos(azimuth), -0.6, 0.6))
    labels = form.labels[near[:, 0]].reshape(count, -1)
    old = len(sheet.vertices)
    sheet = lengthened(sheet, HEM, rows, list(weights), list(labels), np.array(room))
    gap = np.r_[sheet.gap_m[:old], np.maximum(0.85 * np.asarray(distance)[:, 0] - 0.005, 0.0)]
    mean = smoother(sheet.faces, len(sheet.vertices))
    both = np.column_stack([sheet.weights, gap])
    for _ in range(WEIGHT_ROUNDS):
        both = np.concatenate([both[:old], (0.5 * both + 0.5 * (mean @ both))[old:]])
    return replace(sheet, weights=both[:, :-1], gap_m=both[:, -1])


def _shared(
    form: Form, weights: Float[ndarray, "n l"], y: Float[ndarray, " n"]
) -> Float[ndarray, "n l"]:
    """Weights in which left and right legs share what hangs between them."""
    names = form.person.skin.link_names
    half = BETWEEN * form.origin("l_thigh")[1]
    left = step(y, -half, half)
    out = weights.copy()
    for link in ("thigh", "shank", "foot"):
        a, b = names.index(f"l_{link}"), names.index(f"r_{link}")
        both = weights[:, a] + weights[:, b]
        out[:, a], out[:, b] = both * left, both * (1.0 - left)
    return out


def _kept_back(
    form: Form, weights: Float[ndarray, "k n l"], share: Float[ndarray, " n"]
) -> Float[ndarray, "k n l"]:
    """Weights of which only a share of the legs' is kept; the pelvis takes the rest."""
    names = form.person.skin.link_names
    legs = [names.index(f"{side}_{link}") for side in "lr" for link in ("thigh", "shank", "foot")]
    out = weights.copy()
    out[:, :, legs] *= share[:, None]
    out[:, :, names.index("pelvis")] += 1.0 - out.sum(axis=2)
    return out


def collared(form: Form, below: Float[ndarray, "v 3"], sheet: Sheet, kind: str) -> Sheet:
    """The sheet with a collar, a band or a lowered hood on its neckline.

    Args:
        form: Body.
        below: The form with the garment on, which the collar does not enter [m], shape (V, 3).
        sheet: Garment.
        kind: One of `COLLARS`.
    """
    profile = np.array(COLLARS[kind]).reshape(-1, 2)
    start = hem(sheet, NECK)
    if not len(profile) or not len(start):
        return sheet
    top = sheet.vertices[start]
    neck = form.origin("neck")
    outward = top - [neck[0], 0.0, 0.0]
    outward[:, 2] = 0.0
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    if kind == "hood":
        back = step(outward[:, 0], 0.55, -0.5)
        size = 0.20 + 0.90 * back + 0.1 * noise(top / 0.03, 5)
    else:
        size = np.ones(len(top))
    rows, tree = [], cKDTree(below)
    for out, up in profile:
        row = top + outward * (out * size)[:, None] + [0.0, 0.0, 1.0] * (up * size)[:, None]
        nearest = tree.query(row)[1]
        normals = form.normals[nearest]
        depth = COLLAR_GROUND_M - ((row - below[nearest]) * normals).sum(axis=1)
        rows.append(row + np.maximum(depth, 0.0)[:, None] * normals)
    k = len(rows)
    weights, labels = sheet.weights[start], sheet.labels[start]
    return lengthened(sheet, NECK, rows, [weights] * k, [labels] * k, np.full(k, 0.002))

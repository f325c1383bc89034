# SPDX-License-Identifier: Apache-2.0
"""Left taken for right, back for front: found while tracking, and undone.

Where posed skin lies on labelled pixels, model labels and pixel labels are counted against each
other. A limb on pixels of the other side's limb speaks for a swap, one on its own for none. A frame
is no proof, networks err for many; so the shares are summed over time with a memory of about a
second, arms and legs apart, and only a sum far below zero asks for a new start. The new pose is
taken only if it agrees better with points and labels than the one there was, and no worse with the
points alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numba import njit
from numpy import ndarray

from kintrack.alignment import View, view_skin
from kintrack.association.observation import Observation
from kintrack.config import TrackerConfig, check_bounds
from kintrack.geometry import LABELS, invert_rigid
from kintrack.human import Human
from kintrack.start import LabelledStartConfig, Start, start_at
from kintrack.start.evidence import evidence_of
from kintrack.start.placing import view_mismatch

NEAR_M = 0.12
"""A vertex lies on a pixel whose depth differs less than this [m]."""
PAIRS = {"arms": (3, 4), "legs": (5, 6)}
"""Labels of right and left limbs."""


@dataclass(frozen=True)
class FlipConfig:
    """When a swap is believed."""

    memory: float = 0.97
    """Share of a frame's evidence left one frame later."""
    enough: int = 30
    """Vertices of a pair of limbs on its pixels that make a whole frame's evidence."""
    swapped: float = -8.0
    """Sum of evidence below which a new start is tried; 1 / (1 - memory) is the most there is."""
    better: float = 0.9
    """A new pose is taken if its mismatch is at most this share of the old one's,"""
    no_worse: float = 1.05
    """and at most this share of it where sides are left out."""
    again: int = 20
    """Frames between two tries."""

    def __post_init__(self) -> None:
        check_bounds(
            self,
            memory=(0, 0.999),
            enough=(1, 10_000),
            swapped=(-1000, 0),
            better=(0, 1),
            no_worse=(0, 10),
            again=(0, 10_000),
        )


@dataclass(frozen=True)
class FlipWatch:
    """Evidence so far: above zero for the sides as they are, below for a swap."""

    arms: float = 0.0
    """Of the arms."""
    legs: float = 0.0
    """Of the legs."""
    wait: int = 0
    """Frames to pass before another try."""

    def suspects(self, config: FlipConfig) -> bool:
        """True if a swap is to be undone now."""
        return self.wait == 0 and min(self.arms, self.legs) < config.swapped


def label_counts(view: View, observation: Observation) -> Int[ndarray, "7 7"]:
    """How many visible vertices of label i lie on pixels of label j.

    Args:
        view: The skin seen by the camera.
        observation: Labelled points, sides as the network gave them.

    Returns:
        `counts[model, pixel]`; vertices with nothing near them are not counted.
    """
    if observation.labels is None:
        return np.zeros((len(LABELS), len(LABELS)), dtype=np.int64)
    camera = observation.camera
    return _count(
        view.vertices_camera[view.visible],
        view.labels[view.visible],
        observation.points_camera[..., 2],
        observation.labels,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        len(LABELS),
    )


def label_agreement(counts: Int[ndarray, "7 7"]) -> float:
    """Share of skin on any person's pixels that lies on pixels of its own part; NaN for none."""
    on_person = counts[1:, 1:]
    total = int(on_person.sum())
    return float(np.trace(on_person) / total) if total else float("nan")


def watched(watch: FlipWatch, counts: Int[ndarray, "7 7"], config: FlipConfig) -> FlipWatch:
    """The evidence after another frame.

    Args:
        watch: The evidence before.
        counts: Of the frame, see `label_counts`.
        config: Memory.
    """
    shares = {}
    for name, (right, left) in PAIRS.items():
        own = int(counts[right, right] + counts[left, left])
        other = int(counts[right, left] + counts[left, right])
        seen = own + other
        shares[name] = (own - other) / max(seen, config.enough)
    return FlipWatch(
        arms=config.memory * watch.arms + shares["arms"],
        legs=config.memory * watch.legs + shares["legs"],
        wait=max(watch.wait - 1, 0),
    )


def unflipped(
    human: Human,
    view: View,
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    start: LabelledStartConfig,
    flip: FlipConfig,
) -> Start | None:
    """A new start in place of a pose that seems to be flipped.

    Args:
        human: Body and skin.
        view: The skin in the doubtful pose.
        observation: One person's labelled points.
        T_world_camera: Camera pose.
        config: All weights.
        start: How many headings and fits; sides are believed more than at a first start.
        flip: How much better it must be.

    Returns:
        The start; None if it is no better than the pose there is.
    """
    if observation.labels is None or not observation.region.any():
        return None
    sure = replace(start, side_m=3.0 * start.side_m)
    found = start_at(human, observation, T_world_camera, config, sure)
    if found is None:
        return None
    evidence = evidence_of(observation, T_world_camera)
    new = view_skin(human, found.fit.state, invert_rigid(T_world_camera), observation, config)
    for side_m, share in ((sure.side_m, flip.better), (0.0, flip.no_worse)):
        before = view_mismatch(view, evidence, side_m)
        if not view_mismatch(new, evidence, side_m) <= share * before:
            return None
    return found


def tried(config: FlipConfig) -> FlipWatch:
    """The evidence after a try, whatever came of it: forgotten, and no other try for a while."""
    return FlipWatch(wait=config.again)


@njit(cache=True)
def _count(skin, part, z, labels, fx, fy, cx, cy, kinds):
    out = np.zeros((kinds, kinds), dtype=np.int64)
    h, w = z.shape
    for i in range(skin.shape[0]):
        u = int(np.floor(fx * skin[i, 0] / skin[i, 2] + cx + 0.5))
        r = int(np.floor(fy * skin[i, 1] / skin[i, 2] + cy + 0.5))
        if u < 0 or r < 0 or u >= w or r >= h or labels[r, u] >= kinds:
            continue
        if z[r, u] > 0.0 and abs(z[r, u] - skin[i, 2]) < NEAR_M:
            out[part[i], labels[r, u]] += 1
    return out

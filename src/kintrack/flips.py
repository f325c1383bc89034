# SPDX-License-Identifier: Apache-2.0
"""Left taken for right, back for front: found while tracking, and undone.

Where posed skin lies on labelled pixels, model labels and pixel labels are counted against each
other. A limb on pixels of the other side's limb speaks for a swap, one on its own for none. A frame
is no proof, networks err for many; so the shares are summed over time with a memory of about a
second, arms and legs apart, and a sum far below zero asks for a new start. So does the age of a
track: the first frame may have shown too little, and a body that began in profile as if it faced
the camera never turns by itself. The new pose is taken only if it agrees better with points and
labels than the one there was, and no worse with the points alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray

from kintrack.alignment import View, view_skin
from kintrack.association.observation import Observation
from kintrack.body import BodyState
from kintrack.config import TrackerConfig
from kintrack.geometry import invert_rigid
from kintrack.human import Human
from kintrack.joints import JOINT_NAMES
from kintrack.judge import label_counts
from kintrack.labelled_config import FlipConfig, LabelledConfig
from kintrack.people import choose, find_people, only
from kintrack.start import Start, start_at
from kintrack.start.evidence import evidence_of
from kintrack.start.placing import view_mismatch

CHEST = JOINT_NAMES.index("chest")
LEAST_PARTS = 3
"""Labels of fewer parts tell no side from the other."""
SURER = 3.0
"""A label's side is believed so much more than at a first start."""
PAIRS = {"arms": (3, 4), "legs": (5, 6)}
"""Labels of right and left limbs."""


@dataclass(frozen=True)
class FlipWatch:
    """Evidence so far: above zero for the sides as they are, below for a swap."""

    arms: float = 0.0
    """Of the arms."""
    legs: float = 0.0
    """Of the legs."""
    wait: int = 0
    """Frames to pass before another try."""
    age: int = 0
    """Frames since the start."""

    def suspects(self, config: FlipConfig) -> bool:
        """True if a new start is to be tried now."""
        swapped = self.wait == 0 and min(self.arms, self.legs) < config.swapped
        return swapped or self.age in config.ages


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
        age=watch.age + 1,
    )


def questioned(
    watch: FlipWatch,
    human: Human,
    state: BodyState,
    view: View,
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    labelled: LabelledConfig,
) -> tuple[FlipWatch, Start | None]:
    """The evidence after another tracked frame, and a new start if the pose proves to be flipped.

    Args:
        watch: The evidence before.
        human: Body and skin.
        state: The pose that was fitted.
        view: Its skin.
        observation: Labelled points, sides as the network gave them.
        T_world_camera: Camera pose.
        config: All weights.
        labelled: How to start, and when a swap is believed.
    """
    if observation.labels is None:
        return watch, None
    counts, flips = label_counts(view, observation), labelled.flips
    watch = watched(watch, counts, flips)
    parts_shown = int((counts[:, 1:].sum(axis=0) >= flips.enough).sum())
    if not watch.suspects(flips) or parts_shown < LEAST_PARTS:
        return watch, None
    chest = state.joint_positions_world[CHEST]
    found = unflipped(human, view, chest, observation, T_world_camera, config, labelled)
    return FlipWatch(wait=flips.again, age=watch.age), found


def unflipped(
    human: Human,
    view: View,
    chest_world: Float[ndarray, " 3"],
    observation: Observation,
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    labelled: LabelledConfig,
) -> Start | None:
    """A new start in place of a pose that may be flipped.

    Args:
        human: Body and skin.
        view: The skin in the doubtful pose.
        chest_world: Its chest [m].
        observation: Labelled points, perhaps of several people.
        T_world_camera: Camera pose.
        config: All weights.
        labelled: How to start; sides are believed more than at a first start.

    Returns:
        The start; None if it is no better than the pose there is, or somebody else's.
    """
    flips = labelled.flips
    sure = replace(labelled.start, side_m=SURER * labelled.start.side_m)
    body = choose(find_people(observation, T_world_camera, sure.people), chest_world)
    if body is None or np.linalg.norm(body.place_world - chest_world) > flips.aside_m:
        return None
    own = only(observation, body)
    found = start_at(human, own, T_world_camera, config, sure)
    if found is None:
        return None
    evidence = evidence_of(own, T_world_camera)
    new = view_skin(human, found.fit.state, invert_rigid(T_world_camera), own, config)
    for side_m, share in ((sure.side_m, flips.better), (0.0, flips.no_worse)):
        before = view_mismatch(view, evidence, side_m)
        if not view_mismatch(new, evidence, side_m) <= share * before:
            return None
    return found

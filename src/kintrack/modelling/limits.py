# SPDX-License-Identifier: Apache-2.0
"""How far a person's own flesh lets elbows, knees and hips bend.

Full flexion of these joints ends where the soft parts of both segments meet; heavier people bend
them less for that reason (Park et al., Ergonomics 53(1), 2010, 102-108: "mechanical
interposition"; Ergonomics 61(9), 2018, 1223-1231: elbow, hip and knee flexion). Two segments of
radii r1 and r2 that are bent by phi meet half way along the shorter one, of length l, where

    l sin((pi - phi) / 2) = k (r1 + r2).

The published range of the average adult gives k, so a person's own end of range phi' has
sin((pi - phi') / 2) = sin((pi - phi) / 2) rho' / rho with rho = (r1 + r2) / l.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.modelling.segments import SegmentBody

CONTACTS = {
    "elbow_flexion": ("upper_arm", "forearm", "hand"),
    "knee_flexion": ("thigh", "shank", "foot"),
    "hip_flexion": ("abdomen", "thigh", "shank"),
}
"""Hinge -> segment before it, the one that it moves, and the next; without side."""
LEAST_BEND = 0.6
"""No build takes away more of a published range than this leaves of it."""


def contact_ratios(
    bodies: Mapping[str, SegmentBody], origins: Mapping[str, Float[ndarray, " 3"]]
) -> dict[str, float]:
    """Rho of the module's equation for every hinge of `CONTACTS`, both sides alike.

    Args:
        bodies: Capsules per link.
        origins: Link origins in bind pose [m].
    """
    out = {}
    for hinge, (before, moved, after) in CONTACTS.items():
        ratios = []
        for side in ("l_", "r_"):
            first = before if before in bodies else side + before
            radii = bodies[first].capsule[2] + bodies[side + moved].capsule[2]
            lengths = [np.linalg.norm(origins[side + after] - origins[side + moved])]
            if first != before:
                lengths.append(np.linalg.norm(origins[side + moved] - origins[first]))
            ratios.append(radii / float(min(lengths)))
        out[hinge] = float(np.mean(ratios))
    return out


def flexion_limits(
    published_deg: Mapping[str, float], average: Mapping[str, float], person: Mapping[str, float]
) -> dict[str, float]:
    """A person's own end of range.

    Args:
        published_deg: Hinge -> end of the published range [deg].
        average: `contact_ratios` of the average adult.
        person: `contact_ratios` of the person.

    Returns:
        Hinge -> end of range [deg]; never more than the published one, which the joint itself
        ends, and never less than `LEAST_BEND` of it.
    """
    out = {}
    for hinge, end in published_deg.items():
        gap = math.sin(math.radians(180.0 - end) / 2.0) * person[hinge] / average[hinge]
        bent = 180.0 - 2.0 * math.degrees(math.asin(min(gap, 1.0)))
        out[hinge] = min(end, max(bent, LEAST_BEND * end))
    return out

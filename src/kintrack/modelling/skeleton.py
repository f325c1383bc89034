# SPDX-License-Identifier: Apache-2.0
"""The kinematic tree of the human as a table: segments, hinges, limits and where they come from.

Zero pose: standing, arms and legs hanging straight down, palms to the thighs, every segment frame
parallel to the body root (x forward, y left, z up). Positive angles mean the same on both sides
(flexion, abduction, internal rotation), so the axes of the right side are mirrored.

Sources of the limits, means over healthy adults:

* [BA79] Boone & Azen, J. Bone Joint Surg. 61-A, 1979: shoulder, elbow, forearm, wrist, hip, knee,
  ankle.
* [AAOS] American Academy of Orthopaedic Surgeons, Joint Motion, 1965: trunk and neck.
* [L09] Ludewig et al., J. Bone Joint Surg. 91-A, 2009: clavicle.
* [K12] Konor et al., Int. J. Sports Phys. Ther. 7(3), 2012: weight-bearing ankle dorsiflexion,
  which a squat needs and [BA79]'s unloaded figure forbids.

Half of all people exceed a mean, so every limit is widened by `LIMIT_MARGIN_DEG`, about one and a
half of the published standard deviations.

The shoulder's frame lies in the plane of the scapula, 35 degrees forward of the frontal plane
[L09]: its first hinge is scapular elevation, and the directions in which the three hinges lose a
degree of freedom point across the chest and behind the back instead of sideways or forward.
"""

from __future__ import annotations

from dataclasses import dataclass

LIMIT_MARGIN_DEG = 10.0
"""Added to both ends of each published range [deg]."""
SCAPULAR_PLANE_DEG = 35.0
"""Plane of the scapula forward of the frontal plane [deg], [L09]."""


@dataclass(frozen=True)
class Hinge:
    """One revolute joint about a principal axis of its own frame."""

    name: str
    """Motion, as in `l_knee_flexion` without the segment's side."""
    axis: tuple[int, int, int]
    """Axis for the left side or the midline; the right side mirrors it."""
    lower_deg: float
    """Published range, negative end [deg]."""
    upper_deg: float
    """Published range, positive end [deg]."""
    yaw_deg: float = 0.0
    """Rotation of this hinge's frame about z against the one before, left side [deg]."""


@dataclass(frozen=True)
class Segment:
    """A rigid part of the body and the hinges that join it to its parent, outermost last."""

    name: str
    """Link name without side."""
    parent: str
    """Parent's name without side; sided segments hang on a sided parent of the same name."""
    hinges: tuple[Hinge, ...]
    """Hinges from parent to this segment."""
    bones: tuple[str, ...]
    """Bones of the source body whose skinning weights this segment takes, without side."""
    label: str
    """Body part of `kintrack.geometry.LABELS`, without side for arms and legs."""
    sided: bool = False
    """True for a left and a right copy."""


SPINE = (
    Hinge("flexion", (0, 1, 0), -15, 50),
    Hinge("lateral", (1, 0, 0), -20, 20),
    Hinge("rotation", (0, 0, 1), -15, 15),
)
CHEST = (
    Hinge("flexion", (0, 1, 0), -15, 35),
    Hinge("lateral", (1, 0, 0), -20, 20),
    Hinge("rotation", (0, 0, 1), -30, 30),
)
NECK = (
    Hinge("flexion", (0, 1, 0), -25, 25),
    Hinge("lateral", (1, 0, 0), -25, 25),
    Hinge("rotation", (0, 0, 1), -25, 25),
)
HEAD = (
    Hinge("flexion", (0, 1, 0), -25, 25),
    Hinge("lateral", (1, 0, 0), -20, 20),
    Hinge("rotation", (0, 0, 1), -40, 40),
)
CLAVICLE = (
    Hinge("elevation", (1, 0, 0), -5, 30),
    Hinge("protraction", (0, 0, -1), -20, 20),
)
SHOULDER = (
    Hinge("elevation", (1, 0, 0), -30, 165, yaw_deg=-SCAPULAR_PLANE_DEG),
    Hinge("plane", (0, -1, 0), -75, 105),
    Hinge("rotation", (0, 0, -1), -104, 69, yaw_deg=SCAPULAR_PLANE_DEG),
)
ELBOW = (Hinge("flexion", (0, -1, 0), 0, 143),)
FOREARM = (Hinge("pronation", (0, 0, -1), -82, 76),)
WRIST = (
    Hinge("flexion", (-1, 0, 0), -75, 76),
    Hinge("deviation", (0, -1, 0), -36, 22),
)
HIP = (
    Hinge("flexion", (0, -1, 0), -10, 122),
    Hinge("abduction", (1, 0, 0), -27, 46),
    Hinge("rotation", (0, 0, -1), -47, 47),
)
KNEE = (Hinge("flexion", (0, 1, 0), 0, 143),)
ANKLE = (
    Hinge("dorsiflexion", (0, -1, 0), -56, 38),
    Hinge("inversion", (-1, 0, 0), -21, 37),
)

SEGMENTS = (
    Segment("pelvis", "", (), ("root", "pelvis", "spine05"), "torso"),
    Segment("abdomen", "pelvis", SPINE, ("spine04", "spine03"), "torso"),
    Segment("chest", "abdomen", CHEST, ("spine02", "spine01"), "torso"),
    Segment("neck", "chest", NECK, ("neck01", "neck02", "neck03"), "head"),
    Segment("head", "neck", HEAD, ("head", "eye"), "head"),
    Segment("clavicle", "chest", CLAVICLE, ("clavicle", "shoulder01"), "torso", sided=True),
    Segment("upper_arm", "clavicle", SHOULDER, ("upperarm01", "upperarm02"), "arm", sided=True),
    Segment("forearm", "upper_arm", ELBOW, ("lowerarm01",), "arm", sided=True),
    Segment("forearm_distal", "forearm", FOREARM, ("lowerarm02",), "arm", sided=True),
    Segment("hand", "forearm_distal", WRIST, ("wrist", "finger", "metacarpal"), "arm", sided=True),
    Segment("thigh", "pelvis", HIP, ("upperleg01", "upperleg02"), "leg", sided=True),
    Segment("shank", "thigh", KNEE, ("lowerleg01", "lowerleg02"), "leg", sided=True),
    Segment("foot", "shank", ANKLE, ("foot", "toe"), "leg", sided=True),
)
"""The tree, parents before children."""

JOINT_OF_SEGMENT = {
    "abdomen": "spine",
    "chest": "chest",
    "neck": "neck",
    "head": "head",
    "clavicle": "clavicle",
    "upper_arm": "shoulder",
    "forearm": "elbow",
    "forearm_distal": "forearm",
    "hand": "wrist",
    "thigh": "hip",
    "shank": "knee",
    "foot": "ankle",
}
"""Anatomical joint between a segment and its parent; prefixes the hinge names."""


@dataclass(frozen=True)
class Link:
    """A segment with its side resolved."""

    name: str
    """`l_thigh`, `pelvis`, .."""
    parent: str
    """Parent link's name, empty for the root."""
    side: int
    """+1 left, -1 right, 0 midline."""
    segment: Segment
    """The row of `SEGMENTS`."""
    label: int
    """Index into `kintrack.geometry.LABELS`."""


def links() -> tuple[Link, ...]:
    """All links, left and right copies resolved, parents before children."""
    labels = {"head": (1, 1, 1), "torso": (2, 2, 2), "arm": (0, 4, 3), "leg": (0, 6, 5)}
    sided = {segment.name for segment in SEGMENTS if segment.sided}
    out = []
    for segment in SEGMENTS:
        for side in (1, -1) if segment.sided else (0,):
            prefix = {1: "l_", -1: "r_", 0: ""}[side]
            parent_prefix = prefix if segment.parent in sided else ""
            out.append(
                Link(
                    name=prefix + segment.name,
                    parent=parent_prefix + segment.parent if segment.parent else "",
                    side=side,
                    segment=segment,
                    label=labels[segment.label][side],
                )
            )
    return tuple(out)

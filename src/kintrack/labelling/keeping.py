# SPDX-License-Identifier: Apache-2.0
"""The drop rule: which self-labelled frames are kept, and why the others are not.

A frame has up to two opinions, the tracker's way forwards and its way back. Each must pass by
itself; where both do, they must also agree. Joints are not compared but labels: two opinions on a
limb that nobody sees do no harm. A single opinion counts only in a run of good frames in which two
agreed. The ways are not wholly independent: the way back begins with the last good pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.labelling.measures import Coverage

REASONS = (
    "not tracking",
    "too few pixels",
    "residual",
    "unexplained",
    "unsupported",
    "hidden",
    "not whole",
    "jump",
    "limits",
    "swap",
    "opinions differ",
    "unconfirmed",
)
"""Every kind of reason, in the order in which they are given."""


@dataclass(frozen=True)
class KeepingConfig:
    """Thresholds of the drop rule."""

    min_person_px: int = 400
    """Least labelled pixels: a standing person at 10 m in a 320-pixel image has as many."""
    max_rms_m: float = 0.02
    """Largest residual [m]: twice what good fits to a Kinect v1 at 3 m have (9.7 mm)."""
    min_explained: float = 0.93
    """Least share of the foreground near the skin; a hand and forearm are about 0.04."""
    max_unexplained_m2: float = 0.015
    """Largest patch of foreground far from the skin [m^2]: a hand, 19 cm x 8.5 cm."""
    min_supported: float = 0.9
    """Least share of the visible skin with pixels at it; an arm is about 0.1."""
    max_unsupported_m2: float = 0.015
    """Largest patch of skin that the camera looks past [m^2]: a hand again."""
    max_hidden: float = 0.25
    """Largest share of the skin behind something nearer: a clean recording has little."""
    max_unread: float = 0.3
    """Largest share of the skin where the sensor failed: both dark trouser legs are about 0.4."""
    max_outside: float = 0.3
    """Largest share of the body outside the image; shins and feet are about 0.25."""
    max_speed_m_s: float = 10.0
    """Largest speed of a joint [m/s]; a heavyweight's fist reached 8.9 (Atha et al., British
    Medical Journal 291, 1985)."""
    max_turn_rad_s: float = 15.0
    """Largest turning speed of pelvis and chest [rad/s]; a pirouette has about two turns a second,
    12.6."""
    max_limits: int = 6
    """Most hinges stopped by their limits at once; good fits have up to 5, deep squats 6, a body
    pressed into what is no body 8 and more."""
    max_disputed: float = 0.08
    """Largest share of the person's pixels on which the two ways disagree; borders between parts
    make about 0.02."""
    min_part_agreement: float = 0.6
    """Least intersection over union, between the two ways, of any part in view."""
    part_share: float = 0.02
    """Share of the person's pixels from which a part counts as in view."""

    def __post_init__(self) -> None:
        shares = ("min_explained", "min_supported", "max_hidden", "max_unread", "max_outside",
                  "max_disputed", "min_part_agreement", "part_share")  # fmt: skip
        others = ("min_person_px", "max_rms_m", "max_unexplained_m2", "max_unsupported_m2",
                  "max_speed_m_s", "max_turn_rad_s", "max_limits")  # fmt: skip
        check_bounds(self, **dict.fromkeys(shares, (0, 1)), **dict.fromkeys(others, (0, 1e6)))


@dataclass(frozen=True)
class Reason:
    """Why a frame is not kept."""

    kind: str
    """One of `REASONS`."""
    text: str
    """The measured value and what is allowed."""


@dataclass(frozen=True)
class Opinion:
    """What one way through the recording says about a frame."""

    status: str
    """The tracker's status."""
    residual_rms_m: float
    """Residual of the fit [m]."""
    coverage: Coverage
    """How image and skin explain each other."""
    speed_m_s: float
    """Fastest joint, to or from the neighbouring frames [m/s]; 0 without neighbours."""
    turn_rad_s: float
    """Turning speed of the trunk, the same way [rad/s]."""
    limits: int
    """Hinges stopped by their limits."""
    outside: float = 0.0
    """Share of the body outside the image, 0 to 1."""

    @property
    def score(self) -> float:
        """Larger is better: coverage less what stays unexplained and unsupported."""
        c = self.coverage
        return c.explained + c.supported - self.residual_rms_m / 0.03


def objections(opinion: Opinion, config: KeepingConfig) -> tuple[Reason, ...]:
    """What speaks against one opinion by itself."""
    c, out = opinion.coverage, []

    def object_if(wrong: bool, kind: str, text: str) -> None:
        if wrong:
            out.append(Reason(kind, text))

    if opinion.status != "tracking":
        return (Reason("not tracking", f"status {opinion.status}"),)
    rms_mm, most_mm = 1e3 * opinion.residual_rms_m, 1e3 * config.max_rms_m
    object_if(
        c.person_px < config.min_person_px,
        "too few pixels",
        f"{c.person_px} px of the person, below {config.min_person_px}",
    )
    object_if(not rms_mm <= most_mm, "residual", f"{rms_mm:.0f} mm, above {most_mm:.0f} mm")
    object_if(
        c.explained < config.min_explained,
        "unexplained",
        f"{1 - c.explained:.0%} of the foreground, above {1 - config.min_explained:.0%}",
    )
    object_if(
        c.unexplained_m2 > config.max_unexplained_m2,
        "unexplained",
        f"a patch of {1e4 * c.unexplained_m2:.0f} cm2, above {1e4 * config.max_unexplained_m2:.0f}",
    )
    object_if(
        c.supported < config.min_supported,
        "unsupported",
        f"{1 - c.supported:.0%} of the skin, above {1 - config.min_supported:.0%}",
    )
    object_if(
        c.unsupported_m2 > config.max_unsupported_m2,
        "unsupported",
        f"a patch of {1e4 * c.unsupported_m2:.0f} cm2, above {1e4 * config.max_unsupported_m2:.0f}",
    )
    object_if(
        c.hidden > config.max_hidden,
        "hidden",
        f"{c.hidden:.0%} of the skin behind something, above {config.max_hidden:.0%}",
    )
    object_if(
        c.unread > config.max_unread,
        "not whole",
        f"no depth on {c.unread:.0%} of the skin, above {config.max_unread:.0%}",
    )
    object_if(
        opinion.outside > config.max_outside,
        "not whole",
        f"{opinion.outside:.0%} of the body outside the image, above {config.max_outside:.0%}",
    )
    object_if(
        opinion.speed_m_s > config.max_speed_m_s,
        "jump",
        f"a joint at {opinion.speed_m_s:.0f} m/s, above {config.max_speed_m_s:g}",
    )
    object_if(
        opinion.turn_rad_s > config.max_turn_rad_s,
        "jump",
        f"the trunk at {opinion.turn_rad_s:.0f} rad/s, above {config.max_turn_rad_s:g}",
    )
    object_if(
        opinion.limits > config.max_limits,
        "limits",
        f"{opinion.limits} joints at their limits, above {config.max_limits}",
    )
    return tuple(out)


def fastest(
    positions_m: Float[ndarray, "n j 3"], timestamps_s: Float[ndarray, " n"]
) -> Float[ndarray, " n"]:
    """Speed of each frame's fastest joint, to the frame before or after, whichever is more.

    Returns:
        Speeds [m/s], shape (N,); 0 where neither neighbour has a pose.
    """
    steps = np.linalg.norm(np.diff(positions_m, axis=0), axis=-1)
    steps = np.nan_to_num(steps).max(axis=1, initial=0.0)
    return _either_side(steps / np.maximum(np.diff(timestamps_s), 1e-3))


def turning(
    Rs_camera_torso: Float[ndarray, "n 3 3"], timestamps_s: Float[ndarray, " n"]
) -> Float[ndarray, " n"]:
    """Turning speed of the trunk, to the frame before or after, whichever is more [rad/s]."""
    a, b = Rs_camera_torso[:-1], Rs_camera_torso[1:]
    cosine = (np.einsum("nij,nij->n", a, b) - 1) / 2
    angle = np.nan_to_num(np.arccos(np.clip(cosine, -1, 1)))
    return _either_side(angle / np.maximum(np.diff(timestamps_s), 1e-3))


def unconfirmed(kept: Sequence[bool], opinions: Sequence[int]) -> list[bool]:
    """Frames with one opinion that no agreement of two stands behind.

    A good frame with one opinion, as before the track started, belongs to a run of good frames; it
    is confirmed if somewhere in the run two opinions agreed.

    Args:
        kept: Whether nothing else speaks against each frame.
        opinions: How many independent opinions each frame has.

    Returns:
        True for frames to drop.
    """
    out = [False] * len(kept)
    start = 0
    for end in range(len(kept) + 1):
        if end < len(kept) and kept[end]:
            continue
        if not any(n > 1 for n in opinions[start:end]):
            out[start:end] = [True] * (end - start)
        start = end + 1
    return out


def top_reasons(reasons: Sequence[Sequence[Reason]]) -> dict[str, int]:
    """Kind -> frames that have it, the commonest first."""
    counts = {kind: sum(any(r.kind == kind for r in one) for one in reasons) for kind in REASONS}
    return dict(sorted(((k, n) for k, n in counts.items() if n), key=lambda item: -item[1]))


def _either_side(steps: Float[ndarray, " m"]) -> Float[ndarray, " n"]:
    return np.maximum(np.append(0.0, steps), np.append(steps, 0.0))

# SPDX-License-Identifier: Apache-2.0
"""Initialising, tracking, lost: a small machine that looks only at numbers.

        a frame good enough to begin with              `patience` bad frames in a row
initialising ---------------------------> tracking ---------------------------------> lost
                                              ^                                        |
                                              +------ a frame good enough to begin ----+

To begin takes a better frame than to go on (hysteresis), and a track that has only just begun is
given up sooner. Nobody in view is a reason, not an error.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from kintrack.labelled_config import LifecycleConfig, Limits

NOBODY = "nobody in view"
HIDDEN = "hardly anything of the person is seen"
GONE = "the lost person is not in view"
LEAST_SEEN = 0.04
"""Less of the skin with points near it says nothing: a body that slid behind a wall fits well."""
UNFITTED = "the body does not fit what is seen of the person"


@dataclass(frozen=True)
class Reading:
    """What one frame says."""

    rms_m: float
    """Surface residual [m]; NaN if nothing could be fitted."""
    explained: float
    """Share of the person's points near the skin."""
    supported: float
    """Share of the skin that should be seen and has a point near it."""
    labels: float = 1.0
    """Share of skin seen on the person whose label is the pixel's; 1 without labels."""
    seen: float = 1.0
    """Share of all skin that faces the camera which has a point near it."""


@dataclass(frozen=True)
class Life:
    """Where the machine is."""

    status: str = "initialising"
    """`initialising`, `tracking` or `lost`."""
    reason: str | None = NOBODY
    """Why it is not tracking, or what is wrong with the last frame; None if nothing is."""
    good: int = 0
    """Good frames since tracking began."""
    bad: int = 0
    """Bad frames in a row."""
    wait: int = 0
    """Frames to pass before the next first pose is tried."""
    rejected: int = 0
    """First poses rejected since somebody is in view."""

    @property
    def tracks(self) -> bool:
        """True if there is a pose to go on from."""
        return self.status == "tracking"

    @property
    def may_begin(self) -> bool:
        """True if a first pose should be tried now."""
        return not self.tracks and self.wait == 0


def absent(life: Life, config: LifecycleConfig, reason: str = NOBODY) -> Life:
    """The next state after a frame in which there was nothing to fit.

    Args:
        life: The state before.
        config: When a track ends.
        reason: What was missing.
    """
    if life.tracks:
        return _worse(life, config, reason)
    return replace(life, reason=reason, wait=max(life.wait - 1, 0))


def unbegun(life: Life, config: LifecycleConfig, in_view: bool) -> Life:
    """The next state after a frame in which no first pose was tried.

    Args:
        life: The state before; of no track.
        config: When a track ends.
        in_view: Whether the person is in view; then the last objection still stands.
    """
    if in_view:
        return absent(life, config, life.reason or UNFITTED)
    missing = GONE if life.status == "lost" else NOBODY
    return replace(absent(life, config, missing), rejected=0)


def judged(life: Life, reading: Reading, config: LifecycleConfig) -> Life:
    """The next state after a frame with a fit, be it of a track or a first pose.

    Args:
        life: The state before.
        reading: What the frame says.
        config: Limits and patience.
    """
    wrong = objection(reading, config.stay if life.tracks else config.begin)
    if life.tracks:
        if wrong is not None:
            return _worse(life, config, wrong)
        return replace(life, reason=None, good=life.good + 1, bad=0)
    if wrong is not None:
        rejected = life.rejected + 1
        wait = config.retry_after(rejected)
        return replace(life, reason=wrong, wait=wait, rejected=rejected)
    return Life("tracking", None, good=1)


def objection(reading: Reading, limits: Limits) -> str | None:
    """What speaks against a frame in words; None if nothing does."""
    if not math.isfinite(reading.rms_m) or reading.seen < LEAST_SEEN:
        return HIDDEN
    if reading.rms_m > limits.max_rms_m:
        return f"residual {1e3 * reading.rms_m:.0f} mm; {1e3 * limits.max_rms_m:.0f} are allowed"
    for share, least, what in (
        (reading.explained, limits.min_explained, "of the person's points lie on the skin"),
        (reading.supported, limits.min_supported, "of the skin is seen where it should be"),
        (reading.labels, limits.min_labels, "of the skin lies on pixels of its own part"),
    ):
        if not share >= least:
            return f"{share:.0%} {what}; {least:.0%} are needed"
    return None


def _worse(life: Life, config: LifecycleConfig, reason: str) -> Life:
    """One more bad frame of a track."""
    bad = life.bad + 1
    if bad >= (config.young_patience if life.good < config.young else config.patience):
        return Life("lost", reason)
    return replace(life, reason=reason, bad=bad)

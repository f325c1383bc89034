# SPDX-License-Identifier: Apache-2.0
"""Whether a calibrated person can be believed."""

from __future__ import annotations

from typing import NamedTuple

from kintrack.calibration.measures import Length
from kintrack.calibration.person import Person


class Limits(NamedTuple):
    """What a believable calibration looks like."""

    height_m: tuple[float, float] = (1.4, 2.1)
    """Adults [m]; four standard deviations about the population's mean are 1.28 to 2.10."""
    least_frames: int = 3
    """Fewer cannot be checked against each other."""
    least_spread_m: float = 0.025
    """Frames that differ less on average are one frame [m]."""
    height_sigma_m: float = 0.05
    """Doubt about the height beyond which the template is no worse [m]."""
    limb_share: float = 0.09
    """Doubt about a limb, as a share of its length."""
    rms_m: float = 0.025
    """Distance of the surface beyond which it is not the person's [m]."""
    conflict: float = 3.0
    """Standard deviations by which a stated height may differ from what the frames say."""


LIMITS = Limits()
"""Somebody who is named: measured once, and known from then on."""
ROUGH = Limits(least_spread_m=0.0, height_sigma_m=0.10, limb_share=0.14)
"""Somebody who is only tracked: an estimate in doubt is nearer to her than the template, and the
floor below her feet holds it. Training people in wide clothes are known to 5 to 6.5 cm; somebody of
whom hardly more than the trunk is seen, to 10."""


def problems_of(
    person: Person, at_limit: bool, alone: Length | None, limits: Limits = LIMITS
) -> tuple[str, ...]:
    """Why an estimate should not be used.

    Args:
        person: The estimate.
        at_limit: Whether a coefficient ran into its bound.
        alone: Height that the frames say without a stated one; None if none was stated.
        limits: What is believable.

    Returns:
        Sentences with value and limit; none if the person can be believed.
    """
    found = []
    low, high = limits.height_m
    tall = person.height
    if len(person.frames) < limits.least_frames:
        found.append(
            f"{len(person.frames)} usable frames; at least {limits.least_frames} are needed"
        )
    elif (alike := too_alike(person.spread_m, limits)) is not None:
        found.append(alike)
    if not low <= tall.value_m <= high:
        found.append(f"a height of {tall.value_m:.2f} m; adults of {low} to {high} m are known")
    elif at_limit:
        found.append("a build at the edge of the known population")
    if tall.sigma_m > limits.height_sigma_m:
        found.append(
            f"the height is known to {100 * tall.sigma_m:.1f} cm; "
            f"{100 * limits.height_sigma_m:.0f} cm are needed"
        )
    for name, limb in person.limbs.items():
        if limb.sigma_m > limits.limb_share * limb.value_m:
            found.append(
                f"the {name.replace('_', ' ')} is known to {100 * limb.sigma_m / limb.value_m:.0f} "
                f"%; {100 * limits.limb_share:.0f} % are needed"
            )
    if not person.rms_m <= limits.rms_m:
        found.append(
            f"the surface is {1e3 * person.rms_m:.0f} mm off; "
            f"{1e3 * limits.rms_m:.0f} mm are allowed"
        )
    if alone is not None and person.stated_height_m is not None:
        off = abs(alone.value_m - person.stated_height_m)
        if off > limits.conflict * max(alone.sigma_m, 0.01):
            found.append(
                f"a stated height of {person.stated_height_m:.2f} m, where the frames say "
                f"{alone.value_m:.3f} ± {alone.sigma_m:.3f} m"
            )
    return tuple(found)


def too_alike(spread_m: float, limits: Limits) -> str | None:
    """Why frames that differ so much on average [m] are not enough; None if they are."""
    if spread_m >= limits.least_spread_m:
        return None
    return (
        f"the frames differ by {1e3 * spread_m:.0f} mm; "
        f"at least {1e3 * limits.least_spread_m:.0f} mm are needed: move arms and legs, turn"
    )

# SPDX-License-Identifier: Apache-2.0
"""A motion together with the things that take part in it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.motion import Motion
from synthesis.objects.thing import Thing


@dataclass(frozen=True)
class Prop:
    """A thing and where it is in each of the N frames."""

    thing: Thing
    """What."""
    Ts_world_thing: Float[ndarray, "n 4 4"]
    """Its pose in every frame."""
    held: bool
    """True for what the person carries, False for what stands (a seat)."""


@dataclass(frozen=True)
class Performance:
    """What a person does, and with what; world frame, floor at z = 0."""

    name: str
    """Which action."""
    motion: Motion
    """The person's motion."""
    props: tuple[Prop, ...] = ()
    """Things that take part."""

    def first(self, frames: int) -> Performance:
        """Its first frames."""
        motion = self.motion
        planted = {side: flags[:frames] for side, flags in motion.planted.items()}
        return replace(
            self,
            motion=Motion(motion.times_s[:frames], motion.q[:frames], planted),
            props=tuple(
                replace(prop, Ts_world_thing=prop.Ts_world_thing[:frames]) for prop in self.props
            ),
        )

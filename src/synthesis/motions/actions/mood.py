# SPDX-License-Identifier: Apache-2.0
"""What makes two people do the same thing differently: posture, stance, tempo, fidgets, glances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.arms import arm
from synthesis.motions.curves import keyed, minimum_jerk
from synthesis.motions.footwork import UNHURRIED, Gait, Stance, Step
from synthesis.motions.motion import RATE_HZ, Script, frame_times
from synthesis.motions.poses import Pose, keys, left, right

SLOUCH_DEG = {"spine_flexion": (3.0, 3.5), "chest_flexion": (3.0, 3.0), "neck_flexion": (2.0, 4.0)}
"""Mean and standard deviation of the trunk's bend over a whole performance [deg]."""
SKEW_DEG = {
    "spine_lateral": 1.5,
    "chest_lateral": 1.0,
    "spine_rotation": 2.0,
    "head_lateral": 2.5,
    "l_clavicle_protraction": 4.0,
    "r_clavicle_protraction": 4.0,
}
"""Standard deviation of how crooked somebody stands [deg]."""
WANDER_DEG = {
    "spine_flexion": 1.0,
    "chest_rotation": 1.6,
    "spine_lateral": 0.8,
    "neck_flexion": 1.2,
    "head_lateral": 1.5,
    "l_shoulder_elevation": 1.2,
    "r_shoulder_elevation": 1.2,
    "l_shoulder_plane": 1.0,
    "r_shoulder_plane": 1.0,
    "l_elbow_flexion": 2.0,
    "r_elbow_flexion": 2.0,
}
"""Root mean square of slow unrest [deg]."""


@dataclass(frozen=True)
class Mood:
    """How somebody holds themselves throughout a performance."""

    duration_s: float
    """How long it lasts [s]."""
    tempo: float
    """Speed of movements, 1 = usual."""
    stance: Stance
    """Where the feet stand at first."""
    hang: Pose
    """Both arms at rest."""
    curves: Mapping[str, Float[ndarray, " n"]]
    """Posture, unrest and glances in every frame [deg]."""
    breath_rad: float
    """Phase of the breath [rad]."""

    @property
    def times_s(self) -> Float[ndarray, " n"]:
        """Time of each frame [s]."""
        return frame_times(self.duration_s)

    def script(
        self,
        *poses: tuple[float, Pose],
        start: Pose | None = None,
        steps: tuple[Step, ...] = (),
        gait: Gait = UNHURRIED,
        curves: Mapping[str, Float[ndarray, " n"]] | None = None,
        instead: Mapping[str, Float[ndarray, " n"]] | None = None,
    ) -> Script:
        """A script in this mood.

        Args:
            poses: (time [s], pose), as for `keys`, times increasing.
            start: What differs from hanging arms at time 0.
            steps: Steps.
            gait: How they are made.
            curves: Added on top, a value a frame.
            instead: Channels that follow these values and no key.
        """
        keyed_channels = keys(*poses, start={**self.hang, **(start or {})})
        instead = instead or {}
        kept = {name: curve for name, curve in keyed_channels.items() if name not in instead}
        total = dict(self.curves)
        for extra in (curves or {}, instead):
            for name, values in extra.items():
                total[name] = total.get(name, 0.0) + values
        return Script(
            self.duration_s, kept, steps, self.stance, gait, total, breath_rad=self.breath_rad
        )

    def standing(self, **changes) -> Mood:
        """The mood with another stance: fields of `Stance`."""
        return replace(self, stance=replace(self.stance, **changes))


def draw_mood(
    rng: np.random.Generator, duration_s: float, glances: float = 1.0, slouch: float = 1.0
) -> Mood:
    """Draw how somebody is today.

    Args:
        rng: Draws.
        duration_s: How long the performance lasts [s].
        glances: How much they look about; 0 = not at all.
        slouch: How much they vary in posture.

    Returns:
        The mood.
    """
    times_s = frame_times(duration_s)
    curves: dict[str, Any] = {
        name: np.full(len(times_s), slouch * rng.normal(mean, sd))
        for name, (mean, sd) in SLOUCH_DEG.items()
    }
    for name, sd in SKEW_DEG.items():
        curves[name] = curves.get(name, 0.0) + slouch * rng.normal(0.0, sd)
    for name, rms in WANDER_DEG.items():
        curves[name] = curves.get(name, 0.0) + rms * wander(times_s, rng)
    looks = look_about(times_s, rng, glances)
    for name, values in looks.items():
        curves[name] = curves.get(name, 0.0) + values
    stance = Stance(
        narrower_m=float(rng.uniform(-0.07, 0.04)),
        toe_out_deg=(float(rng.uniform(2.0, 20.0)), float(rng.uniform(2.0, 20.0))),
        left_ahead_m=float(rng.normal(0.0, 0.05)),
    )
    return Mood(
        duration_s,
        float(np.exp(rng.normal(0.0, 0.16))),
        stance,
        {**left(draw_hang(rng)), **right(draw_hang(rng))},
        {name: np.broadcast_to(values, times_s.shape) for name, values in curves.items()},
        float(rng.uniform(0.0, 2.0 * np.pi)),
    )


def draw_hang(rng: np.random.Generator) -> Pose:
    """One arm at rest."""
    return arm(
        upper=(rng.normal(0.02, 0.06), rng.uniform(0.15, 0.28), -1.0),
        forearm=(rng.uniform(0.10, 0.42), rng.uniform(0.02, 0.14), -1.0),
        pronation_deg=rng.uniform(-15.0, 40.0),
    )


def wander(
    times_s: Float[ndarray, " n"], rng: np.random.Generator, period_s: float = 4.0, waves: int = 4
) -> Float[ndarray, " n"]:
    """Slow unrest of unit root mean square: sines about a period, shape (N,)."""
    periods = period_s * np.exp(rng.uniform(-0.7, 0.7, waves))
    phases = rng.uniform(0.0, 2.0 * np.pi, waves)
    sines = np.sin(2.0 * np.pi * times_s[:, None] / periods + phases)
    return sines.sum(axis=1) * np.sqrt(2.0 / waves)


def look_about(
    times_s: Float[ndarray, " n"], rng: np.random.Generator, share: float
) -> dict[str, Float[ndarray, " n"]]:
    """Glances: the head turns to a place, stays, and turns to the next; values in degrees."""
    t, yaw, nod = 0.0, [], []
    here = (rng.normal(0.0, 8.0), rng.normal(3.0, 5.0))
    while t < times_s[-1] + 1.0 / RATE_HZ:
        hold_s = rng.uniform(0.5, 2.6)
        yaw += [(t, here[0]), (t + hold_s, here[0])]
        nod += [(t, here[1]), (t + hold_s, here[1])]
        there = (rng.normal(0.0, 22.0), rng.normal(3.0, 7.0))
        t += hold_s + 0.30 + 0.008 * abs(there[0] - here[0])
        here = there
    turn, bow = (share * keyed(curve, times_s, RATE_HZ) for curve in (yaw, nod))
    turn, bow = np.clip(turn, -50.0, 50.0), np.clip(bow, -20.0, 25.0)
    return {
        "neck_rotation": 0.35 * turn,
        "head_rotation": 0.65 * turn,
        "neck_flexion": 0.4 * bow,
        "head_flexion": 0.6 * bow,
    }


def spans(
    rng: np.random.Generator,
    duration_s: float,
    length_s: tuple[float, float],
    pause_s: tuple[float, float],
) -> list[tuple[float, float]]:
    """Stretches of a performance in which something happens.

    Args:
        rng: Draws.
        duration_s: How long the performance lasts [s].
        length_s: Shortest and longest stretch [s].
        pause_s: Shortest and longest pause before, between and after [s].

    Returns:
        (start, end) [s], in order; at least one, shortened if it must be.
    """
    out, t = [], float(rng.uniform(*pause_s)) * min(1.0, duration_s / (2.0 * sum(length_s)))
    while True:
        end = t + float(rng.uniform(*length_s))
        if end > duration_s - 0.1:
            break
        out.append((t, end))
        t = end + float(rng.uniform(*pause_s))
    return out or [(min(t, 0.15 * duration_s), 0.95 * duration_s)]


def envelope(
    times_s: Float[ndarray, " n"], stretches: list[tuple[float, float]], ease_s: float
) -> Float[ndarray, " n"]:
    """0 outside the stretches, 1 inside, minimum jerk within their ends, shape (N,)."""
    out = np.zeros(len(times_s))
    for start, end in stretches:
        ease = min(ease_s, 0.45 * (end - start))
        out += minimum_jerk((times_s - start) / ease) * minimum_jerk((end - times_s) / ease)
    return out


def between(a: Pose, b: Pose, share: Float[ndarray, " n"]) -> dict[str, Float[ndarray, " n"]]:
    """Channels that go from pose a (share 0) to pose b (share 1), a value a frame."""
    return {name: a[name] + share * (b[name] - a[name]) for name in a}


def toss(rng: np.random.Generator, chance: float = 0.5) -> bool:
    """True with a chance."""
    return bool(rng.random() < chance)


def pick(rng: np.random.Generator, *choices: str) -> str:
    """One of the choices, all equally likely."""
    return choices[int(rng.integers(len(choices)))]

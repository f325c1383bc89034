# SPDX-License-Identifier: Apache-2.0
"""When feet stand on the floor, and paths of the feet that keep them there.

A foot stands while its ball is low and slow, with thresholds that differ for landing and leaving
(hysteresis). A standing foot keeps one foothold; between two of them its path is the retargeted
one plus a correction that fades from one foothold to the next (Kovar, Schreiner & Gleicher,
Footskate Cleanup for Motion Capture Editing, SCA 2002).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float
from numpy import ndarray
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from synthesis.motions.curves import minimum_jerk
from synthesis.motions.legs import foot_pose
from synthesis.motions.mocap import Clip
from synthesis.people.person import Person
from synthesis.people.population import SIDES

LAND_M, LEAVE_M = 0.055, 0.080
"""Height of the ball above the floor at which a contact may begin, and at which it ends [m]."""
LAND_M_S, LEAVE_M_S = 0.25, 0.50
"""Speed of the ball at which a contact may begin, and at which it ends [m/s]."""
CALM_M_S = 0.15
"""Ball and ankle of a foot that stands flat are slower than this [m/s]."""
SHORTEST_S = 0.13
"""Shorter contacts are dropped [s]."""
DRIFT_M, DRIFT_RAD = 0.04, np.radians(12.0)
"""A foot that has left its foothold by this much stands on a new one [m], [rad]."""
STEP_S = 0.20
"""How long a slow foot takes from one foothold to the next [s]."""
FADE_S = 0.33
"""How long a correction takes to fade [s]."""
FLAT_RAD = np.radians(7.0)
"""Pitch below which a standing foot is flat [rad]."""
FLOOR_M = 0.15
"""The floor is looked for within this height of z = 0 [m]."""


@dataclass(frozen=True)
class FootPath:
    """One foot over time."""

    Ts_world_foot: list[pin.SE3]
    """Its pose in each of the N frames."""
    contacts: tuple[tuple[int, int], ...]
    """First frame and the one past the last, for each stay on a foothold."""
    planted: Bool[ndarray, " n"]
    """True where it stands flat."""


def speed_m_s(path_m: Float[ndarray, "n 3"], rate_hz: float) -> Float[ndarray, " n"]:
    """Speed along a path, central differences [m/s], shape (N,)."""
    return np.linalg.norm(np.gradient(path_m, axis=0), axis=1) * rate_hz


def floor_height_m(clip: Clip) -> float:
    """Height of the floor [m]: the lower quartile of calm, low balls of feet; 0 without any."""
    low = []
    for side in SIDES:
        ball = clip.joint(f"{side}_foot")
        calm = speed_m_s(ball, clip.rate_hz()) < CALM_M_S
        low.append(ball[calm & (np.abs(ball[:, 2]) < FLOOR_M), 2])
    heights = np.concatenate(low)
    return float(np.percentile(heights, 25.0)) if len(heights) else 0.0


def standing(clip: Clip, side: str, floor_m: float) -> Bool[ndarray, " n"]:
    """True where a foot of the clip stands on the floor, at least `SHORTEST_S` long, shape (N,)."""
    ball = clip.joint(f"{side}_foot")
    height, speed = ball[:, 2] - floor_m, speed_m_s(ball, clip.rate_hz())
    may_begin = (height < LAND_M) & (speed < LAND_M_S)
    may_go_on = (height < LEAVE_M) & (speed < LEAVE_M_S)
    out = np.zeros(len(ball), dtype=bool)
    shortest = round(SHORTEST_S * clip.rate_hz())
    for first, last in runs(may_go_on):
        if may_begin[first:last].any() and last - first >= shortest:
            out[first:last] = True
    return out


def runs(flags: Bool[ndarray, " n"]) -> list[tuple[int, int]]:
    """(first, past the last) of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def foot_path(
    person: Person,
    side: str,
    raw: list[pin.SE3],
    stands: Bool[ndarray, " n"],
    rate_hz: float,
) -> FootPath:
    """Plant a foot where it stands and keep it above the floor z = 0 elsewhere.

    Args:
        person: Whose foot.
        side: `l` or `r`.
        raw: T_world_foot in each of the N frames, as retargeted.
        stands: True where the clip's foot stands, shape (N,).
        rate_hz: Frames per second [Hz].

    Returns:
        The foot's path.
    """
    toes = np.array([T.act(person.toe[side]) for T in raw])
    yaws = np.unwrap([np.arctan2(T.rotation[1, 0], T.rotation[0, 0]) for T in raw])
    pitches = np.array([-np.arcsin(np.clip(T.rotation[2, 0], -1.0, 1.0)) for T in raw])
    pitches = gaussian_filter1d(pitches, 1.0, mode="nearest")
    pitches = np.sign(pitches) * np.maximum(np.abs(pitches) - FLAT_RAD, 0.0)
    contacts = _footholds(toes, yaws, stands, rate_hz)
    out, planted = list(raw), np.zeros(len(raw), dtype=bool)
    for first, last in contacts:
        yaw = float(np.median(yaws[first:last]))
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, _ = person.toe[side]
        place = np.median(toes[first:last, :2], axis=0) - [c * x - s * y, s * x + c * y]
        for n in range(first, last):
            out[n] = foot_pose(person, side, np.array([*place, yaw]), float(pitches[n]), 0.0)
        planted[first:last] = pitches[first:last] == 0.0
    _fade(out, raw, contacts, round(FADE_S * rate_hz))
    _lift(person, side, out, contacts, rate_hz)
    return FootPath(out, contacts, planted)


def _footholds(
    toes: Float[ndarray, "n 3"],
    yaws: Float[ndarray, " n"],
    stands: Bool[ndarray, " n"],
    rate_hz: float,
) -> tuple[tuple[int, int], ...]:
    """Cut each stay where the foot has drifted off, with time for a step in between."""
    step, shortest = round(STEP_S * rate_hz), round(SHORTEST_S * rate_hz)
    out = []
    for first, last in runs(stands):
        start = first
        for n in range(first, last):
            if n < start:
                continue
            here, turn = np.median(toes[start : n + 1, :2], axis=0), np.median(yaws[start : n + 1])
            off = np.linalg.norm(toes[n, :2] - here)
            if off > DRIFT_M or abs(yaws[n] - turn) > DRIFT_RAD:
                out.append((start, max(start, n - step // 2)))
                start = min(n + step - step // 2, last)
        out.append((start, last))
    return tuple((a, b) for a, b in out if b - a >= shortest)


def _fade(
    out: list[pin.SE3], raw: list[pin.SE3], contacts: tuple[tuple[int, int], ...], fade: int
) -> None:
    """Add to the frames between contacts what the contacts changed, fading with distance."""
    n = len(raw)
    ends = [(0, 0), *contacts, (n, n)]
    for (_, before), (after, _) in zip(ends[:-1], ends[1:], strict=True):
        length = max(1, min(fade, after - before))
        for edge in (before - 1, after):
            if not 0 <= edge < n:
                continue
            shift = out[edge].translation - raw[edge].translation
            turn = pin.log3(out[edge].rotation @ raw[edge].rotation.T)
            for k in range(before, after):
                share = float(minimum_jerk(np.array(1.0 - abs(k - edge) / (length + 1.0))))
                if share > 0.0:
                    out[k] = pin.SE3(
                        pin.exp3(share * turn) @ out[k].rotation, out[k].translation + share * shift
                    )


def _lift(
    person: Person,
    side: str,
    out: list[pin.SE3],
    contacts: tuple[tuple[int, int], ...],
    rate_hz: float,
) -> None:
    """Raise the foot smoothly wherever a point of it would be below the floor."""
    points = person.foot_points[side]
    below = np.array([max(-(T.translation[2] + (points @ T.rotation[2]).min()), 0.0) for T in out])
    free = np.ones(len(out), dtype=bool)
    for first, last in contacts:
        free[first:last] = False
    sigma = 0.05 * rate_hz
    wide = maximum_filter1d(below, 2 * round(2.0 * sigma) + 1, mode="nearest")
    raised = np.maximum(gaussian_filter1d(wide, sigma, mode="nearest", truncate=2.0), below)
    for k in np.flatnonzero(free & (raised > 0.0)):
        near = min((max(a - k, k - b + 1) for a, b in contacts), default=len(out))
        share = min(1.0, near / 3.0)
        height = max(below[k], share * raised[k])
        out[k] = pin.SE3(out[k].rotation, out[k].translation + [0.0, 0.0, height])

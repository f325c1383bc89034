# SPDX-License-Identifier: Apache-2.0
"""The postures that legs take in motions that may be trained on, as a mixture of Gaussians.

Every authored action is performed by several people, every captured clip given to several, and each
of these motions counts the same, mirrored too, so that the mixture prefers no side. It is learnt of
the pelvis' stance and the legs: arms do more than these motions show.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import leg_length
from kintrack.bounds import check_bounds
from kintrack.errors import DatasetError, SceneError
from kintrack.files import write_atomically
from kintrack.geometry import UP_WORLD
from kintrack.human import leg_hinges, load_human
from kintrack.residuals.pose_prior import STANCE, hinge_names, stance_of
from synthesis.motions.actions import act, training_actions
from synthesis.motions.mocap import HELD_OUT, clips_in, excerpt, load_clip
from synthesis.motions.motion import RATE_HZ
from synthesis.motions.retarget import retarget
from synthesis.people.person import load_person
from synthesis.people.population import training_people

LENGTH_S = 8.0
"""Length of a performance, and at most of a clip [s]."""
STRIDE = 6
"""Every how many frames of a motion one is looked at."""
ITERATIONS = 200


@dataclass(frozen=True)
class HabitsConfig:
    """What `kintrack model prior` makes."""

    components: int = 24
    """Gaussians before they are mirrored, 1 to 100."""
    performances: int = 16
    """People that perform every action, and half as many that every clip is given to."""
    least_rad: float = 0.08
    """Least standard deviation of a component along any direction [rad]."""
    seed: int = 0
    """Draws people, performances and the first guess."""

    def __post_init__(self) -> None:
        check_bounds(
            self, components=(1, 100), performances=(1, 1000), least_rad=(1e-3, 1.0),
            seed=(0, 2**31),
        )  # fmt: skip


def learn_habits(
    path: Path,
    mocap: Path | None,
    config: HabitsConfig,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Write the pose prior of `kintrack.residuals.pose_prior`.

    Args:
        path: File (npz).
        mocap: Folder of motion capture clips; authored motions only if None.
        config: Sizes and seed.
        on_progress: Called with motions done and in all.

    Raises:
        DatasetError: if scikit-learn is not installed, or too few postures come together.
    """
    try:
        from sklearn.mixture import GaussianMixture
    except ImportError as error:
        raise DatasetError("scikit-learn is missing: pip install 'kintrack[model]'") from error
    body = load_human().body
    hinges = np.array(hinge_names(body))[leg_hinges(body)[6:]]
    names = (*STANCE, *hinges)
    motions = _motions(mocap, config, on_progress)
    if not motions:
        raise DatasetError("no motion could be performed; a pose prior needs some")
    rng, each = np.random.default_rng((config.seed, 1)), max(len(m) for m in motions.values())
    postures = np.vstack([m[rng.choice(len(m), each)] for m in motions.values()])
    both = np.vstack([postures, mirrored(postures, names)])
    if len(both) < 2 * config.components:
        raise DatasetError(f"{len(both)} postures for {config.components} components: at least "
                           f"{2 * config.components} are needed")  # fmt: skip
    found = GaussianMixture(
        config.components,
        reg_covar=config.least_rad**2,
        max_iter=ITERATIONS,
        random_state=config.seed,
    ).fit(both)
    flip = mirrored(np.eye(len(names)), names)
    turned = np.einsum("ia,kij,jb->kab", flip, found.covariances_, flip)
    arrays: dict[str, Any] = {
        "names": np.array(names),
        "weights": np.tile(found.weights_ / 2.0, 2),
        "means": np.concatenate([found.means_, mirrored(found.means_, names)]),
        "covariances": np.concatenate([found.covariances_, turned]).astype(np.float32),
    }
    write_atomically(path, lambda file: np.savez_compressed(file, **arrays))


def mirrored(postures: Float[ndarray, "n h"], names: tuple[str, ...]) -> Float[ndarray, "n h"]:
    """The postures in a mirror: legs change sides, the pelvis tilts to the other side.

    Args:
        postures: Stances and hinge angles.
        names: Of their columns.
    """
    out = np.empty_like(postures)
    for n, name in enumerate(names):
        side, _, stem = name.partition("_")
        if side in ("l", "r"):
            out[:, n] = postures[:, names.index(f"{'r' if side == 'l' else 'l'}_{stem}")]
        else:
            out[:, n] = (-1.0 if name == "tilt_left" else 1.0) * postures[:, n]
    return out


def _motions(
    mocap: Path | None, config: HabitsConfig, on_progress: Callable[[int, int], None]
) -> dict[str, Float[ndarray, "n h"]]:
    """Postures of every action and clip, all performances together."""
    clips = [] if mocap is None else [p for p in clips_in(mocap) if p.stem not in HELD_OUT]
    turns = [(name, None, n) for name in training_actions() for n in range(config.performances)]
    half = -(-config.performances // 2)
    jobs = turns + [(clip.stem, clip, n) for clip in clips for n in range(half)]
    found: dict[str, list[ndarray]] = {}
    for done, (name, clip, n) in enumerate(jobs):
        rng = np.random.default_rng((config.seed, 0, n, *name.encode()))
        try:
            found.setdefault(name, []).append(_performed(name, clip, rng)[::STRIDE])
        except SceneError:
            # somebody whose limbs are too short for it
            continue
        finally:
            on_progress(done + 1, len(jobs))
    return {name: np.concatenate(parts) for name, parts in found.items() if parts}


def _performed(name: str, clip: Path | None, rng: np.random.Generator) -> Float[ndarray, "n h"]:
    """Stances and leg hinges of one performance by somebody."""
    person = load_person(int(rng.choice(training_people())))
    if clip is None:
        q = act(name, person, rng, LENGTH_S).motion.q
    else:
        recorded = load_clip(clip)
        length = min(len(recorded.times_s), int(LENGTH_S * RATE_HZ))
        start = int(rng.integers(len(recorded.times_s) - length + 1))
        q = retarget(person, excerpt(recorded, start, length), bool(rng.random() < 0.5)).q
    body = person.body
    stances = stance_of(q, leg_length(body), UP_WORLD, 0.0)
    return np.hstack([stances, q[:, 1 + np.flatnonzero(leg_hinges(body))]])

# SPDX-License-Identifier: Apache-2.0
"""Full-scene recordings: did the tracker read them to the end, and where did it put the person?"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.result import TRACK_FILE, Track
from kintrack.sequence import open_sequence
from kintrack.sequence.reference import read_reference_pixels

SCENES = {"bonn_tablet": 0.0, "sofa": 25.0, "uva_turn": 0.0}
"""Recording -> how far its camera looks down [deg]."""

VISIBLE = 0.8
"""Reference joints of at most this visibility are not compared."""

NEAR = 0.2
"""A joint counts as found within this share of the torso's length in the image."""


@dataclass(frozen=True)
class SceneScore:
    """One full-scene recording."""

    name: str
    """Folder of the recording."""
    recorded: int
    """Frames its index lists."""
    read: int
    """Frames of the result."""
    statuses: dict[str, int]
    """Status -> frames."""
    error: str | None
    """Why the fit broke off; None if it ran to the end."""
    pck: float
    """Share of visible reference joints found, those in frames without a pose counted as missed."""
    pck_posed: float
    """The same over frames with a pose only."""
    joints: int
    """Visible reference joints."""


def score_scene(result: Path, recording: Path, error: str | None) -> SceneScore:
    """Score the result folder of a full-scene recording."""
    sequence = open_sequence(recording)
    track = Track.load(result / TRACK_FILE)
    names, pixels, visibility = read_reference_pixels(recording / "reference_mediapipe.csv")
    n = min(len(track), len(pixels))
    columns = [track.joint_names.index(name) for name in names]
    points = track.joint_positions_camera_m[:n, columns]
    known = np.isfinite(points).all(axis=-1) & (np.nan_to_num(points[..., 2]) > 0.05)
    safe = np.where(known[..., None], points, 1.0)
    estimate = np.where(known[..., None], sequence.camera.project(safe), np.nan)
    torso_px = torso_lengths_px(names, pixels[:n])
    compared = (visibility[:n] > VISIBLE) & np.isfinite(torso_px)[:, None]
    # NaN, a joint without an estimate, is not near
    near = np.linalg.norm(estimate - pixels[:n], axis=-1) <= NEAR * torso_px[:, None]
    posed = compared & known
    return SceneScore(
        name=recording.name,
        recorded=len(sequence),
        read=len(track),
        statuses=dict(Counter(str(status) for status in track.status)),
        error=error,
        pck=float(near[compared].mean()) if compared.any() else float("nan"),
        pck_posed=float(near[posed].mean()) if posed.any() else float("nan"),
        joints=int(compared.sum()),
    )


def torso_lengths_px(
    names: tuple[str, ...], pixels: Float[ndarray, "n j 2"]
) -> Float[ndarray, " n"]:
    """Distance from mid-shoulder to mid-hip in each frame [px], shape (N,)."""
    ends = [
        0.5 * (pixels[:, names.index(f"l_{limb}")] + pixels[:, names.index(f"r_{limb}")])
        for limb in ("shoulder", "hip")
    ]
    return np.linalg.norm(ends[0] - ends[1], axis=-1)

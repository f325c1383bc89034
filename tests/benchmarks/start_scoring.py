# SPDX-License-Identifier: Apache-2.0
"""What a cold start came to: where a tracker is in the last frame of a short recording."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from start_scenes import facts_of

from kintrack.geometry import transform_points
from kintrack.joints import JOINT_NAMES
from kintrack.segmenter import Segmenter
from kintrack.sequence import open_sequence
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import read_reference_joints
from kintrack.tracker import Tracker

BASIN_M = 0.20
"""Within this mean distance of the truth tracking takes over [Wan19, 6]."""
THIGH_DEG = 50.0
"""A thigh further than this from the vertical is a seated or squatting person's."""
TOWARDS_DEG, AWAY_DEG = 60.0, 120.0
"""Headings up to the first face the camera, from the second on they face away."""
J = {name: n for n, name in enumerate(JOINT_NAMES)}


@dataclass(frozen=True)
class Outcome:
    """One recording."""

    name: str
    """Folder of the recording."""
    action: str
    """What the person does."""
    heading_deg: float
    """Of the person in the last frame, 0 = towards the camera."""
    seated: bool
    """Whether the person sits or squats."""
    behind: bool
    """Whether something stands before the person."""
    truncated: bool
    """Whether the person leaves the image in part."""
    hidden: float
    """Share of joints hidden or outside the image."""
    began: int | None
    """First frame with status tracking."""
    reason: str | None
    """Why there is no pose in the last frame."""
    mean_m: float
    """Mean error of all joints in the last frame [m]; infinite without a pose."""
    seen_m: float
    """Mean error of the joints that are neither hidden nor outside [m]."""
    worst_seen_m: float
    """Largest of those [m]."""
    turned_deg: float
    """Heading found minus true heading [deg]; NaN without a pose."""
    slowest_ms: float
    """Longest frame [ms]."""

    @property
    def locked(self) -> bool:
        """Whether the joints in view are in the basin."""
        return self.seen_m <= BASIN_M


def outcome_of(folder: Path, segmenter: Segmenter) -> Outcome:
    """Track one recording from nothing to its end.

    Args:
        folder: See `start_scenes.make`.
        segmenter: Labels the frames.
    """
    sequence, facts = open_sequence(folder), facts_of(folder)
    T_world_camera = np.array(facts["T_world_camera"])
    names, joints = read_reference_joints(folder / "reference_joints.csv")
    truth = joints[-1, [names.index(name) for name in JOINT_NAMES]]
    _, hidden = read_occlusion(folder / OCCLUSION_FILE)
    tracker = Tracker(T_world_camera=T_world_camera, segmenter=segmenter)
    results = [tracker.step(frame) for frame in sequence]
    last, tracking = results[-1], [r.status == "tracking" for r in results]
    world = transform_points(T_world_camera, truth)
    seen = _inside(truth, sequence.camera) & ~hidden[-1]
    errors, turned = np.full(len(world), np.inf), np.nan
    if tracking[-1]:
        posed = last.joint_positions_camera_m
        errors = np.linalg.norm(posed - truth, axis=1)
        turned = _angle(_heading(transform_points(T_world_camera, posed)) - _heading(world))
    to_camera = T_world_camera[:2, 3] - world[J["pelvis"], :2]
    return Outcome(
        name=folder.name,
        action=facts["take"]["action"],
        heading_deg=_angle(_heading(world) - np.degrees(np.arctan2(to_camera[1], to_camera[0]))),
        seated=_seated(world),
        behind=facts["take"]["barrier"],
        truncated=facts["take"]["truncated"],
        hidden=float(1.0 - seen.mean()),
        began=tracking.index(True) if any(tracking) else None,
        reason=last.reason,
        mean_m=float(errors.mean()),
        seen_m=float(errors[seen].mean()) if seen.any() else float("nan"),
        worst_seen_m=float(errors[seen].max()) if seen.any() else float("nan"),
        turned_deg=turned,
        slowest_ms=max(r.milliseconds for r in results),
    )


GROUPS: dict[str, Callable[[Outcome], bool]] = {
    "all": lambda o: True,
    "towards the camera": lambda o: abs(o.heading_deg) < TOWARDS_DEG,
    "sideways": lambda o: TOWARDS_DEG <= abs(o.heading_deg) <= AWAY_DEG,
    "away": lambda o: abs(o.heading_deg) > AWAY_DEG,
    "standing": lambda o: not o.seated,
    "seated or squatting": lambda o: o.seated,
    "behind something": lambda o: o.behind,
    "partly outside": lambda o: o.truncated,
}
"""Who is counted together."""
HEADER = (
    "labels", "people", "starts", "locked [%]", "a pose [%]", "all joints [%]",
    "each joint in view [%]", "back to front [%]", "slowest frame, median [ms]",
)  # fmt: skip
"""Columns of `rows`."""


def rows(labels: str, outcomes: Sequence[Outcome]) -> list[list[str]]:
    """Table rows of one source of labels, one for each group that has a member.

    Args:
        labels: Where they came from.
        outcomes: Its recordings.
    """
    out = []
    for group, belongs in GROUPS.items():
        chosen = [o for o in outcomes if belongs(o)]
        if chosen:
            shares = (
                share(o.locked for o in chosen),
                share(np.isfinite(o.turned_deg) for o in chosen),
                share(o.mean_m <= BASIN_M for o in chosen),
                share(o.worst_seen_m <= BASIN_M for o in chosen),
                share(abs(o.turned_deg) > AWAY_DEG for o in chosen),
            )
            slowest = float(np.median([o.slowest_ms for o in chosen]))
            cells = [f"{100 * value:.1f}" for value in shares]
            out.append([labels, group, str(len(chosen)), *cells, f"{slowest:.0f}"])
    return out


def share(flags: Iterable[bool | np.bool_]) -> float:
    """Share of true flags, 0 to 1; NaN for none."""
    values = list(flags)
    return float(np.mean(values)) if values else float("nan")


def _heading(joints: Float[ndarray, "j 3"]) -> float:
    """Where hips and shoulders face, about z [deg]."""
    left = (
        joints[J["l_hip"]] - joints[J["r_hip"]] + joints[J["l_shoulder"]] - joints[J["r_shoulder"]]
    )
    return float(np.degrees(np.arctan2(-left[0], left[1])))


def _angle(degrees: float) -> float:
    return float((degrees + 180.0) % 360.0 - 180.0)


def _seated(joints: Float[ndarray, "j 3"]) -> bool:
    thighs = np.array([joints[J[f"{s}_knee"]] - joints[J[f"{s}_hip"]] for s in "lr"])
    down = -thighs[:, 2] / np.linalg.norm(thighs, axis=1)
    return bool(np.degrees(np.arccos(np.clip(down, -1, 1))).mean() > THIGH_DEG)


def _inside(points: Float[ndarray, "j 3"], camera) -> ndarray:
    safe = np.where(points[:, 2:] > 0.1, points, 1.0)
    u, v = camera.project(safe).T
    ahead = points[:, 2] > 0.1
    return ahead & (u >= 0) & (v >= 0) & (u < camera.width) & (v < camera.height)

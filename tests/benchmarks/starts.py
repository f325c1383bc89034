# SPDX-License-Identifier: Apache-2.0
"""Cold starts at any heading: how many lock within ten frames, and how near the truth.

The recordings of `start_scenes.py` are made where they are missing. A start is tried on each of the
ten frames until one is accepted; it is right if its joints are on average within 20 cm of the truth
in that frame [Wan19, 6]. Joints that something hides, or that lie outside the image, are counted
apart: nobody can see them. Results go to out/starts_*.json.
"""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from command import OUT, parser, run
from jaxtyping import Float
from numpy import ndarray
from start_scenes import facts_of, make
from threadpoolctl import threadpool_limits

from kintrack.alignment import view_skin
from kintrack.association.observation import observe
from kintrack.config import TrackerConfig
from kintrack.files import write_json
from kintrack.geometry import invert_rigid, transform_points
from kintrack.human import Human, load_human
from kintrack.joints import JOINT_NAMES
from kintrack.judge import label_agreement, label_counts
from kintrack.labelled_config import LifecycleConfig
from kintrack.lifecycle import Life, Reading, absent, judged
from kintrack.segmenter import Segmenter
from kintrack.sequence import open_sequence
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import read_reference_joints
from kintrack.start import start_from_labels
from segmentation.runtime import load_segmenter
from segmentation.tracking import ImageSegmenter, TrueSegmenter

BASIN_M = 0.20
"""Within this mean distance of the truth tracking takes over [Wan19]."""
THIGH_DEG = 50.0
"""A thigh further than this from the vertical is a seated or squatting person's."""
J = {name: n for n, name in enumerate(JOINT_NAMES)}


@dataclass(frozen=True)
class Outcome:
    """One recording."""

    name: str
    action: str
    heading_deg: float
    """Of the person in the first frame, 0 = towards the camera."""
    seated: bool
    behind: bool
    """Whether something stands before the person."""
    truncated: bool
    hidden: float
    """Share of joints hidden or outside the image."""
    frame: int | None
    """Frame of the first accepted start."""
    reason: str | None
    """Why there is none."""
    mean_m: float
    """Mean error of all joints in that frame [m]."""
    seen_m: float
    """Mean error of the joints that are neither hidden nor outside [m]."""
    worst_seen_m: float
    """Largest of those [m]."""
    turned_deg: float
    """Heading found minus true heading [deg]."""
    seconds: float
    """Processor time of the accepted start, or of the last one [s]."""

    @property
    def locked(self) -> bool:
        return self.seen_m <= BASIN_M


def main() -> int:
    """Make, run, print, write."""
    options = parser(__doc__)
    options.add_argument("--count", type=int, default=500)
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--held-out", action="store_true", help="people and motions held out")
    options.add_argument("--weights", type=Path, help="network; true labels if not given")
    options.add_argument("--only-made", action="store_true", help="skip what is not there yet")
    arguments = options.parse_args()
    network = arguments.weights and load_segmenter(arguments.weights)
    segmenter = ImageSegmenter(network) if network else TrueSegmenter()
    human, outcomes = load_human(), []
    part = OUT / "starts" / ("held_out" if arguments.held_out else "held_in")
    with threadpool_limits(1):
        for n in range(100 if arguments.quick else arguments.count):
            folder = part / f"s{arguments.seed}_{n:04d}"
            if not folder.is_dir():
                if arguments.only_made:
                    continue
                make(OUT / "starts", arguments.seed, n, arguments.held_out)
            if not outcomes:
                outcome_of(folder, segmenter, human)  # compiles
            outcomes.append(outcome_of(folder, segmenter, human))
            print(line(outcomes[-1]), flush=True)
    print(table(outcomes))
    name = f"starts_{part.name}_{arguments.weights.stem if arguments.weights else 'true'}.json"
    content = {"summary": summary(outcomes), "starts": [asdict(o) for o in outcomes]}
    write_json(OUT / name, content)
    return 0


def outcome_of(folder: Path, segmenter: Segmenter, human: Human) -> Outcome:
    """Start on one recording."""
    sequence, facts = open_sequence(folder), facts_of(folder)
    T = np.array(facts["T_world_camera"])
    names, joints = read_reference_joints(folder / "reference_joints.csv")
    truth = joints[:, [names.index(name) for name in JOINT_NAMES]]
    _, hidden = read_occlusion(folder / OCCLUSION_FILE)
    config, lives = TrackerConfig(), LifecycleConfig()
    life, found, seconds, n = Life(), None, 0.0, 0
    for frame in sequence:
        n, labels = frame.index, segmenter.segment(frame)
        observation = observe(frame, config.association.max_width_px, 0.5, labels)
        began = time.process_time()
        found = start_from_labels(human, observation, T, config) if life.may_begin else None
        if found is None:
            life = absent(life, lives, life.reason or "")
            continue
        seconds = time.process_time() - began
        view = view_skin(human, found.fit.state, invert_rigid(T), found.observation, config)
        agreed, own = found.agreed, label_agreement(label_counts(view, found.observation))
        reading = Reading(found.fit.surface.rms_m, agreed.explained, agreed.supported, own)
        life = judged(life, reading, lives)
        if life.tracks:
            break
    world = transform_points(T, truth[n])
    seen = _inside(truth[n], sequence.camera) & ~hidden[n]
    posed = found.fit.state.joint_positions_world if found is not None and life.tracks else None
    errors = np.full(len(world), np.inf) if posed is None else np.linalg.norm(posed - world, axis=1)
    turned = np.nan if posed is None else _angle(_heading(posed) - _heading(world))
    to_camera = T[:2, 3] - world[J["pelvis"], :2]
    return Outcome(
        name=folder.name,
        action=facts["take"]["action"],
        heading_deg=_angle(_heading(world) - np.degrees(np.arctan2(to_camera[1], to_camera[0]))),
        seated=_seated(world),
        behind=facts["take"]["barrier"],
        truncated=facts["take"]["truncated"],
        hidden=float(1.0 - seen.mean()),
        frame=n if life.tracks else None,
        reason=life.reason,
        mean_m=float(errors.mean()),
        seen_m=float(errors[seen].mean()) if seen.any() else float("nan"),
        worst_seen_m=float(errors[seen].max()) if seen.any() else float("nan"),
        turned_deg=turned,
        seconds=seconds,
    )


def summary(outcomes: list[Outcome]) -> dict[str, dict[str, float]]:
    """Shares by heading and posture."""
    groups = {
        "all": lambda o: True,
        "towards the camera": lambda o: abs(o.heading_deg) < 60,
        "sideways": lambda o: 60 <= abs(o.heading_deg) <= 120,
        "away": lambda o: abs(o.heading_deg) > 120,
        "standing": lambda o: not o.seated,
        "seated or squatting": lambda o: o.seated,
        "behind something": lambda o: o.behind,
        "partly outside": lambda o: o.truncated,
    }
    out = {}
    for name, belongs in groups.items():
        chosen = [o for o in outcomes if belongs(o)]
        if chosen:
            seconds = [o.seconds for o in chosen if o.seconds > 0] or [float("nan")]
            out[name] = {
                "starts": len(chosen),
                "accepted": _share(o.frame is not None for o in chosen),
                "locked": _share(o.locked for o in chosen),
                "all_joints": _share(o.mean_m <= BASIN_M for o in chosen),
                "every_seen_joint": _share(o.worst_seen_m <= BASIN_M for o in chosen),
                "flipped": _share(abs(o.turned_deg) > 120 for o in chosen),
                "median_ms": 1e3 * float(np.median(seconds)),
                "most_ms": 1e3 * float(np.max(seconds)),
            }
    return out


def table(outcomes: list[Outcome]) -> str:
    """The summary as lines."""
    lines = [
        f"{'':22}{'starts':>7}{'accepted':>10}{'locked':>9}{'all<20cm':>10}{'each<20cm':>11}"
        f"{'flipped':>9}{'ms':>6}{'max':>6}"
    ]
    for name, s in summary(outcomes).items():
        lines.append(
            f"{name:22}{s['starts']:7.0f}{s['accepted']:10.1%}{s['locked']:9.1%}"
            f"{s['all_joints']:10.1%}{s['every_seen_joint']:11.1%}{s['flipped']:9.1%}"
            f"{s['median_ms']:6.0f}{s['most_ms']:6.0f}"
        )
    return "\n".join(lines)


def line(o: Outcome) -> str:
    """One recording in a line."""
    return (
        f"{o.name} {o.action[:18]:18} heading {o.heading_deg:+5.0f} "
        f"{'seated' if o.seated else '':6} {'behind' if o.behind else '':6} "
        f"{'cut' if o.truncated else '':3} hidden {o.hidden:4.0%} frame {o.frame} "
        f"mean {100 * o.mean_m:5.1f} seen {100 * o.seen_m:5.1f} worst {100 * o.worst_seen_m:5.1f} "
        f"turned {o.turned_deg:+4.0f} {1e3 * o.seconds:4.0f} ms "
        f"{'' if o.locked else 'MISSED ' + (o.reason or '')}"
    )


def _share(flags) -> float:
    return float(np.mean(list(flags)))


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


if __name__ == "__main__":
    run(main)

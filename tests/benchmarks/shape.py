# SPDX-License-Identifier: Apache-2.0
"""How well a person's size is found: dressed synthetic people with known bodies, and real ones.

Films people one by one (Kinect v2, nobody and nothing else in view but what they use), tracks them
with the average adult's body and their true labels, calibrates, and compares. Real recordings have
no truth: heights of the same person from different recordings are compared with each other, and
the surface with that of the average adult.

    python -m tests.benchmarks.shape --people training --count 24 --output out/shape
    python -m tests.benchmarks.shape --people held-out --count 16 --output out/shape
    python -m tests.benchmarks.shape --real-folder ../shared/data/utd_mhad --output out/shape
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
import tyro
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.alignment import view_skin
from kintrack.association.observation import observe
from kintrack.bench.cases import pitch_of
from kintrack.body import run_kinematics
from kintrack.calibration.measures import LIMBS, height
from kintrack.calibration.person import Person, human_of
from kintrack.calibration.recording import calibrate_recording
from kintrack.config import TrackerConfig
from kintrack.export import draw_overlay
from kintrack.fit import posed_skin
from kintrack.geometry import camera_pose, invert_rigid
from kintrack.human import Human, load_human
from kintrack.joints import JOINT_NAMES
from kintrack.result import Track, write_json
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.reference import read_reference_joints
from kintrack.tracker import Tracker
from synthesis.dataset.recipes import (
    HELD_OUT_ACTIONS,
    held_out_clips,
    held_out_people,
    training_actions,
    training_people,
)
from synthesis.dataset.record import folder_of, is_recorded, record
from synthesis.people.population import load_population
from synthesis.takes import Take

FRAMES, STRIDE = 60, 3
"""Six seconds of every authored action, two of every clip."""
SURFACE_EVERY, SURFACE_CAP_M = 7, 0.10
"""Frames and distance of `surface_rms`."""
RIM_PX = 12
"""Shown around the person in pictures [px]."""
TOO_FAR_M = 0.10
"""A track that is further off on average was lost; calibration cannot mend that [m]."""


class TrueLabels:
    """The segmenter that is always right."""

    def segment(self, frame: Frame) -> ndarray:
        """The recording's own labels."""
        assert frame.labels is not None
        return frame.labels


@dataclass(frozen=True)
class Row:
    """One recording."""

    name: str
    """Folder."""
    person: int
    """Who."""
    height_m: float
    """True height [m]."""
    found: Person
    """What was estimated."""
    limb_errors: dict[str, float]
    """Estimated over true length, minus one."""
    tracked_m: float
    """Mean joint error of the track with the average adult [m]."""
    retracked_m: float
    """Mean joint error with the calibrated, dressed person [m]."""

    @property
    def height_error_m(self) -> float:
        """Estimated minus true height [m]."""
        return self.found.height.value_m - self.height_m


def takes(people: str, count: int, mocap: Path) -> list[Take]:
    """Who does what: each person once, actions in turn."""
    held_out = people == "held-out"
    unseen = [*HELD_OUT_ACTIONS, *held_out_clips(mocap, FRAMES)]
    actions = unseen if held_out else list(training_actions())
    rng = np.random.default_rng(78 if held_out else 77)
    who = rng.choice(held_out_people() if held_out else training_people(), count, replace=False)
    out = []
    for n, person in enumerate(who):
        action = actions[n % len(actions)]
        out.append(
            Take(
                name=f"{n:02d}_{action}",
                part=people,
                seed=(5, int(held_out), n),
                person=int(person),
                action=action,
                sensor="kinect_v2",
                frames=FRAMES,
                stride=1 if action.startswith("cmu") else STRIDE,
                room=False,
                facing=True,
                held_out_things=held_out,
            )
        )
    return out


def track_of(sequence: SequenceReader, human: Human, pitch_deg: float, labelled: bool) -> Track:
    """The recording tracked with one body that is not sized."""
    config = TrackerConfig()
    config = replace(config, start=replace(config.start, shape_coefficients=0))
    tracker = Tracker(
        config,
        human,
        T_world_camera=camera_pose(pitch_deg),
        segmenter=TrueLabels() if labelled else None,
    )
    return Track.from_frames(JOINT_NAMES, [tracker.step(frame) for frame in sequence])


def score(folder: Path, pictures: Path) -> Row | None:
    """Calibrate and draw one synthetic recording; None where nobody was tracked."""
    sequence, pitch_deg = open_sequence(folder), pitch_of(folder)
    average = load_human()
    track = track_of(sequence, average, pitch_deg, True)
    names, reference = read_reference_joints(folder / "reference_joints.csv")
    truth = reference[:, [list(names).index(name) for name in JOINT_NAMES]]
    if not (track.status == "tracking").any():
        return None
    person = calibrate_recording(
        sequence, track, average, camera_pose(pitch_deg), segmenter=TrueLabels()
    )
    again = track_of(sequence, human_of(person), pitch_deg, True)
    index = person.frames[len(person.frames) // 2]
    if again.status[index] == "tracking":
        bodies = [(average, track), (human_of(person), again)]
        draw(folder, bodies, index, pictures / f"{folder.name}.png")
    who = int(json.loads((folder / "take.json").read_text())["take"]["person"])
    population = load_population()
    _, points = population.body(who)
    errors = {}
    for limb, (first, last) in LIMBS.items():
        sides = [np.linalg.norm(points[f"{s}_{last}"] - points[f"{s}_{first}"]) for s in "lr"]
        errors[limb] = person.limbs[limb].value_m / float(np.mean(sides)) - 1.0
    return Row(
        folder.name,
        who,
        float(population.heights_m[who]),
        person,
        errors,
        _error(track, truth),
        _error(again, truth),
    )


def draw(folder: Path, bodies: Sequence[tuple[Human, Track]], index: int, path: Path) -> None:
    """One frame: the depth, then the skin of every body over it, cut to the person."""
    frame, T = open_sequence(folder).frame(index), camera_pose(pitch_of(folder))
    pictures = []
    for human, track in bodies:
        whole = draw_overlay(
            frame,
            posed_skin(human, track.q[index], T),
            human.skin.faces,
            human.skin.labels,
            track.joint_positions_camera_m[index],
            "tracking",
            "",
            None,
        )
        assert frame.labels is not None
        rows, columns = (np.flatnonzero((frame.labels > 0).any(axis=a)) for a in (1, 0))
        bar, width = len(whole) - frame.camera.height, frame.camera.width
        tall = slice(bar + max(rows[0] - RIM_PX, 0), bar + rows[-1] + RIM_PX)
        wide = [max(columns[0] - RIM_PX, 0), columns[-1] + RIM_PX]
        if not pictures:
            pictures.append(whole[tall, wide[0] : wide[1]])
        pictures.append(whole[tall, width + wide[0] : width + wide[1]])
    sheet = cv2.resize(np.hstack(pictures), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
    path.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(path), cv2.cvtColor(sheet, cv2.COLOR_RGB2BGR))


def _error(track: Track, truth: ndarray) -> float:
    good = track.status == "tracking"
    off = np.linalg.norm(track.joint_positions_camera_m[good] - truth[good], axis=2)
    return float(np.nanmean(off)) if good.any() else float("nan")


def summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Means over the recordings whose track was on the person, and over all."""
    out: dict[str, Any] = {}
    average_m = height(np.zeros(1))[0]
    for name, chosen in (
        ("all", list(rows)),
        ("well tracked", [row for row in rows if row.tracked_m < TOO_FAR_M]),
        (
            "well tracked and believed",
            [row for row in rows if row.tracked_m < TOO_FAR_M and not row.found.problems],
        ),
    ):
        if not chosen:
            continue
        off = np.array([row.height_error_m for row in chosen])
        sure = off / np.array([row.found.height.sigma_m for row in chosen])
        out[name] = {
            "recordings": len(chosen),
            "believed": sum(not row.found.problems for row in chosen),
            "template height error cm": 100
            * np.mean([abs(r.height_m - average_m) for r in chosen]),
            "height error cm": 100 * np.abs(off).mean(),
            "height error cm, median": 100 * np.median(np.abs(off)),
            "height bias cm": 100 * off.mean(),
            "height within 1.5 cm %": 100 * np.mean(np.abs(off) <= 0.015),
            "height error / sigma, RMS": float(np.sqrt(np.mean(sure**2))),
            "limb error %": {
                limb: 100 * np.mean([abs(row.limb_errors[limb]) for row in chosen])
                for limb in LIMBS
            },
            "limb bias %": {
                limb: 100 * np.mean([row.limb_errors[limb] for row in chosen]) for limb in LIMBS
            },
            "joint error cm, template": 100 * np.nanmean([row.tracked_m for row in chosen]),
            "joint error cm, calibrated": 100 * np.nanmean([row.retracked_m for row in chosen]),
            "joint error cm, template, median": 100 * np.nanmedian([r.tracked_m for r in chosen]),
            "joint error cm, calibrated, median": 100
            * np.nanmedian([r.retracked_m for r in chosen]),
        }
    return out


def real(folder: Path, actions: Sequence[str]) -> dict[str, Any]:
    """Heights of the same person from different recordings, and the surface's distance."""
    heights: dict[str, list[float]] = defaultdict(list)
    rows = []
    for path in sorted(folder.glob("a*_s*_t*")):
        action, subject, _ = path.name.split("_")
        if action not in actions:
            continue
        sequence, average = open_sequence(path), load_human()
        track = track_of(sequence, average, 0.0, False)
        if not (track.status == "tracking").any():
            rows.append({"name": path.name, "problems": ["nobody was tracked"]})
            continue
        person = calibrate_recording(sequence, track, average)
        again = track_of(sequence, human_of(person), 0.0, False)
        heights[subject].append(person.height.value_m)
        rows.append(
            {
                "name": path.name,
                "height_m": person.height,
                "problems": person.problems,
                "surface_rms_mm": [
                    1e3 * surface_rms(sequence, *pair)
                    for pair in ((average, track), (human_of(person), again))
                ],
                "inlier_rms_mm": [
                    1e3 * float(np.nanmedian(t.residual_rms_m)) for t in (track, again)
                ],
                "agreement_cm": [100 * _agreement(t, path) for t in (track, again)],
                "tracking": [int((t.status == "tracking").sum()) for t in (track, again)],
            }
        )
        print(rows[-1], flush=True)
    spans = {s: 100 * float(np.ptp(h)) for s, h in heights.items()}
    deviations = {s: 100 * float(np.std(h)) for s, h in heights.items()}
    return {"recordings": rows, "span cm": spans, "standard deviation cm": deviations}


def surface_rms(sequence: SequenceReader, human: Human, track: Track) -> float:
    """Root mean square distance of everything observed from the seen skin, capped [m].

    Every pixel counts, along the normal of its nearest visible vertex.
    """
    T, config, squares = camera_pose(0.0), TrackerConfig(), []
    for index in np.flatnonzero(track.status == "tracking")[::SURFACE_EVERY]:
        frame = sequence.frame(int(index))
        observation = observe(frame, config.association.max_width_px)
        state = run_kinematics(human.body, track.q[index])
        view = view_skin(human, state, invert_rigid(T), observation, config)
        seen, points = np.flatnonzero(view.visible), observation.points_camera[observation.region]
        nearest = seen[cKDTree(view.vertices_camera[seen]).query(points)[1]]
        away = points - view.vertices_camera[nearest]
        along = np.einsum("ij,ij->i", away, view.normals_camera[nearest])
        squares.append(np.minimum(along**2, SURFACE_CAP_M**2))
    return float(np.sqrt(np.concatenate(squares).mean()))


def _agreement(track: Track, folder: Path) -> float:
    names, reference = read_reference_joints(folder / "reference_joints.csv")
    shared = [name for name in JOINT_NAMES if name in names]
    ours = track.joint_positions_camera_m[:, [JOINT_NAMES.index(name) for name in shared]]
    theirs = reference[: len(ours), [list(names).index(name) for name in shared]]
    good = track.status == "tracking"
    return float(np.nanmean(np.linalg.norm(ours - theirs, axis=2)[good]))


def main(
    output: Path = Path("out/shape"),
    people: Literal["training", "held-out"] = "training",
    count: int = 24,
    mocap: Path = Path("../shared/data/mocap"),
    real_folder: Path | None = None,
    actions: tuple[str, ...] = ("a03", "a22"),
) -> None:
    """Film, track, calibrate, compare; writes one JSON.

    Args:
        output: Where recordings and results go.
        people: Whom to film; held-out people are only for the last check.
        count: How many.
        mocap: Folder of motion capture clips.
        real_folder: Folder of real recordings named aAA_sS_tT; measured instead of synthetic ones.
        actions: Which of the real ones.
    """
    if real_folder is not None:
        found = real(real_folder, actions)
        write_json(output / "real.json", found)
        print(json.dumps({k: v for k, v in found.items() if k != "recordings"}, indent=2))
        return
    rows = []
    for take in takes(people, count, mocap):
        if not is_recorded(output, take):
            record(take, output, mocap)
        row = score(folder_of(output, take), output / "pictures" / people)
        if row is None:
            print(f"{take.name}: nobody was tracked", flush=True)
            continue
        rows.append(row)
        print(
            f"{row.name:28s} height {row.height_m:.3f} {100 * row.height_error_m:+5.1f} cm "
            f"(± {100 * row.found.height.sigma_m:.1f})  limbs "
            + " ".join(f"{100 * e:+5.1f}" for e in row.limb_errors.values())
            + f" %  joints {100 * row.tracked_m:.2f} -> {100 * row.retracked_m:.2f} cm  "
            + "; ".join(row.found.problems),
            flush=True,
        )
    found = summary(rows)
    write_json(output / f"{people}.json", {"summary": found, "rows": [asdict(r) for r in rows]})
    print(json.dumps(found, indent=2))


if __name__ == "__main__":
    tyro.cli(main)

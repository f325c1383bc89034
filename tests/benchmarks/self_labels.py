# SPDX-License-Identifier: Apache-2.0
"""How good self-labels are: against exact labels where there are some, kept shares elsewhere.

A frame is bad if its mean joint error exceeds 5 cm or a part in view is labelled to less than 60 %
(intersection over union). The drop rule is wrong twice: bad frames kept, good frames dropped.

    python -m tests.benchmarks.self_labels FOLDER... --strides 1 4 --output self_labels.json
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import report
import tyro
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

import kintrack
from kintrack.bench.cases import pitch_of
from kintrack.files import write_json
from kintrack.geometry import LABELS, camera_pose
from kintrack.joints import JOINT_NAMES
from kintrack.labelling.disputes import part_iou
from kintrack.labelling.foreground import find_foreground, only_person
from kintrack.labelling.keeping import top_reasons
from kintrack.labelling.opinions import LabelledFrame, Labeller, LabellingConfig
from kintrack.labelling.passes import track_both_ways
from kintrack.sequence import open_sequence
from kintrack.sequence.recording import Recording
from kintrack.sequence.reference import read_reference_joints

BAD_JOINTS_M = 0.05
"""A frame with a larger mean joint error is bad [m]."""
BAD_PART_IOU = 0.6
"""A frame with a part below this is bad."""
PART_SHARE = 0.02
"""Share of the person's pixels from which a part counts as in view."""
DEMO = Path(kintrack.__file__).parent / "demo"


@dataclass(frozen=True)
class Score:
    """One recording at one frame rate."""

    name: str
    """Folder of the recording, with its stride."""
    frames: int
    """Frames labelled or dropped."""
    kept: int
    """Frames kept."""
    reasons: dict[str, int]
    """Kind of reason -> dropped frames."""
    table: Int[ndarray, "k k"]
    """Pixels of the kept frames by true label (rows) and given label."""
    joint_error_m: float
    """Mean joint error of the kept frames [m]; NaN without truth."""
    bad: int
    """Bad frames; -1 without truth."""
    bad_kept: int
    """Bad frames that were kept."""
    good_dropped: int
    """Good frames that were dropped."""

    def iou(self) -> Float[ndarray, " k"]:
        """Intersection over union of each label over the kept frames; NaN without truth."""
        union = self.table.sum(axis=0) + self.table.sum(axis=1) - np.diag(self.table)
        return np.where(union > 0, np.diag(self.table) / np.maximum(union, 1), np.nan)

    def to_dict(self) -> dict:
        """For JSON."""
        return {
            "name": self.name,
            "frames": self.frames,
            "kept": self.kept,
            "reasons": self.reasons,
            "iou": dict(zip(LABELS, self.iou().tolist(), strict=True)),
            "joint_error_m": self.joint_error_m,
            "bad": self.bad,
            "bad_kept": self.bad_kept,
            "good_dropped": self.good_dropped,
        }


def score_recording(path: Path, stride: int, pitch_deg: float, config: LabellingConfig) -> Score:
    """Label a recording, every `stride`-th frame of it, and compare with its truth if it has any.

    Args:
        path: Sequence folder.
        stride: Frames skipped make motion faster, which breaks the tracker: a test of the drop
            rule.
        pitch_deg: How far the camera looks down [deg].
        config: Labelling.

    Returns:
        The score.
    """
    whole = open_sequence(path)
    assert isinstance(whole, Recording)
    thinned = replace(whole, files=whole.files[::stride])
    truth = _true_joints(path, stride)
    T_world_camera = camera_pose(pitch_deg)
    foreground = find_foreground(thinned, config.foreground)
    passes = track_both_ways(only_person(thinned, foreground), None, T_world_camera)
    table = np.zeros((len(LABELS), len(LABELS)), dtype=np.int64)
    seen, errors, bad = [], [], []
    labeller = Labeller(thinned, foreground, passes, T_world_camera, config)
    for labelled in labeller.frames(labeller.verdicts()):
        seen.append(labelled)
        error, wrong = _against_truth(labelled, truth)
        errors.append(error)
        bad.append(wrong)
        if labelled.kept and labelled.frame.labels is not None:
            table += _pairs(labelled)
    kept = np.array([labelled.kept for labelled in seen])
    known = truth is not None and seen[0].frame.labels is not None
    wrong = np.array(bad)
    return Score(
        name=path.name + (f" every {stride}" if stride > 1 else ""),
        frames=len(seen),
        kept=int(kept.sum()),
        reasons=top_reasons([labelled.verdict.reasons for labelled in seen]),
        table=table,
        joint_error_m=float(np.mean(np.array(errors)[kept])) if kept.any() else float("nan"),
        bad=int(wrong.sum()) if known else -1,
        bad_kept=int((wrong & kept).sum()) if known else -1,
        good_dropped=int((~wrong & ~kept).sum()) if known else -1,
    )


def _true_joints(path: Path, stride: int) -> ndarray | None:
    """Exact joints of a recording with exact labels, in the order of `JOINT_NAMES` [m]."""
    table = path / "reference_joints.csv"
    if not table.is_file() or not any((path / "labels").glob("*.png")):
        return None
    names, positions = read_reference_joints(table)[:2]
    if set(names) != set(JOINT_NAMES):
        return None
    return positions[::stride, [list(names).index(name) for name in JOINT_NAMES]]


def _against_truth(labelled: LabelledFrame, truth: ndarray | None) -> tuple[float, bool]:
    """Mean joint error of a frame [m] and whether it is bad."""
    frame, labels = labelled.frame, labelled.labels
    if truth is None or frame.labels is None:
        return float("nan"), False
    if labels is None or labelled.result is None or frame.index >= len(truth):
        return float("nan"), True
    joints = labelled.result.joint_positions_camera_m
    error = float(np.linalg.norm(joints - truth[frame.index], axis=1).mean())
    worst = np.nanmin(part_iou(_sized(labels, frame.labels), frame.labels, PART_SHARE), initial=1.0)
    return error, bool(error > BAD_JOINTS_M or worst < BAD_PART_IOU)


def _pairs(labelled: LabelledFrame) -> Int[ndarray, "k k"]:
    truth, labels = labelled.frame.labels, labelled.labels
    assert truth is not None and labels is not None
    k = len(LABELS)
    pair = k * truth.ravel().astype(int) + _sized(labels, truth).ravel()
    return np.bincount(pair, minlength=k * k).reshape(k, k)


def _sized(labels: UInt8[ndarray, "h w"], like: ndarray) -> UInt8[ndarray, "h2 w2"]:
    size = (like.shape[1], like.shape[0])
    return np.asarray(cv2.resize(labels, size, interpolation=cv2.INTER_NEAREST), dtype=np.uint8)


def print_table(scores: Sequence[Score]) -> None:
    """A line per recording."""
    parts = " ".join(f"{name:>10}" for name in LABELS)
    print(f"{'recording':24} {'kept':>9} {'bad':>5} {'kept bad':>8} {'lost good':>9} {parts}")
    for s in scores:
        iou = " ".join(f"{100 * value:10.1f}" for value in s.iou())
        counts = f"{s.kept:4}/{s.frames:4} {s.bad:5} {s.bad_kept:8} {s.good_dropped:9}"
        print(f"{s.name:24} {counts} {iou}  {s.reasons}", flush=True)


def main(
    folders: Annotated[tuple[Path, ...], tyro.conf.Positional] = (DEMO,),
    strides: tuple[int, ...] = (1,),
    camera_pitch_deg: float | None = None,
    output: Path | None = None,
    write: bool = False,
) -> None:
    """Score recordings.

    Args:
        folders: Sequence folders; the recording that ships if none is given.
        strides: Also label every n-th frame only.
        camera_pitch_deg: How far the cameras look down [deg]; for synthetic recordings what they
            say themselves if not given.
        output: JSON to write.
        write: Also rewrite the section in docs/results.md.
    """
    scores = []
    for folder in folders:
        pitch_deg = pitch_of(folder) if camera_pitch_deg is None else camera_pitch_deg
        for stride in strides:
            scores.append(score_recording(folder, stride, pitch_deg, LabellingConfig()))
            print_table(scores[-1:])
    if output is not None:
        write_json(output, {"recordings": [score.to_dict() for score in scores]})
    if write:
        report.rewrite_section(report.RESULTS, "self-labels", section(scores, len(folders)))


def section(scores: Sequence[Score], recordings: int) -> str:
    """Markdown of the section."""
    header = ("recording", "frames", "kept", "bad", "bad kept", "good dropped")
    rows = [_row(score) for score in scores]
    for every in dict.fromkeys(_every(score.name) for score in scores):
        chosen = [score for score in scores if _every(score.name) == every]
        rows.append(_row(pooled("all" + (f" every {every}" if every else ""), chosen)))
    facts = report.conditions(
        data=f"{recordings} recordings with exact labels", seeds="those of the recordings"
    )
    return f"""## Self-labels against exact labels

`kintrack label` on synthetic recordings of people whom the tracker's template does not resemble.
A frame is bad if its mean joint error exceeds {100 * BAD_JOINTS_M:.0f} cm or a part in view is
labelled to less than {100 * BAD_PART_IOU:.0f} % (intersection over union, IoU); the rule that drops
frames knows neither. IoU [%] is over the kept frames.

{report.table((*header, *(label.replace("_", " ") for label in LABELS)), rows)}

### Conditions

{report.bullets(facts)}
"""


def pooled(name: str, scores: Sequence[Score]) -> Score:
    """Several recordings as one."""
    reasons: dict[str, int] = {}
    for score in scores:
        for kind, count in score.reasons.items():
            reasons[kind] = reasons.get(kind, 0) + count
    kept = sum(score.kept for score in scores)
    error = sum(score.joint_error_m * score.kept for score in scores if score.kept)
    return Score(
        name=name,
        frames=sum(score.frames for score in scores),
        kept=kept,
        reasons=reasons,
        table=np.sum([score.table for score in scores], axis=0),
        joint_error_m=error / kept if kept else float("nan"),
        bad=sum(score.bad for score in scores),
        bad_kept=sum(score.bad_kept for score in scores),
        good_dropped=sum(score.good_dropped for score in scores),
    )


def _every(name: str) -> str:
    """The stride in a score's name; empty for every frame."""
    return name.partition(" every ")[2]


def _row(score: Score) -> list[str]:
    iou = ("-" if np.isnan(value) else f"{100 * value:.1f}" for value in score.iou())
    counts = (score.frames, score.kept, score.bad, score.bad_kept, score.good_dropped)
    return [score.name, *map(str, counts), *iou]


if __name__ == "__main__":
    tyro.cli(main)

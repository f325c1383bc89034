# SPDX-License-Identifier: Apache-2.0
"""What weights gain from somebody's own recordings, on people who are held out.

    python tests/benchmarks/from_recordings.py --write

`kintrack train --from-recordings` learns from three people of UTD-MHAD and is judged on two others.
A second witness is the Kinect's own skeleton: the share of its joints that lie on a pixel of their
own part, in all frames of the held-out recordings, those that the tracker dropped included.
"""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import report
import tyro
from command import DATA, OUT, run
from numpy import ndarray

from kintrack.commands.train import Train
from kintrack.errors import ResultError
from kintrack.files import write_json
from kintrack.geometry import LABELS
from kintrack.sequence import open_sequence
from kintrack.sequence.frame import Frame
from kintrack.sequence.reference import read_reference_joints
from segmentation.augment.bank import BankConfig
from segmentation.preprocess import letterbox
from segmentation.recordings import TuningConfig
from segmentation.runtime import load_segmenter
from segmentation.training_config import TrainConfig
from segmentation.tuning_report import JSON_FILE, PICTURE_FILE, SCORED
from segmentation.weights import SHIPPED

TRAIN, HELD_OUT = (1, 2, 3), (4, 5)
"""Numbers of the people."""
ACTIONS = (3, 13, 21, 23, 26)
"""Wave, boxing, pick up and throw, walk, lunge."""
PERSON = r"_(s\d)_"
BANK = BankConfig(cutouts=240, rooms=48)
WITNESSED = {"head": "head", "r_elbow": "right_arm", "r_wrist": "right_arm", "l_elbow": "left_arm",
             "l_wrist": "left_arm", "r_knee": "right_leg", "r_ankle": "right_leg",
             "l_knee": "left_leg", "l_ankle": "left_leg"}  # fmt: skip
"""Joints and the part each must lie on."""
REACH = 1
"""A joint counts if its part is at most so many cells away [px]."""
PICTURE = report.ROOT / "docs" / "from_recordings.png"


def recordings(data: Path, people: Sequence[int]) -> list[Path]:
    """Recordings of some people.

    Raises:
        ResultError: if one is missing.
    """
    names = [f"a{action:02d}_s{person}_t1" for action in ACTIONS for person in people]
    missing = [name for name in names if not (data / name / "depth.txt").is_file()]
    if missing:
        raise ResultError(f"{data} holds no {', '.join(missing)}; needed: UTD-MHAD as sequences")
    return [data / name for name in names]


def witnessed(weights: Path, sequences: Sequence[Path]) -> dict[str, float]:
    """Share of the Kinect's joints on their own part, by part and of all.

    Args:
        weights: Weights file.
        sequences: Recordings with `reference_joints.csv`.
    """
    label = load_segmenter(weights)
    hits: dict[str, list[bool]] = {part: [] for part in WITNESSED.values()}
    for path in sequences:
        names, positions_m = read_reference_joints(path / "reference_joints.csv")[:2]
        for frame in open_sequence(path):
            if frame.depth_m is None:
                continue
            labels = label.segment(frame)
            for name, (row, column) in cells(frame, list(names), positions_m[frame.index]):
                part = WITNESSED[name]
                near = labels[max(row - REACH, 0) : row + REACH + 1,
                              max(column - REACH, 0) : column + REACH + 1]  # fmt: skip
                hits[part].append(bool((near == LABELS.index(part)).any()))
    shares = {part: float(np.mean(found)) for part, found in hits.items() if found}
    return {"all": float(np.mean(np.concatenate(list(hits.values())))), **shares}


def cells(
    frame: Frame, names: Sequence[str], positions_m: ndarray
) -> Iterator[tuple[str, tuple[int, int]]]:
    """Row and column of each witnessed joint in the network's picture."""
    fit = letterbox(frame.camera.width, frame.camera.height)
    for name in WITNESSED:
        place = positions_m[list(names).index(name)] if name in names else np.full(3, np.nan)
        if not np.isfinite(place).all() or place[2] <= 0:
            continue
        u, v = frame.camera.project(place[None])[0]
        column, row = fit.left + int(u * fit.scale), fit.top + int(v * fit.scale)
        if 0 <= column < fit.left + fit.columns and 0 <= row < fit.top + fit.rows:
            yield name, (row, column)


def section(content: Mapping[str, Any], witness: Mapping[str, Any], minutes: float) -> str:
    """Markdown of the section."""
    header = ("IoU [%]", *(f"{one['condition']}, {side}" for one in content["scores"]
                           for side in ("before", "after")))  # fmt: skip
    rows = [
        [name.replace("_", " "), *(percent(one[side][key]) for one in content["scores"]
                                   for side in ("start", "tuned"))]
        for key, name in SCORED.items()
    ]  # fmt: skip
    used = {use: [one for one in content["recordings"] if one["use"] == use]
            for use in ("train", "judge", "nothing")}  # fmt: skip
    kept = [
        [title, str(len({one["person"] for one in used[use]})), str(len(used[use])),
         str(sum(one["frames"] for one in used[use])), str(sum(one["kept"] for one in used[use]))]
        for use, title in (("train", "trained with"), ("judge", "held out"), ("nothing", "unused"))
        if used[use]
    ]  # fmt: skip
    joints = [
        [part.replace("_", " "), percent(witness["before"][part]), percent(witness["after"][part])]
        for part in witness["before"]
    ]
    facts = report.conditions(
        data=f"UTD-MHAD, actions {', '.join(map(str, ACTIONS))}; people "
        f"{', '.join(map(str, TRAIN))} train, {', '.join(map(str, HELD_OUT))} are held out",
        seeds=f"0; {content['training']['steps']} steps of {content['training']['samples a step']} "
        f"samples in {content['training']['minutes']} minutes, all in all {minutes:.0f} minutes",
    )
    return f"""## Weights from recordings

`kintrack train --from-recordings` with real depth recordings whose background the publisher
removed: labels by the tracker, training begins with `{content["start"]}`. The weights do not ship.

{report.table(("part", "people", "recordings", "frames", "kept"), kept)}

Against the tracker's labels of the held-out people; the objects in front are none that were trained
with:

{report.table(header, rows)}

{content["verdict"]}

Share of the Kinect's own joints that lie within a cell of their part [%], in all frames of the
held-out recordings. Its skeletons are 2-10 cm off themselves:

{report.table(("part", "before", "after"), joints)}

![Kept frames, scores, and held-out pictures]({PICTURE.name})

### Conditions

{report.bullets(facts)}
"""


def percent(share: float | None) -> str:
    """For a table."""
    return "-" if share is None else f"{100 * share:.1f}"


def main(
    start: Path = SHIPPED,
    minutes: float = 12.0,
    data: Path = DATA / "utd_mhad",
    output: Path = OUT / "from_recordings",
    write: bool = False,
) -> int:
    """Adapt weights to people and judge them on others.

    Args:
        start: Weights to begin with.
        minutes: Length of training [min].
        data: Folder of UTD-MHAD as sequences.
        output: Folder of the run; one that was stopped goes on.
        write: Also rewrite the section in docs/results.md, and its picture.
    """
    began = time.monotonic()
    held_out = recordings(data, HELD_OUT)
    Train(
        (),
        output,
        from_recordings=tuple(recordings(data, TRAIN)),
        validation=tuple(held_out),
        start=start,
        tuning=TuningConfig(minutes=minutes, person=PERSON),
        config=TrainConfig(bank=BANK, batch=8),
    ).run()
    content = json.loads((output / JSON_FILE).read_text())
    witness = {
        "before": witnessed(start, held_out),
        "after": witnessed(output / content["weights"], held_out),
    }
    write_json(output / "witness.json", witness)
    text = section(content, witness, (time.monotonic() - began) / 60)
    print(text)
    if write:
        report.rewrite_section(report.RESULTS, "from-recordings", text)
        shutil.copy(output / PICTURE_FILE, PICTURE)
    return 0


if __name__ == "__main__":
    run(lambda: tyro.cli(main))

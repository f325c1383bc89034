# SPDX-License-Identifier: Apache-2.0
"""What became of somebody's recordings and what their weights gained: JSON, text and a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, UInt8
from numpy import ndarray

from kintrack.export import PART_COLORS, contact_sheet
from kintrack.export.overlay import depth_picture, depth_range
from kintrack.files import write_atomically, write_json
from segmentation.before_after import Shown
from segmentation.labels import LABELS, person_of
from segmentation.preprocess import DEPTH_SCALE, HOLE, REFERENCE_DEPTH_M

JSON_FILE, TEXT_FILE, PICTURE_FILE = "report.json", "report.md", "report.png"
NOTICEABLE = 0.01
"""A change of the IoU below this is none."""
MOST_BARS = 30
"""Recordings in the picture, at most."""

RECORDING_HEADER = ("recording", "person", "used to", "frames", "kept", "dropped for")
SCORED = {"non_background_iou": "all parts", "background_iou": "background",
          "person_iou": "person's outline", **{label: label for label in LABELS[1:]}}  # fmt: skip
"""Scores of the tables by what they are called there."""
TILE_PX = 180
"""Side of a picture's tile [px]."""


def write_report(folder: Path, content: Mapping[str, Any], shown: Sequence[Shown]) -> list[Path]:
    """Write `report.json`, `report.md` and `report.png`.

    Args:
        folder: Where.
        content: `recordings`, `division`, `scores`, `verdict`, `weights`, `start` and more; as
            `kintrack train --from-recordings` makes it.
        shown: Held-out pictures with the labels of both weights.

    Returns:
        The files.
    """
    paths = [folder / name for name in (JSON_FILE, TEXT_FILE, PICTURE_FILE)]
    write_json(paths[0], content)
    write_atomically(paths[1], lambda file: file.write(text_of(content).encode()))
    draw(content, shown, paths[2])
    return paths


def verdict_of(scores: Sequence[Mapping[str, Any]]) -> str:
    """Whether to use the new weights, in a sentence or two.

    Args:
        scores: An entry per condition with `condition`, `own`, and the summaries `start` and
            `tuned`.
    """
    own = [one for one in scores if one["own"]]
    better = [one for one in own if _gain(one) >= NOTICEABLE]
    worse = [one for one in own if _gain(one) <= -NOTICEABLE]
    lost = [one for one in scores if not one["own"] and _gain(one) <= -NOTICEABLE]
    if worse:
        words = "The new weights are worse on what was held out"
        words += f" ({_change(worse)}): go on with those you began with."
    elif better:
        words = f"The new weights are better on what was held out ({_change(better)})."
    else:
        words = "The new weights are about as good as those you began with on what was held out."
    if lost:
        words += f" They have forgotten some of the other recordings ({_change(lost)})."
    return words


def recording_rows(content: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Cells of the recordings' table, under `RECORDING_HEADER`; a sum at the end."""
    rows = []
    for one in content["recordings"]:
        why = ", ".join(f"{kind} ({count})" for kind, count in one["reasons"].items())
        rows.append((one["name"], one["person"] or "-", one["use"], str(one["frames"]),
                     str(one["kept"]), one["problem"] or why or "-"))  # fmt: skip
    total = [sum(one[key] for one in content["recordings"]) for key in ("frames", "kept")]
    return [*rows, ("all", "", "", str(total[0]), str(total[1]), "")]


def score_header(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Titles over `score_rows`."""
    titles = (f"{one['condition']} ({one['pictures']})" for one in content["scores"])
    return ("IoU [%], before > after", *titles)


def score_rows(content: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Cells of the scores' table: a row per score, a column per condition."""

    def cell(one: Mapping[str, Any], key: str) -> str:
        before, after = one["start"][key], one["tuned"][key]
        if None in (before, after):
            return f"{_percent(before)} > {_percent(after)}"
        return f"{_percent(before)} > {_percent(after)} ({_percent(after - before, '+')})"

    return [
        (name.replace("_", " "), *(cell(one, key) for one in content["scores"]))
        for key, name in SCORED.items()
    ]


ABOUT_DROPS = """A frame is dropped where the tracker's fit does not explain it. The reasons of
every frame stand in `labels.json` of its recording, below `labels/`."""
ABOUT_SCORES = """The truth is the tracker's own label map of the frames that it kept: the numbers
say how well a network repeats it, not how right it is. Objects in front are drawn anew; training
did not see them."""


def text_of(content: Mapping[str, Any]) -> str:
    """The report as Markdown."""
    division = content["division"]
    lines = ["# Weights from recordings", "", content["verdict"], ""]
    lines += [f"- {name}: {content[name]}" for name in ("weights", "start", "command", "version")]
    lines += [f"- {name}: {value}" for name, value in content["training"].items()]
    lines += ["", "## Recordings", "", *_markdown(RECORDING_HEADER, recording_rows(content))]
    lines += ["", ABOUT_DROPS, "", "## Scores", ""]
    lines += [f"Held out by {division['by']}.", "", ABOUT_SCORES, ""]
    lines += [f"Caution: {division['caution']}.", ""] if division["caution"] else []
    return "\n".join([*lines, *_markdown(score_header(content), score_rows(content)), ""])


def draw(content: Mapping[str, Any], shown: Sequence[Shown], path: Path) -> None:
    """Draw kept and dropped frames, part by part scores, and held-out pictures."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    sheet = _sheet(shown)
    tall = 11.0 * sheet.shape[0] / sheet.shape[1]
    figure = Figure(figsize=(11, 4.6 + tall), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(2, 2, height_ratios=(4.2, tall), width_ratios=(1, 1.5))
    _draw_kept(figure.add_subplot(grid[0, 0]), content["recordings"][:MOST_BARS])
    _draw_scores(figure.add_subplot(grid[0, 1]), content["scores"])
    below = figure.add_subplot(grid[1, :])
    below.imshow(sheet, interpolation="nearest")
    below.set(xticks=[], yticks=[(n + 0.5) * TILE_PX for n in range(0, -(-len(shown) // 2))])
    names = [one.condition.replace(" ", "\n", 1) for one in shown[::2]]
    below.set_yticklabels(names, fontsize=7)
    below.tick_params(length=0)
    below.set_title("held out: depth, the tracker's labels, labels before, labels after; twice",
                    fontsize=9)  # fmt: skip
    figure.savefig(path, dpi=110, metadata={"Software": None})


def _draw_kept(axes, recordings) -> None:
    names = [one["name"] for one in recordings]
    kept = np.array([one["kept"] for one in recordings])
    frames = np.array([one["frames"] for one in recordings])
    colors = {"train": "tab:blue", "judge": "tab:green"}
    axes.barh(names, frames, color="0.85", label="dropped")
    for use in ("train", "judge", "both"):
        chosen = [n for n, one in enumerate(recordings) if one["use"] == use]
        if chosen:
            axes.barh([names[n] for n in chosen], kept[chosen], color=colors.get(use, "tab:purple"),
                      label=f"kept, used to {use}")  # fmt: skip
    axes.invert_yaxis()
    axes.tick_params(axis="y", labelsize=6)
    axes.set_xlabel("frames", fontsize=8)
    axes.legend(fontsize=6, ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def _draw_scores(axes, scores) -> None:
    keys = ("non_background_iou", *LABELS[1:])
    wide = 0.8 / max(2 * len(scores), 1)
    for n, one in enumerate(scores):
        for k, side in enumerate(("start", "tuned")):
            values = [np.nan if one[side][key] is None else 100 * one[side][key] for key in keys]
            places = np.arange(len(keys)) + (2 * n + k) * wide - 0.4 + wide / 2
            axes.bar(places, values, 0.95 * wide, color=f"C{n}", alpha=0.4 if k == 0 else 1.0,
                     label=f"{one['condition']}, {'before' if k == 0 else 'after'}")  # fmt: skip
    names = ["all parts", *(label.replace("_", "\n") for label in LABELS[1:])]
    axes.set_xticks(range(len(keys)), names, fontsize=7)
    axes.set(ylabel="IoU [%]", ylim=(0, 118), yticks=range(0, 101, 20))
    axes.grid(axis="y", alpha=0.3)
    axes.legend(fontsize=6, ncols=min(len(scores), 4), loc="upper center")


def _sheet(shown: Sequence[Shown]) -> UInt8[ndarray, "h w 3"]:
    """The network's depth, truth, before and after around the person; two pictures a row."""
    tiles = []
    for one in shown:
        plane = one.sample.image[3]
        depth = np.where(plane >= HOLE, 0.0, REFERENCE_DEPTH_M * np.exp(DEPTH_SCALE * plane))
        picture = depth_picture(depth, depth_range(depth))
        box = _around(person_of(one.sample.labels))
        for labels in (None, one.sample.labels, one.start, one.tuned):
            whole = picture if labels is None else _painted(picture, labels)
            size = (TILE_PX - 4, TILE_PX - 4)  # the sheet parts tiles by 4 px
            tiles.append(np.asarray(cv2.resize(whole[box], size, interpolation=cv2.INTER_NEAREST)))
    return contact_sheet(tiles, 8)


def _around(mask: Bool[ndarray, "h w"]) -> tuple[slice, slice]:
    """A square around a mask with some margin, as far as the picture goes."""
    rows, columns = np.nonzero(mask) if mask.any() else np.nonzero(~mask)
    side = min(max(int(1.35 * max(np.ptp(rows), np.ptp(columns))), 24), *mask.shape)
    spans = []
    for places, size in ((rows, mask.shape[0]), (columns, mask.shape[1])):
        first = (int(places.min()) + int(places.max()) - side) // 2
        first = min(max(first, 0), size - side)
        spans.append(slice(first, first + side))
    return spans[0], spans[1]


def _painted(
    picture: UInt8[ndarray, "h w 3"], labels: UInt8[ndarray, "h w"]
) -> UInt8[ndarray, "h w 3"]:
    """Label colours over depth."""
    out = picture.astype(float)
    on = person_of(labels)
    out[on] += 0.75 * (PART_COLORS[labels[on]] - out[on])
    return out.astype(np.uint8)


def _markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [header, ["---"] * len(header), *rows]
    return ["| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in lines]


def _gain(one: Mapping[str, Any]) -> float:
    before, after = (one[side]["non_background_iou"] for side in ("start", "tuned"))
    return 0.0 if None in (before, after) else float(after - before)


def _change(scores: Sequence[Mapping[str, Any]]) -> str:
    def one_of(one: Mapping[str, Any]) -> str:
        before, after = (_percent(one[side]["non_background_iou"]) for side in ("start", "tuned"))
        return f"{one['condition']}: {before} to {after} %"

    return ", ".join(map(one_of, scores))


def _percent(share: float | None, sign: str = "") -> str:
    return "-" if share is None else f"{100 * share:{sign}.1f}"

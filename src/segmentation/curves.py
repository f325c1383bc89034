# SPDX-License-Identifier: Apache-2.0
"""The log of a training, a line per entry, and its picture."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from segmentation.labels import LABELS

LOG_FILE, CURVES_FILE = "log.jsonl", "curves.png"


def read_log(path: Path) -> list[dict[str, Any]]:
    """All whole lines of a log; a missing one is empty, a line that breaks off is left out."""
    entries = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
        try:
            entries.append(json.loads(line))
        except ValueError:
            continue
    return entries


def write_log(path: Path, entries: list[dict[str, Any]]) -> None:
    """Write a log anew."""
    path.write_text("".join(json.dumps(entry) + "\n" for entry in entries), encoding="utf-8")


def append_log(path: Path, entry: dict[str, Any]) -> None:
    """Add a line."""
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(entry) + "\n")


def draw_curves(entries: list[dict[str, Any]], path: Path) -> None:
    """Draw loss and learning rate, and the intersections over union of the validation.

    Args:
        entries: Lines of the log.
        path: Picture to write.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    left, right = figure.subplots(1, 2)
    losses = [e for e in entries if e.get("loss") is not None]
    left.plot([e["step"] for e in losses], [e["loss"] for e in losses], color="tab:blue")
    left.set(xlabel="step", ylabel="training loss", yscale="log" if losses else "linear")
    rate = left.twinx()
    rate.plot([e["step"] for e in losses], [e["rate"] for e in losses], color="0.7", lw=1)
    rate.set_ylabel("learning rate", color="0.5")
    scored = [e for e in entries if "validation" in e]
    for name in ("background_iou", "non_background_iou", *LABELS[1:]):
        thick = name.endswith("_iou")
        right.plot(
            [e["step"] for e in scored],
            [_percent(e["validation"].get(name)) for e in scored],
            label=name.removesuffix("_iou").replace("_", " "),
            lw=2.2 if thick else 1.1,
            ls="-" if thick else "--",
        )
    right.set(xlabel="step", ylabel="validation IoU [%]", ylim=(0, 100))
    right.grid(alpha=0.3)
    right.legend(fontsize=7, ncols=2, loc="lower right")
    figure.savefig(path, dpi=110, metadata={"Software": None})


def _percent(share: float | None) -> float:
    return float("nan") if share is None else 100.0 * share

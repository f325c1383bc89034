# SPDX-License-Identifier: Apache-2.0
"""Curves of the accuracy bench: share of joints within a threshold, and every joint by itself."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from kintrack.bench.cases import ALONE, CLEAN, GAPS, OBJECTS, REAL, ROOM, SCENE
from kintrack.bench.methods import (
    CALIBRATED,
    COLD,
    GEOMETRY,
    HARD,
    NO_TARGETS,
    RGB,
    TRUE_LABELS,
)
from kintrack.files import write_atomically
from kintrack.joints import JOINT_NAMES

CURVES_FILE, JOINTS_FILE, WAITS_FILE = "accuracy.png", "joints.png", "waits.png"
WAITS = ("locked_after", "recovered_after")
"""Frames to the first right pose from a cold start, and after a gap."""
SHOWN = (CLEAN, SCENE, *reversed(OBJECTS))
"""Conditions that have curves."""
TITLES = {
    ROOM: "synthetic, in rooms",
    ALONE: "synthetic, nothing around",
    REAL: "real people in a real room, against the clean fit",
}
_NAMES = {GEOMETRY: "geometry alone", TRUE_LABELS: "true labels", RGB: "RGB regression"}
_COLORS = {GEOMETRY: "#d55e00", TRUE_LABELS: "#000000", RGB: "#cc79a7"}
_NETWORKS = ("#0072b2", "#009e73", "#e69f00", "#56b4e9", "#999999", "#8c564b", "#b0a800", "#6a3d9a")
_STYLES = {CALIBRATED: "-.", HARD: ":"}
_CONDITIONS = {CLEAN: "#999999", SCENE: "#000000", **dict(
    zip(OBJECTS, ("#d55e00", "#e69f00", "#56b4e9"), strict=True))}  # fmt: skip


def write_pictures(content: dict[str, Any], folder: Path) -> tuple[Path, ...]:
    """Draw `accuracy.png`, `joints.png` and `waits.png` from the content of `accuracy.json`.

    Returns:
        The files; none if nothing was scored.

    Raises:
        ResultError: if one cannot be written.
    """
    scores = content["scores"]
    if not any(group in TITLES for groups in scores.values() for group in groups):
        return ()
    figures = {CURVES_FILE: draw_curves(scores), JOINTS_FILE: draw_joints(scores)}
    if any(waits_of(scores, kind) for kind in WAITS):
        figures[WAITS_FILE] = draw_waits(scores)
    for name, figure in figures.items():
        write_atomically(folder / name, partial(figure.savefig, format="png", dpi=160))
    return tuple(folder / name for name in figures)


def in_words(method: str) -> str:
    """What a method is called in pictures and tables."""
    warm = method.removesuffix(COLD)
    bare = warm.removesuffix(NO_TARGETS).removesuffix(CALIBRATED).removesuffix(HARD)
    said = {NO_TARGETS: ", targets off", CALIBRATED: ", calibrated", HARD: ", hard gates"}
    how = next((words for suffix, words in said.items() if warm.endswith(suffix)), "")
    return _NAMES.get(bare, bare) + how + (", cold start" if warm != method else "")


def draw_curves(scores: dict[str, Any]) -> Figure:
    """Share of joints within a threshold.

    A colour per method, dashed where it starts cold, dash-dotted where the person is calibrated,
    dotted with hard gates; a row per group of recordings and kind of joint, a column per condition.
    """
    rows = [
        (group, part)
        for group in TITLES
        if any(group in groups for groups in scores.values())
        for part in (("all", "visible", "hidden") if group == ROOM else ("all",))
    ]
    columns = (CLEAN, *reversed(OBJECTS))
    figure = Figure(figsize=(2.5 * len(columns) + 0.6, 2.2 * len(rows) + 0.9), layout="constrained")
    axes = figure.subplots(len(rows), len(columns), squeeze=False, sharex=True, sharey=True)
    lines: dict[str, Any] = {}
    for (group, part), row in zip(rows, axes, strict=True):
        for condition, axis in zip(columns, row, strict=True):
            # real people without a room are what the others are compared with
            bare = SCENE if group == REAL and condition == CLEAN else condition
            lines |= _curves(axis, scores, group, bare, part)
            axis.grid(alpha=0.3, lw=0.5)
            axis.spines[["top", "right"]].set_visible(False)
            axis.tick_params(labelsize=7)
        kind = "" if part == "all" else f"\n{part} joints only"
        row[0].set_ylabel(f"{TITLES[group]}{kind}\nwithin threshold [%]", fontsize=7)
    for axis, condition in zip(axes[0], columns, strict=True):
        title = "no object" if condition == CLEAN else f"object {condition} before"
        axis.set_title(title, fontsize=8)
    for axis in axes[-1]:
        axis.set_xlabel("threshold [cm]", fontsize=8)
    axes[0][0].set(ylim=(0, 102), xticks=(2, 5, 10, 15, 20))
    order = [name for name in scores if name in lines]
    figure.legend(
        [lines[name] for name in order], [in_words(name) for name in order],
        loc="outside lower center", ncols=4, fontsize=7.5, frameon=False,
    )  # fmt: skip
    return figure


def _curves(
    axis: Axes, scores: dict[str, Any], group: str, condition: str, part: str
) -> dict[str, Any]:
    lines = {}
    kinds = {n: n.removesuffix(COLD).removesuffix(CALIBRATED).removesuffix(HARD) for n in scores}
    bare = list(dict.fromkeys(kind for kind in kinds.values() if kind not in _NAMES))
    for method, groups in scores.items():
        found = groups.get(group, {}).get(condition)
        if found is None or found[part]["accuracy"] is None:
            continue
        name = method.removesuffix(COLD)
        color = _COLORS.get(kinds[method]) or _NETWORKS[bare.index(kinds[method]) % len(_NETWORKS)]
        (lines[method],) = axis.plot(
            100 * np.array(found["thresholds_m"]),
            100 * np.array(found[part]["accuracy"]),
            "--" if name != method else _STYLES.get(name.removeprefix(kinds[method]), "-"),
            color=color,
            lw=1.9 if bare and name == bare[0] else 1.2,
        )
    return lines


def waits_of(scores: dict[str, Any], kind: str) -> dict[str, list[int | None]]:
    """Method -> frames it took in every recording in a room, None where it never found the person.

    Args:
        scores: Of `accuracy.json`.
        kind: One of `WAITS`: starts of methods that start cold, or what came after a gap.
    """
    starts = kind == WAITS[0]
    found = {
        method: [
            frames
            for condition, of in groups.get(ROOM, {}).items()
            if (condition in GAPS) != starts
            for frames in of[kind]
        ]
        for method, groups in scores.items()
        if method.endswith(COLD) == starts
    }
    return {method: waits for method, waits in found.items() if waits}


def draw_waits(scores: dict[str, Any]) -> Figure:
    """Share of the recordings in which the person is found within so many frames."""
    figure = Figure(figsize=(8.6, 3.6), layout="constrained")
    titles = "cold start: frames to lock on", "after 2 s hidden or away: frames to recover"
    for axis, kind, title in zip(figure.subplots(1, 2, sharey=True), WAITS, titles, strict=True):
        for method, waits in waits_of(scores, kind).items():
            frames = np.arange(61)
            share = [np.mean([n is not None and n <= most for n in waits]) for most in frames]
            name = f"{in_words(method).removesuffix(', cold start')} ({len(waits)})"
            axis.step(frames, 100 * np.array(share), where="post", lw=1.3, label=name)
        axis.set(title=title, xlabel="frames", ylim=(0, 102), xlim=(0, 60))
        axis.title.set_fontsize(8)
        axis.grid(alpha=0.3, lw=0.5)
        axis.legend(fontsize=6.5, frameon=False, loc="lower right")
        axis.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("found [% of recordings]")
    return figure


def draw_joints(scores: dict[str, Any]) -> Figure:
    """Mean error of every joint in every condition, a row per group: the first network's.

    Without a network, the first method's.
    """
    networks = [name for name in scores if name.removesuffix(CALIBRATED) not in _NAMES]
    own = next((name for name in networks if COLD not in name), None)
    method = own or next(iter(scores))
    groups = [group for group in TITLES if group in scores[method]]
    figure = Figure(figsize=(7.6, 2.3 * max(len(groups), 1) + 0.6), layout="constrained")
    axes = figure.subplots(max(len(groups), 1), 1, squeeze=False, sharex=True)[:, 0]
    x = np.arange(len(JOINT_NAMES))
    for axis, group in zip(axes, groups, strict=False):
        shown = {c: found for c, found in scores[method][group].items() if c in SHOWN}
        width = 0.8 / max(len(shown), 1)
        for n, (condition, found) in enumerate(shown.items()):
            means = [found["joints"][name]["mean_m"] for name in JOINT_NAMES]
            heights = [np.nan if mean is None else 100 * mean for mean in means]
            place = x + (n + 0.5) * width - 0.4
            axis.bar(place, heights, width, color=_CONDITIONS[condition], label=condition)
        axis.set_ylabel("mean error [cm]", fontsize=8)
        axis.set_title(f"{in_words(method)}: {TITLES[group]}", fontsize=8)
        axis.tick_params(labelsize=7)
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(fontsize=7, frameon=False, ncols=5)
    words = [re.sub("^l_", "left ", re.sub("^r_", "right ", name)) for name in JOINT_NAMES]
    axes[-1].set_xticks(x, words, rotation=90)
    return figure

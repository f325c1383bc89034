# SPDX-License-Identifier: Apache-2.0
"""Joints found by somebody else against labels: does each lie on a pixel of its own part?

A joint's cell is the one of the network's picture that its pixel falls into. Shoulders and hips lie
where two parts meet, so either part is their own.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray

from segmentation.labels import LABELS, MIRRORED
from segmentation.preprocess import letterbox

VISIBLE = 0.8
"""Joints with more visibility than this are asked about."""
_SIDES = {"r": "right", "l": "left"}
OWN = {
    "head": ("head",),
    "neck": ("head", "torso"),
    "chest": ("torso",),
    **{f"{s}_shoulder": ("torso", f"{side}_arm") for s, side in _SIDES.items()},
    **{f"{s}_{joint}": (f"{side}_arm",) for s, side in _SIDES.items()
       for joint in ("elbow", "wrist", "hand")},
    **{f"{s}_hip": ("torso", f"{side}_leg") for s, side in _SIDES.items()},
    **{f"{s}_{joint}": (f"{side}_leg",) for s, side in _SIDES.items()
       for joint in ("knee", "ankle", "foot")},
}  # fmt: skip
"""Joint -> the parts that are its own; other joints are not asked about."""


@dataclass
class JointCounts:
    """What lay under the joints; rows are 0 = without a depth reading there, 1 = with one."""

    outside: int = 0
    """Joints outside the image."""
    labels: dict[str, Int[ndarray, "2 7"]] = field(default_factory=dict)
    """Joint -> how often it lay on which label."""
    near: dict[str, Int[ndarray, " 2"]] = field(default_factory=dict)
    """Joint -> how often a cell of its own part was at most one cell away."""

    def add(
        self,
        labels: UInt8[ndarray, "106 128"],
        read: Bool[ndarray, "106 128"],
        joints: dict[str, Float[ndarray, " 2"]],
        size: tuple[int, int],
    ) -> tuple[int, int]:
        """Count the joints of a frame.

        Args:
            labels: Labels of the network's picture.
            read: Where that has a depth reading.
            joints: Joint -> its pixel (u, v) in the image [px].
            size: Width and height of the image [px].

        Returns:
            How many joints lay on their own part, and how many were in the image.
        """
        fit = letterbox(*size)
        right = total = 0
        for name, (u, v) in joints.items():
            column = int(np.floor((u + 0.5) * fit.columns / size[0]))
            row = int(np.floor((v + 0.5) * fit.rows / size[1]))
            if not (0 <= column < fit.columns and 0 <= row < fit.rows):
                self.outside += 1
                continue
            i, j = row + fit.top, column + fit.left
            own = [LABELS.index(part) for part in OWN[name]]
            has = int(read[i, j])
            self.labels.setdefault(name, np.zeros((2, len(LABELS)), int))[has, labels[i, j]] += 1
            around = labels[max(0, i - 1) : i + 2, max(0, j - 1) : j + 2]
            self.near.setdefault(name, np.zeros(2, int))[has] += bool(np.isin(around, own).any())
            right += int(labels[i, j] in own)
            total += 1
        return right, total

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "outside": self.outside,
            "labels": {name: table.tolist() for name, table in self.labels.items()},
            "near": {name: table.tolist() for name, table in self.near.items()},
        }


def witness_summary(plain: dict[str, Any]) -> dict[str, Any]:
    """Shares from the counts of `JointCounts.plain`.

    `own` and `near` are over all joints in the image, `own_read` and `near_read` over those with a
    depth reading under them. `mirrored` lay on the same part of the other side, `other` on another
    part, `background` on none.
    """
    tables = {name: np.array(table) for name, table in plain["labels"].items()}
    near = {name: np.array(table) for name, table in plain["near"].items()}
    own = {name: _on_own(name, table) for name, table in tables.items()}
    both = np.sum([table.sum(axis=1) for table in tables.values()], axis=0, initial=0) + [0, 0]
    right = np.sum(list(own.values()), axis=0, initial=0) + [0, 0]
    close = np.sum(list(near.values()), axis=0, initial=0) + [0, 0]
    mirrored = sum(_mirrored(name, table) for name, table in tables.items())
    background = sum(int(table[:, 0].sum()) for table in tables.values())
    total = int(both.sum())
    return {
        "joints": total,
        "outside": plain["outside"],
        "without_reading": int(both[0]),
        "own": _share(right.sum(), total),
        "near": _share(close.sum(), total),
        "own_read": _share(right[1], both[1]),
        "near_read": _share(close[1], both[1]),
        "mirrored": _share(mirrored, total),
        "background": _share(background, total),
        "other": _share(total - right.sum() - mirrored - background, total),
        "by_joint": {
            name: {"joints": int(tables[name].sum()), "own": _share(own[name].sum(), table.sum())}
            for name, table in tables.items()
        },
    }


def _on_own(name: str, table: Int[ndarray, "2 7"]) -> Int[ndarray, " 2"]:
    return table[:, [LABELS.index(part) for part in OWN[name]]].sum(axis=1)


def _mirrored(name: str, table: Int[ndarray, "2 7"]) -> int:
    own = [LABELS.index(part) for part in OWN[name]]
    others = {int(MIRRORED[label]) for label in own} - set(own)
    return int(table[:, sorted(others)].sum())


def _share(part: float, whole: float) -> float | None:
    return float(part / whole) if whole else None

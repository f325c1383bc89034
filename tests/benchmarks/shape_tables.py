# SPDX-License-Identifier: Apache-2.0
"""The section of docs/results.md about bodies: what each switch buys, and how honest it is."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
from baseline import Metric, target_table
from numpy import ndarray
from report import table
from shape_scoring import Row

from kintrack.calibration.measures import LIMBS

TITLES = {
    "average": "average adult in average clothes",
    "template": "template, sized in the first frame",
    "calibrated": "calibrated in the first second",
    "deformable": "the same, and deformable",
    "whole": "calibrated from the whole recording",
}
"""Body -> words; the order of the tables."""
LABELS = {"recording": "true labels", "network": "labels by the network that ships"}


def targets(rows: Sequence[Row]) -> str:
    """What is asked for against what was measured: synthetic people, then real ones."""
    found: list[Metric] = []
    for labels, words in LABELS.items():
        known, soft = (_chosen(rows, labels, body) for body in ("calibrated", "deformable"))
        if not known:
            continue
        limbs = [np.mean([abs(_limb(row, name)) for row in known]) for name in LIMBS]
        found += [
            _metric(f"height, calibrated, {words}", 100 * _mean(_height_errors(known)), "cm", 1.5),
            _metric("limbs, calibrated, the worst of four", 100 * float(max(limbs)), "%", 4.0),
            _metric("joints, calibrated", 100 * _mean(r.joints_m for r in known), "cm", 2.0),
            _metric("surface, deformable", 1e3 * _mean(r.surface_m for r in soft), "mm", 5.0),
        ]
    bare, soft = (_chosen(rows, "none", body) for body in ("template", "deformable"))
    if bare and soft:
        less = 1 - _mean(r.surface_m for r in soft) / _mean(r.surface_m for r in bare)
        further = _mean(r.joints_m for r in soft) - _mean(r.joints_m for r in bare)
        spans = [np.ptp(heights) for heights in _heights(rows).values()]
        found += [
            _metric("UTD-MHAD: surface nearer than template's", 100 * less, "%", 25.0, "higher"),
            _metric("UTD-MHAD: further from the Kinect's joints", 100 * further, "cm", 0.0),
            _metric("UTD-MHAD: heights of one person differ", 100 * float(max(spans)), "cm", 2.0),
        ]
    note = "Mean errors; the surface is a root mean square; of the heights the most."
    return f"{target_table(found)}\n\n{note}"


def _metric(says: str, value: float, unit: str, target: float, better: str = "lower") -> Metric:
    return Metric(says, says, value, unit, better, 0.0, target)


def _chosen(rows: Sequence[Row], labels: str, body: str) -> list[Row]:
    return [row for row in rows if row.labels == labels and row.body == body]


def _height_errors(rows: Sequence[Row]) -> list[float]:
    return [abs(row.height_error_m) for row in rows]


def synthetic_tables(rows: Sequence[Row]) -> str:
    """What each switch buys on dressed synthetic people, and whether the doubt is honest."""
    text = []
    for labels, words in LABELS.items():
        chosen = [row for row in rows if row.labels == labels]
        if not chosen:
            continue
        people = len({row.name for row in chosen})
        text += [f"### {people} dressed people, {words}", _bought(chosen), _honesty(chosen)]
    return "\n\n".join(text)


def _bought(rows: Sequence[Row]) -> str:
    header = [
        "body",
        "joints: mean, median [cm]",
        "height: mean, median [cm]",
        "height within 1.5 cm",
        "upper arm, forearm, thigh, shank [%]",
        "surface [mm]",
        "tracked",
        "calibrated",
    ]
    return table(header, [_line(body, own) for body, own in _by_body(rows)])


def _line(body: str, rows: Sequence[Row]) -> list[str]:
    joints = 100 * np.array([row.joints_m for row in rows])
    off = 100 * np.abs([row.height_error_m for row in rows])
    arms = [100 * np.mean(np.abs([_limb(row, name) for row in rows])) for name in LIMBS]
    return [
        TITLES[body],
        f"{np.nanmean(joints):.2f}, {np.nanmedian(joints):.2f}",
        f"{np.mean(off):.1f}, {np.median(off):.1f}",
        f"{100 * np.mean(off <= 1.5):.0f} %",
        ", ".join(f"{arm:.1f}" for arm in arms),
        f"{1e3 * np.nanmean([row.surface_m for row in rows]):.1f}",
        f"{100 * np.mean([row.tracked for row in rows]):.0f} %",
        f"{sum(row.used in ('calibrated', 'given') for row in rows)} of {len(rows)}",
    ]


def _limb(row: Row, name: str) -> float:
    """Estimated over true length, minus one."""
    return row.limbs[name].value_m / row.limbs_m[name] - 1.0


def _honesty(rows: Sequence[Row]) -> str:
    """Errors in units of the stated standard deviation: RMS, and the shares within 1 and 2."""
    lines = []
    for body, own in _by_body(rows):
        sure = [row for row in own if row.height is not None and row.height.sigma_m > 0]
        if body == "deformable" or not sure:
            continue
        z = [np.array([r.height_error_m / r.height.sigma_m for r in sure if r.height])]
        for name in LIMBS:
            off = [r.limbs[name].value_m - r.limbs_m[name] for r in sure]
            z.append(np.array(off) / [r.limbs[name].sigma_m for r in sure])
        lines.append([TITLES[body], *map(_scatter, z)])
    header = ["error over its deviation", "height", *(name.replace("_", " ") for name in LIMBS)]
    note = "RMS; share within 1 and within 2. Errors that scatter as stated have 1.0; 68, 95 %."
    return f"{table(header, lines)}\n\n{note}" if lines else ""


def _scatter(z: ndarray) -> str:
    within = (f"{100 * np.mean(np.abs(z) <= k):.0f}" for k in (1, 2))
    return f"{np.sqrt(np.mean(z**2)):.1f}; {', '.join(within)} %"


def real_tables(rows: Sequence[Row]) -> str:
    """Heights of the same person from different recordings, and what each switch buys."""
    spans = []
    for who, found in sorted(_heights(rows).items()):
        spans.append(
            [
                who,
                ", ".join(f"{h:.3f}" for h in found),
                f"{100 * np.ptp(found):.1f}",
                f"{100 * np.std(found):.1f}",
            ]
        )
    bought = [
        [
            TITLES[body],
            f"{100 * _mean(r.joints_m for r in own):.2f}",
            f"{1e3 * _mean(r.surface_m for r in own):.1f}",
            f"{100 * np.mean([r.tracked for r in own]):.0f} %",
            f"{sum(r.used == 'calibrated' for r in own)} of {len(own)}",
        ]
        for body, own in _by_body(rows)
    ]
    return "\n\n".join(
        [
            f"### Real people, {len({r.name for r in rows})} recordings of UTD-MHAD, no labels",
            table(["person", "heights [m]", "span [cm]", "deviation [cm]"], spans),
            table(
                ["body", "Kinect's joints [cm]", "surface [mm]", "tracked", "calibrated"], bought
            ),
        ]
    )


def _heights(rows: Sequence[Row]) -> dict[str, list[float]]:
    """Heights of every real person who was calibrated [m]."""
    found: dict[str, list[float]] = defaultdict(list)
    for row in rows:
        known = row.labels == "none" and row.body == row.used == "calibrated"
        if known and row.height is not None:
            found[row.name.split("_")[1]].append(row.height.value_m)
    return found


def _mean(values: Iterable[float]) -> float:
    return float(np.nanmean(list(values)))


def _by_body(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """Rows of each body that there is, in the order of `TITLES`."""
    found = [(body, [row for row in rows if row.body == body]) for body in TITLES]
    return [(body, own) for body, own in found if own]

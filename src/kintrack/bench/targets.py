# SPDX-License-Identifier: Apache-2.0
"""What the tracker is meant to reach, beside what was measured."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from kintrack.bench.cases import CLEAN, GAPS, OBJECTS, REAL, ROOM, SCENE
from kintrack.bench.methods import CALIBRATED, COLD, GEOMETRY, NO_TARGETS, RGB, TRUE_LABELS
from kintrack.bench.segmentation.tables import Grid
from kintrack.bench.tables import LOCK_FRAMES, RECOVER_FRAMES, within

OTHERS = (GEOMETRY, TRUE_LABELS, RGB)
PCK = {"bonn_tablet": 0.90, "sofa": 0.80}


class Target(NamedTuple):
    """One thing to reach."""

    what: str
    """In words."""
    measured: float | None
    """Of this project's own method; None if it was not measured."""
    limit: float
    """What is wanted."""
    at_least: bool
    """Whether more is better."""
    unit: str
    """`cm`, `mm`, `%`, `points` or `frames`."""

    @property
    def passed(self) -> bool | None:
        """Whether it is reached."""
        if self.measured is None:
            return None
        return self.measured >= self.limit if self.at_least else self.measured <= self.limit


def targets_grid(content: dict[str, Any]) -> Grid:
    """Every target with the measurement of the first network."""
    rows = []
    for target in targets(content):
        sign = "at least" if target.at_least else "at most"
        rows.append(
            (
                target.what,
                "-" if target.measured is None else f"{target.measured:.1f} {target.unit}",
                f"{sign} {target.limit:g} {target.unit}",
                {True: "pass", False: "**fail**", None: "-"}[target.passed],
            )
        )
    return Grid("Targets", ("this project's own", "measured", "target", ""), rows)


def targets(content: dict[str, Any]) -> list[Target]:
    """The targets of the synthetic recordings in rooms, of real people and of full scenes.

    Where the person was calibrated, as `kintrack fit` does, that is what counts.
    """
    scores, scenes = content["scores"], content["scenes"]
    names = [name.removesuffix(COLD).removesuffix(CALIBRATED) for name in scores]
    own = next((name for name in names if name not in OTHERS), None)
    if own is None:
        return []
    room, real = (scores.get(own, {}).get(group, {}) for group in (ROOM, REAL))
    room = room | scores.get(own + CALIBRATED, {}).get(ROOM, {})
    cold = scores.get(own + COLD, {}).get(ROOM, {})
    out = []
    for condition in OBJECTS:
        found = room.get(condition)
        for what, measured, limit, at_least, unit in (
            ("mean error", _cm(found, "all"), 4.0, False, "cm"),
            ("mean error of visible joints", _cm(found, "visible"), 2.5, False, "cm"),
            ("joints within 10 cm", _within(found), 95.0, True, "%"),
        ):
            out.append(
                Target(f"object {condition} before: {what}", measured, limit, at_least, unit)
            )
    near, far = (_within(room.get(condition)) for condition in (OBJECTS[0], OBJECTS[-1]))
    fall = None if near is None or far is None else far - near
    out.append(Target("joints within 10 cm, 60 cm less 30 cm", fall, 2.0, False, "points"))
    held = [found["all"]["within_95"] for c, found in room.items() if c in OBJECTS]
    known = [100.0 * share for share in held if share is not None]
    for what, measured, limit, at_least in (
        ("least", min(known, default=None), 90.0, True),
        ("greatest", max(known, default=None), 98.0, False),
    ):
        says = f"true joints within their 95 % ellipsoid, {what} of the distances"
        out.append(Target(says, measured, limit, at_least, "%"))
    both = [scores.get(name, {}).get(ROOM, {}).get(CLEAN) for name in (own, own + NO_TARGETS)]
    with_mm, without_mm = (_mm(found) for found in both)
    effect = None if with_mm is None or without_mm is None else abs(with_mm - without_mm)
    says = "effect of the targets on the mean error while tracking, no object"
    out.append(Target(says, effect, 2.0, False, "mm"))
    starts = [n for found in cold.values() for n in found["locked_after"]]
    out.append(Target(f"cold starts found within {LOCK_FRAMES} frames",
                      _share(starts, LOCK_FRAMES), 99.0, True, "%"))  # fmt: skip
    gaps = [n for c in GAPS if c in room for n in room[c]["recovered_after"]]
    out.append(Target(f"found again within {RECOVER_FRAMES} frames after 2 s",
                      _share(gaps, RECOVER_FRAMES), 98.0, True, "%"))  # fmt: skip
    composed = [found for c, found in real.items() if c in (SCENE, *OBJECTS)]
    worst = [_cm(found, "visible") for found in composed]
    says = "real people in a real room, visible joints from the clean fit, worst condition"
    out.append(Target(says, max(filter(None, worst), default=None), 2.0, False, "cm"))
    least = min((100.0 * found["status"]["tracking"] for found in composed), default=None)
    out.append(Target("the same, frames tracking, worst condition", least, 97.0, True, "%"))
    mine = scenes.get(own + CALIBRATED + COLD) or scenes.get(own + COLD, {})
    for name, limit in PCK.items():
        pck = mine.get(name, {}).get("pck")
        says = f"{name} from a cold start, PCK@0.2"
        out.append(Target(says, None if pck is None else 100.0 * pck, 100.0 * limit, True, "%"))
    swaps = sum(found["swapped_frames"] for found in mine.values()) if mine else None
    out.append(Target("left and right swapped in full scenes", swaps, 0.0, False, "frames"))
    return out


def _cm(found: dict[str, Any] | None, part: str) -> float | None:
    mean = None if found is None else found[part]["mean_m"]
    return None if mean is None else 100.0 * mean


def _mm(found: dict[str, Any] | None) -> float | None:
    cm = _cm(found, "all")
    return None if cm is None else 10.0 * cm


def _within(found: dict[str, Any] | None) -> float | None:
    share = None if found is None else within(found, 0.10)
    return None if share is None else 100.0 * share


def _share(frames: Sequence[int | None], most: int) -> float | None:
    """Share [%] of those that took at most so many frames."""
    return (
        100.0 * sum(n is not None and n <= most for n in frames) / len(frames) if frames else None
    )

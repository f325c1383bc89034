# SPDX-License-Identifier: Apache-2.0
"""The content of `accuracy.json`: scores by method, group and condition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from kintrack.bench.cases import CONDITIONS, thing_of
from kintrack.bench.scores import Errors, summary


def content_of(
    seed: int,
    errors: Mapping[str, Sequence[tuple[str, Errors]]],
    scenes: Mapping[str, Mapping[str, Any]],
    left_out: Mapping[str, str],
) -> dict[str, Any]:
    """Pool the recordings of a group and a condition.

    Args:
        seed: What drew the recordings.
        errors: Method -> group and errors of every recording.
        scenes: Method -> full scene -> its scores.
        left_out: What could not be made or run, and why.

    Returns:
        `scores` by method, group and condition, each with single `sequences`; `scenes`;
        `left_out`; `seed`.
    """
    scores: dict[str, Any] = {}
    for method, found in errors.items():
        groups = dict.fromkeys(group for group, _ in found)
        for group in groups:
            for condition in CONDITIONS:
                chosen = [e for g, e in found if g == group and e.case.condition == condition]
                if chosen:
                    singles = {e.case.name: _short(e) for e in chosen}
                    scores.setdefault(method, {}).setdefault(group, {})[condition] = summary(
                        chosen
                    ) | {"sequences": singles}
    return {
        "seed": seed,
        "scores": scores,
        "scenes": {method: found for method, found in scenes.items() if found},
        "left_out": dict(left_out),
    }


def _short(errors: Errors) -> dict[str, Any]:
    """A recording's summary without curves and single joints."""
    whole = summary([errors])
    kept = ("frames", "status", "hidden_share", "swapped_frames", "locked_after")
    gaps = ("held_before", "recovered_after", "status_in_gap")
    return {
        **{key: whole[key] for key in (*kept, *gaps) if key in whole},
        "object": thing_of(errors.case),
        **{
            part: {key: whole[part][key] for key in ("mean_m", "p95_m", "posed")}
            for part in ("all", "visible", "hidden")
        },
    }

# SPDX-License-Identifier: Apache-2.0
"""Measured metrics with unit, direction and target, and the committed values to compare with."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from report import cpu_model, table

from kintrack.errors import ResultError
from kintrack.files import write_json

BASELINE = Path(__file__).parent / "baseline.json"
"""The committed values."""


@dataclass(frozen=True)
class Metric:
    """One measured number."""

    name: str
    """Key in the baseline."""
    says: str
    """The same in words."""
    value: float
    """What was measured."""
    unit: str
    """Unit of value, target and tolerance."""
    better: str
    """Direction: "lower" or "higher"."""
    tolerance: float
    """How much worse than the baseline is still no regression."""
    target: float | None = None
    """What the project asks for; None where it asks for nothing."""

    @property
    def passed(self) -> bool:
        """Whether the target is met; a number that is missing meets none."""
        return self.target is None or not self._worse_than(self.target, 0.0)

    def regressed(self, baseline: float) -> bool:
        """Whether it is worse than a baseline by more than the tolerance."""
        return self._worse_than(baseline, self.tolerance)

    def show(self, value: float) -> str:
        """A value with its unit."""
        text = "-" if not math.isfinite(value) else f"{value:.5g}"
        return f"{text} {self.unit}".strip()

    def _worse_than(self, bound: float, by: float) -> bool:
        if self.better == "lower":
            return not self.value <= bound + by
        return not self.value >= bound - by


def target_table(metrics: Sequence[Metric]) -> str:
    """Markdown table of metrics against their targets."""
    rows = []
    for m in metrics:
        sign = "at most" if m.better == "lower" else "at least"
        wanted = "-" if m.target is None else f"{sign} {m.show(m.target)}"
        verdict = "-" if m.target is None else "pass" if m.passed else "**fail**"
        rows.append([m.says, m.show(m.value), wanted, verdict])
    return table(["", "measured", "target", ""], rows)


def as_dict(metrics: Sequence[Metric]) -> dict[str, dict[str, Any]]:
    """Name -> everything about a metric, for JSON."""
    return {m.name: asdict(m) | {"passed": m.passed} for m in metrics}


def save(group: str, metrics: Sequence[Metric], path: Path = BASELINE) -> None:
    """Make the metrics the baseline of their group; other groups stay."""
    content = _read(path) if path.is_file() else {}
    content[group] = {
        "machine": cpu_model(),
        "metrics": {
            m.name: {
                "value": float(f"{m.value:.5g}"),
                "unit": m.unit,
                "better": m.better,
                "tolerance": float(f"{m.tolerance:.3g}"),
            }
            for m in metrics
        },
    }
    write_json(path, content)


def check(group: str, metrics: Sequence[Metric], path: Path = BASELINE) -> list[str]:
    """Compare with the baseline, under the tolerances committed there.

    Args:
        group: Which benchmark.
        metrics: What was measured.
        path: The baseline.

    Returns:
        One line per regression.

    Raises:
        ResultError: if there is no such baseline.
    """
    content = _read(path)
    if group not in content:
        raise ResultError(f"{path} has no group {group!r}; it has: {', '.join(content) or 'none'}")
    known = content[group]["metrics"]
    lines = []
    for m in metrics:
        if m.name not in known:
            continue
        entry = known[m.name]
        judged = Metric(m.name, m.says, m.value, m.unit, entry["better"], entry["tolerance"])
        if entry["value"] is None:
            continue
        if entry["unit"] != m.unit:
            lines.append(f"{m.says}: measured in {m.unit!r}, baseline in {entry['unit']!r}")
        elif judged.regressed(entry["value"]):
            lines.append(
                f"{m.says}: {m.show(m.value)}, baseline {m.show(entry['value'])}, "
                f"tolerance {m.show(entry['tolerance'])}"
            )
    absent = sorted(set(known) - {m.name for m in metrics})
    return lines + [f"{name}: in the baseline, but not measured" for name in absent]


def machine(group: str, path: Path = BASELINE) -> str:
    """Processor on which the baseline of a group was taken."""
    return str(_read(path).get(group, {}).get("machine", "unknown"))


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ResultError(f"{path}: no readable baseline ({error})") from error

# SPDX-License-Identifier: Apache-2.0
"""Tables of the bench of bodies."""

import importlib
from pathlib import Path

import pytest

from kintrack.calibration.measures import LIMBS, Length

BENCHMARKS = Path(__file__).parent / "benchmarks"


@pytest.fixture
def tables(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("shape_tables")


@pytest.fixture
def row(tables):
    def make(name, body, off_m, sigma_m=0.02, labels="recording", true_m=1.7):
        limbs = {limb: Length(0.33, 0.016) for limb in LIMBS}
        return importlib.import_module("shape_scoring").Row(
            name, labels, body, "calibrated", 0.03, 1.0, 0.012, Length(1.7 + off_m, sigma_m),
            limbs, true_m, dict.fromkeys(LIMBS, 0.30),
        )  # fmt: skip

    return make


def test_errors_and_their_doubt_are_told(tables, row):
    rows = [row("00", "template", 0.05, 0.0), row("01", "template", 0.01, 0.0)]
    rows += [row("00", "calibrated", 0.01), row("01", "calibrated", -0.03)]
    text = tables.synthetic_tables(rows)
    assert "### 2 dressed people, true labels" in text and "network" not in text
    sized, known = (line for line in text.splitlines() if "3.00, 3.00" in line)
    assert "| 3.0, 3.0 | 50 % | 10.0, 10.0, 10.0, 10.0 |" in sized
    assert "| 2.0, 2.0 | 50 % |" in known
    doubt = text.split("error over its deviation")[1]
    assert "| 1.1; 50, 100 % | 1.9; 0, 100 % |" in doubt  # 0.5 and 1.5; 1.9 for every limb
    assert "sized" not in doubt


def test_the_same_person_is_compared_over_recordings(tables, row):
    rows = [
        row(f"{a}_s1_t1", "calibrated", off, labels="none")
        for a, off in (("a03", 0.0), ("a22", 0.03))
    ]
    text = tables.real_tables(rows)
    assert "| s1 | 1.700, 1.730 | 3.0 | 1.5 |" in text
    assert "| calibrated in the first second | 3.00 | 12.0 | 100 % | 2 of 2 |" in text


def test_targets_are_met_or_missed(tables, row):
    rows = [row("00", body, 0.01) for body in ("calibrated", "deformable")]
    for action, off_m in (("a03", 0.0), ("a22", 0.03)):
        for body in ("template", "calibrated", "deformable"):
            rows.append(row(f"{action}_s1_t1", body, off_m, labels="none"))
    text = tables.targets(rows)
    assert "| height, calibrated, true labels | 1 cm | at most 1.5 cm | pass |" in text
    assert "| limbs, calibrated, the worst of four | 10 % | at most 4 % | **fail** |" in text
    assert "| joints, calibrated | 3 cm | at most 2 cm | **fail** |" in text
    assert "| UTD-MHAD: surface nearer than template's | 0 % | at least 25 % | **fail** |" in text
    assert "| UTD-MHAD: heights of one person differ | 3 cm | at most 2 cm | **fail** |" in text
    assert "labels by the network" not in text

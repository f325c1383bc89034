# SPDX-License-Identifier: Apache-2.0
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from kintrack.errors import ResultError

BENCHMARKS = Path(__file__).parent / "benchmarks"
SRC = Path(__file__).parents[1] / "src"


@pytest.fixture
def report(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("report")


@pytest.fixture
def baseline(report):
    return importlib.import_module("baseline")


def test_a_missing_results_file_is_made_with_the_section(report, tmp_path):
    path = tmp_path / "docs" / "results.md"
    report.rewrite_section(path, "speed", "## Speed\n\n25 ms")
    text = path.read_text()
    assert text.startswith("# Results\n")
    assert "## Speed\n\n25 ms\n<!-- end speed -->" in text


def test_rewriting_replaces_one_section_and_keeps_the_rest(report, tmp_path):
    path = tmp_path / "results.md"
    report.rewrite_section(path, "one", "first")
    path.write_text(path.read_text() + "\nwritten by hand\n")
    report.rewrite_section(path, "two", "second")
    before = path.read_text()
    report.rewrite_section(path, "one", r"changed \1")
    assert path.read_text() == before.replace("\nfirst\n", "\nchanged \\1\n")
    report.rewrite_section(path, "one", "first")
    assert path.read_text() == before


def test_a_lonely_marker_is_refused_and_the_file_left_alone(report, tmp_path):
    path = tmp_path / "results.md"
    report.rewrite_section(path, "one", "first")
    broken = path.read_text().replace("<!-- end one -->", "")
    path.write_text(broken)
    with pytest.raises(ResultError, match="one pair"):
        report.rewrite_section(path, "one", "changed")
    assert path.read_text() == broken


def test_a_section_name_that_could_break_its_marker_is_refused(report, tmp_path):
    with pytest.raises(ResultError, match="allowed"):
        report.rewrite_section(tmp_path / "results.md", "a --> b", "")


def test_conditions_hide_host_and_places_outside_the_repository(report, tmp_path):
    script = str(BENCHMARKS / "speed.py")
    facts = report.conditions("demo", "none", [script, "--data", str(tmp_path), f"--x={tmp_path}"])
    assert facts["command"] == "python tests/benchmarks/speed.py --data <path> --x=<path>"
    text = report.bullets(facts)
    assert str(tmp_path) not in text
    assert os.uname().nodename not in text.split()
    assert re.search(r"- versions: python 3\.\d+\.\d+, .*numpy", text)
    assert re.search(r"- date: \d{4}-\d\d-\d\d", text)
    assert "cores" in facts["machine"]


def test_a_table_has_as_many_rules_as_columns(report):
    assert report.table(["", "a"], [["x", "1"]]) == "|  | a |\n| --- | ---: |\n| x | 1 |"


@pytest.mark.parametrize("better, worse, fine", [("lower", 11.5, 10.5), ("higher", 8.5, 9.5)])
def test_only_what_is_worse_by_more_than_the_tolerance_is_a_regression(
    baseline, tmp_path, better, worse, fine
):
    path = tmp_path / "baseline.json"

    def metric(value):
        return baseline.Metric("m", "metric", value, "ms", better, 1.0)

    baseline.save("group", [metric(10.0)], path)
    assert baseline.check("group", [metric(fine)], path) == []
    assert len(baseline.check("group", [metric(worse)], path)) == 1
    assert len(baseline.check("group", [metric(float("nan"))], path)) == 1
    assert len(baseline.check("group", [], path)) == 1


def test_a_target_is_missed_by_a_value_beyond_it_and_by_none_at_all(baseline):
    def passed(value):
        return baseline.Metric("m", "metric", value, "ms", "lower", 0.0, 25.0).passed

    assert passed(25.0)
    assert not passed(25.1)
    assert not passed(float("nan"))


def test_speed_runs_on_the_first_frames_of_the_demo_and_writes_nothing(tmp_path):
    root = Path(__file__).parents[1]
    results = root / "docs" / "results.md"
    before = results.read_bytes() if results.exists() else None
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / "speed.py"), "--quick", "--data", str(tmp_path)],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(SRC)},
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    for stage in ("observe", "skin", "associate", "solve", "report", "whole frame"):
        assert re.search(rf"\| \**{stage}\** \| \**\d+\.\d / \d+\.\d\** \|", done.stdout)
    assert "| frames timed | 7 |" in done.stdout
    assert (results.read_bytes() if results.exists() else None) == before


def test_a_subset_is_not_compared_with_the_baseline():
    done = subprocess.run(
        [sys.executable, str(BENCHMARKS / "speed.py"), "--quick", "--check"],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(SRC)},
        timeout=300,
    )
    assert done.returncode == 2
    assert "not comparable" in done.stderr
    assert "Traceback" not in done.stderr

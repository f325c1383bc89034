# SPDX-License-Identifier: Apache-2.0
import ast
from pathlib import Path

import matplotlib
import nbformat
import pytest
from matplotlib import pyplot

NOTEBOOKS = sorted((Path(__file__).parents[1] / "notebooks").glob("*.ipynb"))


@pytest.fixture(params=NOTEBOOKS, ids=lambda path: path.stem)
def notebook(request):
    return nbformat.read(request.param, as_version=4)


def code_cells(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def imported_names(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def test_there_are_notebooks():
    assert NOTEBOOKS


def test_every_cell_runs_in_order(notebook, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    before = matplotlib.get_backend()
    pyplot.switch_backend("agg")
    names: dict[str, object] = {"__name__": "__main__"}
    try:
        for n, cell in enumerate(code_cells(notebook)):
            exec(compile(cell.source, f"cell {n}", "exec"), names)
        assert pyplot.get_fignums()
    finally:
        pyplot.close("all")
        pyplot.switch_backend(before)


def test_outputs_are_cleared(notebook):
    assert all(not cell.outputs and cell.execution_count is None for cell in code_cells(notebook))


def test_only_the_public_api_is_used_and_nothing_is_defined(notebook):
    for cell in code_cells(notebook):
        tree = ast.parse(cell.source)
        assert not any(
            isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef, ast.Lambda))
            for node in ast.walk(tree)
        )
        parts = [part for name in imported_names(tree) for part in name.split(".")]
        assert not any(part.startswith("_") for part in parts)

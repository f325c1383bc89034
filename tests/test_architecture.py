# SPDX-License-Identifier: Apache-2.0
"""Data flows one way: a file imports only from its own package or from rows above its own."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src"
ROWS = (
    ("errors",),
    ("files",),
    ("joints",),
    ("geometry", "raster", "components"),
    (
        "bounds",
        "config",
        "deformation_config",
        "floor_config",
        "labelled_config",
        "objective_config",
        "rival_config",
    ),
    ("rig",),
    ("body",),
    ("skin",),
    ("human",),
    ("shape",),
    ("clothing",),
    ("sequence", "segmenter"),
    ("association",),
    ("deformation",),
    ("sides", "people", "targets", "lifecycle", "floor"),
    ("whereabouts",),
    ("residuals",),
    ("belief", "confidence"),
    ("solver",),
    ("alignment",),
    ("settling",),
    ("occlusion", "judge"),
    ("start",),
    ("begin",),
    ("offsets",),
    ("result", "result_writer"),
    ("calibration",),
    ("person",),
    ("reporting",),
    ("rivals", "memory", "tracker"),
    ("metrics", "evaluation"),
    ("export",),
    ("viewer",),
    ("fit",),
    ("surfaces",),
    ("strip",),
    ("modelling",),
    ("labelling",),
    ("bench",),
    ("commands",),
    ("cli",),
)
"""From low to high; names of one row may import each other."""
LEVEL = {name: level for level, row in enumerate(ROWS) for name in row}
FORBIDDEN_MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "joblib", "shelve", "marshal",
                     "urllib", "requests", "httpx", "aiohttp", "ftplib"}  # fmt: skip
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}
HEAVY = {
    "kintrack/modelling/": {"torch", "anny", "pymeshlab", "trimesh", "skimage"},
    "synthesis/people/build.py": {"torch", "anny"},
    "synthesis/motions/habits.py": {"sklearn"},
    "synthesis/objects/files.py": {"trimesh", "PIL"},
    "synthesis/render/": {"embreex"},
    "segmentation/networks.py": {"torch"},
    "segmentation/loss.py": {"torch"},
    "segmentation/calibrate.py": {"torch"},
    "segmentation/learner.py": {"torch"},
    "segmentation/muon.py": {"torch"},
    "segmentation/train.py": {"torch"},
    "segmentation/runtime.py": {"torch", "openvino"},
    "segmentation/graph.py": {"openvino"},
    "kintrack/solver/symbolic_body.py": {"casadi", "mediapipe"},
    "kintrack/solver/nlp.py": {"casadi"},
    "kintrack/bench/rgb_worker.py": {"mediapipe"},
}
"""Who may import which of the packages that not everybody has."""
ALL_HEAVY = {"torch", "anny", "pymeshlab", "trimesh", "embreex", "skimage", "sklearn", "PIL",
             "openvino", "casadi"}  # fmt: skip
ONLY_TO_TEST = {"pytest", "mujoco", "yourdfpy"}

FILES = sorted(SOURCE.rglob("*.py"))
KINTRACK = [path for path in FILES if path.relative_to(SOURCE).parts[0] == "kintrack"]


def name_of(path):
    return str(path.relative_to(SOURCE))


def unit(path):
    """The row's name of a file: `sequence` for every file of that package."""
    return path.relative_to(SOURCE).with_suffix("").parts[1]


def imports(path):
    """Full module names that a file imports, wherever in it."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            if node.module in ("kintrack", "synthesis", "segmentation"):
                yield from (f"{node.module}.{alias.name}" for alias in node.names)
            else:
                yield node.module


def calls(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            yield node.func.id


def test_the_files_are_found():
    assert len(KINTRACK) > 40


@pytest.mark.parametrize("path", KINTRACK, ids=name_of)
def test_every_file_has_its_row(path):
    assert unit(path) in LEVEL or unit(path) == "__init__"


@pytest.mark.parametrize("path", KINTRACK, ids=name_of)
def test_a_file_imports_only_from_its_own_package_or_the_rows_above_it(path):
    own = unit(path)
    for module in imports(path):
        parts = module.split(".")
        if parts[0] != "kintrack" or parts[1:] == ["__version__"]:
            continue
        assert parts[1] in LEVEL, f"{module} has no row"
        assert parts[1] == own or LEVEL[parts[1]] <= LEVEL[own], f"{own} imports {module}"
        if parts[1] == "modelling":
            assert own in ("modelling", "commands")


@pytest.mark.parametrize("path", KINTRACK, ids=name_of)
def test_the_tracker_does_not_know_who_makes_or_labels_its_input(path):
    if unit(path) in ("bench", "commands"):
        return
    assert not {module.split(".")[0] for module in imports(path)} & {"synthesis", "segmentation"}


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_nothing_is_unpickled_evaluated_or_fetched(path):
    assert not {module.split(".")[0] for module in imports(path)} & FORBIDDEN_MODULES
    assert not set(calls(path)) & FORBIDDEN_CALLS
    assert "allow_pickle=True" not in path.read_text()


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_heavy_packages_stay_where_they_are_needed(path):
    tops = {module.split(".")[0] for module in imports(path)}
    assert not tops & ONLY_TO_TEST
    allowed = [packages for room, packages in HEAVY.items() if name_of(path).startswith(room)]
    assert tops & ALL_HEAVY <= set().union(*allowed)


@pytest.mark.parametrize(
    "path",
    [*FILES, *sorted((ROOT / "tests").rglob("*.py"))],
    ids=lambda path: str(path.relative_to(ROOT)),
)
def test_every_file_names_its_licence_once(path):
    lines = path.read_text().splitlines()
    tag = "SPDX-License" + "-Identifier:"
    assert sum(tag in line for line in lines) == 1
    assert lines[0] == f"# {tag} Apache-2.0"


@pytest.mark.parametrize("path", KINTRACK, ids=name_of)
def test_only_the_command_line_prints_and_exits(path):
    if unit(path) not in ("cli", "commands"):
        assert not set(calls(path)) & {"print", "exit", "quit", "input"}

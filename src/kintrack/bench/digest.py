# SPDX-License-Identifier: Apache-2.0
"""What decides a fitted pose: digests that tell whether a kept result is still valid."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import segmentation
from kintrack.rig import model_folder

NOT_TRACKING = (
    "bench",
    "cli",
    "commands",
    "demo",
    "evaluation",
    "export",
    "labelling",
    "metrics",
    "modelling",
    "strip",
    "viewer",
)
"""Modules that no fitted pose depends on."""
LABELLING = (
    "architecture",
    "evaluate",
    "graph",
    "labels",
    "networks",
    "preprocess",
    "region",
    "relief",
    "runtime",
    "tracking",
)
"""Modules of `segmentation` that decide the labels a network of given weights gives."""
REGRESSING = ("rgb", "rgb_worker")
"""Modules beside this one that decide what comes of colour."""


def code_digest() -> str:
    """SHA-256 over code and model that decide the poses; layout and comments do not count."""
    package = Path(__file__).parents[1]
    paths = [
        path
        for path in sorted(package.rglob("*.py"))
        if path.relative_to(package).parts[0].removesuffix(".py") not in NOT_TRACKING
    ]
    digest = hashlib.sha256(_trees(paths))
    model = model_folder()
    for path in [model / "human.urdf", *sorted(model.rglob("*.npz"))]:
        digest.update(path.read_bytes())
    return digest.hexdigest()


def result_digest(
    is_rgb: bool, weights: Path | None, how: Sequence[bool], recordings: Sequence[str]
) -> str:
    """SHA-256 over all that decides one result of the accuracy bench.

    Args:
        is_rgb: Whether it comes from colour and no body is fitted.
        weights: Of the network, if there is one.
        how: Switches of the method.
        recordings: Fingerprints of the recordings that go in.
    """
    code = _regressing_code() if is_rgb else _tracking_code()
    facts = (code, _content(weights), *how, *recordings)
    return hashlib.sha256(repr(facts).encode()).hexdigest()


@cache
def _tracking_code() -> str:
    folder = Path(segmentation.__file__).parent
    labelling = _trees(folder / f"{name}.py" for name in LABELLING)
    return hashlib.sha256(code_digest().encode() + labelling).hexdigest()


@cache
def _regressing_code() -> str:
    folder = Path(__file__).parent
    return hashlib.sha256(_trees(folder / f"{name}.py" for name in REGRESSING)).hexdigest()


@cache
def _content(path: Path | None) -> str:
    return "" if path is None else hashlib.sha256(path.read_bytes()).hexdigest()


def _trees(paths: Iterable[Path]) -> bytes:
    return b"".join(code_of(path) for path in paths)


def code_of(path: Path) -> bytes:
    """What a Python file does: its syntax tree without layout, comments and docstrings."""
    tree = ast.parse(path.read_bytes())
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [line for line in node.body if not _is_text(line)]
    return ast.dump(tree).encode()


def _is_text(line: ast.stmt) -> bool:
    """Whether a statement is a string alone, as docstrings are."""
    value = line.value if isinstance(line, ast.Expr) else None
    return isinstance(value, ast.Constant) and isinstance(value.value, str)

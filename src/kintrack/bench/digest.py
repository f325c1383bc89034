# SPDX-License-Identifier: Apache-2.0
"""What decides a fitted pose: a digest that tells whether a kept result is still valid."""

from __future__ import annotations

import ast
import hashlib
from pathlib import Path

from kintrack.body import model_folder

NOT_TRACKING = (
    "bench",
    "cli",
    "commands",
    "demo",
    "evaluate",
    "export",
    "labelling",
    "metrics",
    "modelling",
    "strip",
    "viewer",
)
"""Modules that no fitted pose depends on."""


def code_digest() -> str:
    """SHA-256 over code and model that decide the poses; layout and comments do not count."""
    package = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        if path.relative_to(package).parts[0].removesuffix(".py") not in NOT_TRACKING:
            digest.update(ast.dump(ast.parse(path.read_bytes())).encode())
    model = model_folder()
    for path in [model / "human.urdf", *sorted((model / "skin").glob("*.npz"))]:
        digest.update(path.read_bytes())
    return digest.hexdigest()

# SPDX-License-Identifier: Apache-2.0
"""Packages that only the data engine needs, and what to say where one is missing."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from kintrack.errors import SceneError


def needed(module: str) -> ModuleType:
    """A module of the extra `synthesis`.

    Raises:
        SceneError: if it is not installed; the message says how to.
    """
    try:
        return import_module(module)
    except ImportError as error:
        raise SceneError(
            f"{module} is needed to make or change recordings: pip install 'kintrack[synthesis]'"
        ) from error

# SPDX-License-Identifier: Apache-2.0
"""What a number of a configuration may be."""

from __future__ import annotations

import math
from dataclasses import fields

from kintrack.errors import ConfigError


def check_bounds(config, **bounds: tuple[float, float]) -> None:
    """Pass if every named field of a config dataclass lies within its bounds.

    Raises:
        ConfigError: if one does not, or is no whole number where the field is an int.
    """
    whole = {f.name for f in fields(config) if f.type in (int, "int")}
    for name, (low, high) in bounds.items():
        value = getattr(config, name)
        right_kind = name not in whole or isinstance(value, int)
        if not (right_kind and math.isfinite(value) and low <= value <= high):
            kind = ", whole numbers only" if name in whole else ""
            raise ConfigError(
                f"{type(config).__name__}.{name} = {value!r}: {low:g} to {high:g} are allowed{kind}"
            )

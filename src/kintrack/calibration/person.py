# SPDX-License-Identifier: Apache-2.0
"""`person.json`: who the person is, how sure that is, and the body that follows from it."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.measures import LIMBS, Length
from kintrack.clothing import REGIONS, THICKEST_M, USUAL_M, dressed_human
from kintrack.files import write_json
from kintrack.human import Human
from kintrack.shape import load_shape_space

FORMAT = "kintrack person 1"


@dataclass(frozen=True)
class Person:
    """A calibrated person, or the template with the reasons why it is one."""

    shape: Float[ndarray, " k"]
    """Shape coefficients [standard deviations of adults]; zeros for the template."""
    covariance: Float[ndarray, "k k"]
    """Their covariance."""
    clothing_m: dict[str, float]
    """Thickness of what is worn per region [m]."""
    height: Length
    """Sole to crown, bare, as estimated."""
    limbs: dict[str, Length]
    """Joint centre to joint centre, as estimated."""
    frames: tuple[int, ...]
    """Frames of the recording that were used."""
    spread_m: float
    """How much the poses in them differ [m]."""
    rms_m: float
    """Root mean square distance between the dressed skin and what was observed [m]."""
    stated_height_m: float | None = None
    """Height that somebody stated [m]."""
    problems: tuple[str, ...] = ()
    """Why the template is used instead of what was estimated; empty if it is not."""

    @property
    def is_template(self) -> bool:
        """True if the estimate is not to be used."""
        return bool(self.problems)

    def describe(self) -> str:
        """What was estimated and how sure, in one line."""
        limbs = ", ".join(
            f"{name.replace('_', ' ')} {100 * x.value_m:.1f} ± {100 * x.sigma_m:.1f} cm"
            for name, x in self.limbs.items()
        )
        return (
            f"height {self.height.value_m:.3f} ± {self.height.sigma_m:.3f} m, {limbs}; "
            f"{len(self.frames)} frames that differ by {100 * self.spread_m:.0f} cm, "
            f"surface within {1e3 * self.rms_m:.0f} mm"
        )


def human_of(person: Person, folder: Path | None = None, dressed: bool = True) -> Human:
    """The person's body and tracking skin.

    Args:
        person: Who.
        folder: Model folder; the one that ships if None.
        dressed: Whether the skin lies where the clothes are, as tracking needs, or on the body.

    Returns:
        The human.

    Raises:
        ModelError: if a model file is broken or does not have that many coefficients.
    """
    known = USUAL_M if person.is_template else person.clothing_m
    return dressed_human(person.shape, known if dressed else {}, folder)


def write_person(person: Person, path: Path) -> None:
    """Write `person.json` in one step.

    Raises:
        ResultError: if the file cannot be written.
    """
    write_json(path, {"format": FORMAT, **asdict(person)})


def read_person(path: Path) -> Person:
    """Read `person.json`.

    Raises:
        CalibrationError: if it is missing, broken or out of bounds; the message names the field.
    """
    try:
        content: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8"))
        if content.get("format") != FORMAT:
            raise ValueError(f"format is {content.get('format')!r}, {FORMAT!r} is needed")
        shape = _numbers(content, "shape", 1)
        covariance = _numbers(content, "covariance", 2)
        available = len(load_shape_space())
        if len(shape) != available:
            raise ValueError(f"shape has {len(shape)} coefficients, {available} are needed")
        if np.abs(shape).max() > 5.0:
            raise ValueError("shape: coefficients of -5 to 5 are allowed")
        if covariance.shape != (len(shape), len(shape)):
            raise ValueError(f"covariance is {covariance.shape}, not square for {len(shape)}")
        worn = {region.name: float(content["clothing_m"][region.name]) for region in REGIONS}
        if not all(0.0 <= thickness <= THICKEST_M for thickness in worn.values()):
            raise ValueError(f"clothing_m: 0 to {THICKEST_M} m are allowed")
        stated = content.get("stated_height_m")
        return Person(
            shape=shape,
            covariance=covariance,
            clothing_m=worn,
            height=_length(content["height"]),
            limbs={name: _length(content["limbs"][name]) for name in LIMBS},
            frames=tuple(int(n) for n in content["frames"]),
            spread_m=float(content["spread_m"]),
            rms_m=float("nan") if content["rms_m"] is None else float(content["rms_m"]),
            stated_height_m=None if stated is None else float(stated),
            problems=tuple(str(problem) for problem in content["problems"]),
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise CalibrationError(f"{path}: no person that can be read ({error!r})") from error


def _numbers(content: dict[str, Any], name: str, ndim: int) -> ndarray:
    values = np.array(content[name], dtype=float)
    if values.ndim != ndim or not np.isfinite(values).all():
        raise ValueError(f"{name}: finite numbers in {ndim} dimensions are needed")
    return values


def _length(pair: Any) -> Length:
    value, sigma = (float(x) for x in pair)
    if not (math.isfinite(value) and value > 0.0 and sigma >= 0.0):
        raise ValueError(f"length {pair!r}: a positive value and its standard deviation are needed")
    return Length(value, sigma)

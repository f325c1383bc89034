# SPDX-License-Identifier: Apache-2.0
"""The files of the human's model, and from them where a person's links are in bind pose."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.errors import ModelError


def model_folder() -> Path:
    """The `model/` folder that ships: inside the installed package, or at the project's top."""
    inside = Path(__file__).parent / "model"
    return inside if inside.is_dir() else Path(__file__).parents[2] / "model"


def read_arrays(path: Path, *needed: str) -> dict[str, ndarray]:
    """The arrays of one file of the model.

    Args:
        path: File (npz).
        needed: Names of the arrays that must be there.

    Returns:
        The needed arrays by name.

    Raises:
        ModelError: if the file is missing or broken, or lacks an array.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            missing = sorted(set(needed) - set(file.files))
            if missing:
                raise ModelError(f"{path}: lacks the arrays {', '.join(missing)}")
            return {name: file[name] for name in needed}
    except (OSError, ValueError, EOFError, BadZipFile) as error:
        raise ModelError(f"{path}: cannot be read as part of the model ({error})") from error


@dataclass(frozen=True)
class Rig:
    """Link frames in bind pose, the pose the skins are given in; root frame."""

    link_names: tuple[str, ...]
    """Links that carry skin, parents before children."""
    Ts_root_link: Float[ndarray, "l 4 4"]
    """Bind pose of the links, for the given shape."""
    extra_offsets: dict[str, Float[ndarray, 3]]
    """Change of the fixed frames that are no link's origin, root axes [m]."""
    explained: Float[ndarray, " k"]
    """Share of the population's variance that each shape coefficient explains."""


def load_rig(folder: Path, shape: Float[ndarray, " k"] | None = None) -> Rig:
    """Bind frames of a person.

    Args:
        folder: Model folder.
        shape: Shape coefficients [standard deviations of the population]; the average if None.

    Returns:
        The rig; shape moves the frames and never turns them.

    Raises:
        ModelError: if a file is broken or there are more coefficients than the model has.
    """
    arrays = read_arrays(
        folder / "skin" / "rig.npz",
        "link_names",
        "Ts_root_link_bind",
        "origins_basis_m",
        "extra_names",
        "extra_basis_m",
        "explained_variance",
    )
    Ts = arrays["Ts_root_link_bind"].copy()
    origins, extra = arrays["origins_basis_m"], arrays["extra_basis_m"]
    b = shape_coefficients(shape, len(origins))
    Ts[:, :3, 3] += np.tensordot(b, origins[: len(b)], 1)
    names = (str(name) for name in arrays["extra_names"])
    offsets = dict(zip(names, np.tensordot(b, extra[: len(b)], 1), strict=True))
    return Rig(
        tuple(str(name) for name in arrays["link_names"]), Ts, offsets, arrays["explained_variance"]
    )


def shape_coefficients(shape: Float[ndarray, " k"] | None, available: int) -> ndarray:
    """Checked shape coefficients, shape (k,), k <= available."""
    b = np.zeros(0) if shape is None else np.asarray(shape, dtype=float)
    if b.ndim != 1 or len(b) > available or not np.isfinite(b).all():
        raise ModelError(f"shape = {shape!r}: up to {available} finite coefficients are allowed")
    return b

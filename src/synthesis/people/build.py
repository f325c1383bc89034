# SPDX-License-Identifier: Apache-2.0
"""Draws the people once and writes `population.npz`; needs the extra `model`.

python -m synthesis.people.build [OUT] --people 500 --seed 1
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from jaxtyping import Float, Int
from numpy import ndarray
from threadpoolctl import threadpool_limits

from kintrack.errors import ModelError
from kintrack.modelling.build import head_centre
from kintrack.modelling.skeleton import links
from kintrack.modelling.source import R_ROOT_SOURCE, dense_weights, joint_points
from kintrack.modelling.surface import transfer
from kintrack.rig import model_folder, read_arrays
from synthesis.people.hands import HANDS, curled
from synthesis.people.population import FILE, SIDES

AGES_YEARS = (18.0, 75.0)
"""Youngest and oldest [years], drawn uniformly."""
GENDERS = ((0.0, 0.25), (0.75, 1.0))
"""Ranges of the source's gender that are drawn as men and as women, equally often."""
BMI = (16.5, 42.0)
"""Bodies outside this range are drawn again [kg/m2]; the source also gives some below 14."""
HEIGHTS_M = (1.45, 1.98)
"""Bodies outside this range are drawn again [m]."""
DENSITY = 980.0
"""Mass over volume that the source's authors assume [kg/m3]."""
CURVE = 2.0
"""Ancestries are drawn as powers of uniform shares, so that few people are even mixtures."""
HAND_COMPONENTS = 8
"""Leading components with which a posed hand grows."""
BATCH = 100


@dataclass(frozen=True)
class Draw:
    """People as the source gives them, root frame."""

    vertices: Float[ndarray, "n v 3"]
    """Bind pose [m]."""
    heads: Float[ndarray, "n b 3"]
    """Where the bones start [m]."""
    ages_years: Float[ndarray, " n"]
    """Age [years]."""
    phenotypes: dict[str, Float[ndarray, " n"]]
    """What the source was given, by its own names, 0..1."""
    faces: Int[ndarray, "f 3"]
    """Triangles."""
    bones: list[str]
    """Names of the bones."""
    weights: Float[ndarray, "v b"]
    """Skinning weights over the bones, rows sum to 1."""


def draw(people: int, seed: int) -> Draw:
    """Draw adults from the source, all of its phenotypes varied.

    Args:
        people: How many.
        seed: Seed of the draw.

    Raises:
        ModelError: if the extra `model` is not installed.
    """
    try:
        import anny
        import torch
        from anny.shape_distribution import SimpleShapeDistribution
    except ImportError as error:
        raise ModelError(f"{error.name!r} is missing: pip install 'kintrack[model]'") from error
    model = anny.Anny(phenotypes="all")
    generator = np.random.default_rng(seed)
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    low, high = torch.tensor(GENDERS, dtype=torch.float64).T
    kinds = torch.distributions.Categorical(torch.ones(len(GENDERS), dtype=torch.float64))
    bodies = SimpleShapeDistribution(
        model,
        torch.distributions.Uniform(*torch.tensor(AGES_YEARS, dtype=torch.float64)),
        torch.distributions.MixtureSameFamily(kinds, torch.distributions.Uniform(low, high)),
    )
    parts: list[tuple[ndarray, ndarray, ndarray, dict[str, ndarray]]] = []
    while sum(len(part[0]) for part in parts) < people:
        ages, phenotype = bodies.sample(BATCH)
        for name in ("african", "asian", "caucasian"):
            phenotype[name] = phenotype[name] ** CURVE
        for name in ("cupsize", "firmness"):
            phenotype[name] = torch.from_numpy(generator.beta(2.0, 2.0, BATCH))
        body = model(phenotype_kwargs=phenotype)
        vertices = body["rest_vertices"].numpy() @ R_ROOT_SOURCE.T
        height = heights_m(vertices)
        bmi = masses_kg(vertices, model.faces.numpy()) / height**2
        kept = (bmi > BMI[0]) & (bmi < BMI[1]) & (height > HEIGHTS_M[0]) & (height < HEIGHTS_M[1])
        heads = body["rest_bone_heads"].numpy() @ R_ROOT_SOURCE.T
        drawn = {name: values.numpy()[kept] for name, values in phenotype.items()}
        parts.append((vertices[kept], heads[kept], ages.numpy()[kept], drawn))
    vertices, heads, years = (np.concatenate([p[i] for p in parts])[:people] for i in range(3))
    bones = list(model.bone_labels)
    origins = joint_points(heads, bones, links())["pelvis"][:, None].copy()
    return Draw(
        vertices - origins,
        heads - origins,
        years,
        {name: np.concatenate([p[3][name] for p in parts])[:people] for name in parts[0][3]},
        model.faces.numpy(),
        bones,
        dense_weights(model),
    )


def heights_m(vertices: Float[ndarray, "n v 3"]) -> Float[ndarray, " n"]:
    """Sole to crown of bodies that stand upright [m]."""
    return np.ptp(vertices[..., 2], axis=1)


def masses_kg(vertices: Float[ndarray, "n v 3"], faces: Int[ndarray, "f 3"]) -> ndarray:
    """Enclosed volume times `DENSITY`, shape (N,) [kg]."""
    a, b, c = (vertices[:, faces[:, i]] for i in range(3))
    return DENSITY * np.einsum("nfi,nfi->n", np.cross(a, b), c) / 6.0


def places(people: Draw) -> dict[str, Float[ndarray, "n 3"]]:
    """Link origins and the other reported places, by the definitions of `kintrack.modelling`.

    Args:
        people: The draw.

    Raises:
        ModelError: if the source's surface is not the one that the model was built from.
    """
    folder = model_folder() / "skin"
    display = read_arrays(folder / "display.npz", "vertices_m", "faces")
    if not np.array_equal(display["faces"], people.faces):
        raise ModelError(f"{folder / 'display.npz'}: not the surface that anny gives; rebuild it")
    tracking = read_arrays(
        folder / "tracking.npz", "vertices_m", "faces", "weight_links", "weights"
    )
    vertices = tracking["vertices_m"].astype(float)
    weights = np.zeros((len(vertices), len(links())))
    np.put_along_axis(weights, tracking["weight_links"].astype(int), tracking["weights"], axis=1)
    centre = head_centre(vertices, tracking["faces"], weights)
    used = np.flatnonzero(centre)
    corners, shares = transfer(
        display["vertices_m"].astype(float), display["faces"], vertices[used]
    )
    points = joint_points(people.heads, people.bones, links())
    points["head_center"] = np.einsum(
        "t,tc,ntcd->nd", centre[used], shares, people.vertices[:, corners]
    )
    return points


def build_population(path: Path, people: int, seed: int, components: int, progress=print) -> None:
    """Draw people and write them as a mean, components and coefficients.

    Args:
        path: File to write (npz).
        people: How many, at least 10.
        seed: Seed of the draw.
        components: How many components are kept, fewer than people.
        progress: Called with one line per step.

    Raises:
        ModelError: if the extra `model` is missing or the numbers do not allow it.
    """
    if not (10 <= people and HAND_COMPONENTS <= components < people):
        raise ModelError(
            f"people = {people}, components = {components}: at least 10 people and "
            f"{HAND_COMPONENTS} <= components < people are allowed"
        )
    with threadpool_limits(1):  # sums of several threads differ in their last bits
        arrays = _arrays(people, seed, components, progress)
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **arrays)
    progress(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


def _arrays(people: int, seed: int, components: int, progress) -> dict[str, Any]:
    """What the file holds, by name."""
    progress(f"drawing {people} adults")
    drawn = draw(people, seed)
    points = places(drawn)
    whole = np.concatenate([drawn.vertices, np.stack(list(points.values()), axis=1)], axis=1)
    mean = whole.mean(axis=0).astype(np.float32)
    flat = (whole - mean).reshape(people, -1)
    _, _, axes = np.linalg.svd(flat, full_matrices=False)
    axes = axes[:components]
    axes *= np.sign(axes[np.arange(components), np.abs(axes).argmax(axis=1)])[:, None]
    basis = (axes / np.abs(axes).max(axis=1, keepdims=True)).astype(np.float16)
    kept = basis.astype(float)
    coefficients = np.linalg.lstsq(kept.T, flat.T, rcond=None)[0].T.astype(np.float32)
    error = np.linalg.norm((coefficients @ kept - flat).reshape(people, -1, 3), axis=2)
    progress(
        f"{components} components: RMS {1e3 * np.sqrt(np.mean(error**2)):.2f} mm, worst person "
        f"{1e3 * np.sqrt((error**2).mean(axis=1)).max():.2f} mm, worst point "
        f"{1e3 * error.max():.2f} mm"
    )
    return {
        "mean_m": mean,
        "basis": basis.reshape(components, -1, 3),
        "coefficients_m": coefficients,
        "point_names": np.array(list(points)),
        "woman": drawn.phenotypes["gender"] > 0.5,
        "ages_years": drawn.ages_years.astype(np.float32),
        "heights_m": heights_m(drawn.vertices).astype(np.float32),
        "masses_kg": masses_kg(drawn.vertices, drawn.faces).astype(np.float32),
        "phenotype_names": np.array(list(drawn.phenotypes)),
        "phenotypes": np.stack(list(drawn.phenotypes.values()), axis=1).astype(np.float32),
        **_hands(drawn, coefficients, progress),
    }


def _hands(drawn: Draw, coefficients: Float[ndarray, "n k"], progress) -> dict[str, ndarray]:
    """What each posed hand adds to the vertices, as a linear function of the coefficients."""
    given = np.column_stack([np.ones(len(coefficients)), coefficients[:, :HAND_COMPONENTS]])
    arrays = {}
    for side in SIDES:
        of_hand = [
            i
            for i, bone in enumerate(drawn.bones)
            if bone.startswith("finger") and bone.endswith(side.upper())
        ]
        vertex = np.flatnonzero(drawn.weights[:, of_hand].sum(axis=1) > 1e-4)
        rest, weights = drawn.vertices[:, vertex], drawn.weights[vertex]
        arrays[f"hand_{side}_vertices"] = vertex.astype(np.int32)
        for name, pose in HANDS.items():
            moved = curled(rest, drawn.heads, weights, drawn.bones, side, pose) - rest
            flat = moved.reshape(len(moved), -1)
            basis = np.linalg.lstsq(given, flat, rcond=None)[0].astype(np.float16)
            arrays[f"hand_{side}_{name}_basis"] = basis.reshape(-1, len(vertex), 3)
            error = np.linalg.norm((given @ basis - flat).reshape(moved.shape), axis=2)
            progress(
                f"{side} hand {name}: {len(vertex)} vertices, RMS "
                f"{1e3 * np.sqrt(np.mean(error**2)):.2f} mm, worst {1e3 * error.max():.2f} mm"
            )
    return arrays


def main(
    out: tyro.conf.Positional[Path] = FILE, people: int = 500, seed: int = 1, components: int = 48
) -> None:
    """Draw the people and write them.

    Args:
        out: File to write.
        people: How many.
        seed: Seed of the draw.
        components: How many components are kept.
    """
    build_population(out, people, seed, components)


if __name__ == "__main__":
    tyro.cli(main)

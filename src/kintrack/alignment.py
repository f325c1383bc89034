# SPDX-License-Identifier: Apache-2.0
"""Associate, solve, repeat: one pose fitted to one observation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.association.observation import Observation
from kintrack.association.silhouette import outside_pairs
from kintrack.association.visibility import visible_vertices
from kintrack.association.window import associate
from kintrack.body import BodyState, run_kinematics
from kintrack.config import TrackerConfig
from kintrack.geometry import invert_rigid, transform_points
from kintrack.human import Human
from kintrack.residuals.contact import Contact, contact_residual
from kintrack.residuals.linearization import Residual
from kintrack.residuals.surface import SurfaceResidual, silhouette_residual, surface_residual
from kintrack.skin import skinned_vertices, vertex_normals
from kintrack.solver.choice import SOLVERS


@dataclass(frozen=True)
class View:
    """The skin as the camera would see it."""

    vertices_camera: Float[ndarray, "v 3"]
    """Vertices, camera frame [m]."""
    normals_camera: Float[ndarray, "v 3"]
    """Outward unit normals, camera frame."""
    visible: Bool[ndarray, " v"]
    """Vertices the camera would see if nothing else were there."""
    labels: UInt8[ndarray, " v"]
    """Body part of every vertex."""


@dataclass(frozen=True)
class Fit:
    """A pose and the data term it was solved with last."""

    state: BodyState
    """Body at the solution."""
    surface: SurfaceResidual
    """Pairs of the last round."""
    iterations: int
    """Accepted solver steps, all rounds."""


def view_skin(
    human: Human, state: BodyState, T_camera_world: ndarray, obs: Observation, config: TrackerConfig
) -> View:
    """Skin the state, move it to the camera and find what is visible."""
    vertices = transform_points(T_camera_world, skinned_vertices(state, human.skin))
    normals = vertex_normals(vertices, human.skin.faces)
    a = config.association
    visible = visible_vertices(
        vertices, normals, human.skin.faces, obs.camera, a.facing, a.self_occlusion_m
    )
    return View(vertices, normals, visible, human.skin.labels)


def fit_pose(
    human: Human,
    observation: Observation,
    q: Float[ndarray, " nq"],
    priors: Sequence[Residual],
    T_world_camera: Float[ndarray, "4 4"],
    config: TrackerConfig,
    gates_m: Sequence[float],
    clock: Callable[[str], None] = lambda stage: None,
    view: View | None = None,
    contact: Contact | None = None,
) -> Fit:
    """Fit a pose: one association per gate, a few Gauss-Newton steps each.

    Args:
        human: Body and skin.
        observation: What the camera saw.
        q: First guess, within limits.
        priors: Terms besides the surface.
        T_world_camera: Camera pose.
        config: All weights.
        gates_m: Largest pair distance of each round [m].
        clock: Called after each stage with its name.
        view: The skin at q, if the caller has it.
        contact: Soles that stand on the floor; None for none.

    Returns:
        The fit; once no joint moves, only the last gate is still tried.

    Raises:
        AssociationError: if nothing observed lies within a round's gate.
    """
    T_camera_world = invert_rigid(T_world_camera)
    R = T_world_camera[:3, :3]
    state, damping, iterations, surface = (
        run_kinematics(human.body, q),
        config.solver.damping,
        0,
        None,
    )
    remaining = list(gates_m)
    while remaining:
        gate_m = remaining.pop(0)
        if view is None:
            view = view_skin(human, state, T_camera_world, observation, config)
        clock("skin")
        pairs = associate(
            observation,
            view.vertices_camera,
            view.visible,
            config.association.gate_m,
            gate_m,
            config.association.pixel_pairs,
            view.labels,
            config.association.part_m,
        )
        beside = outside_pairs(
            observation,
            view.vertices_camera,
            view.visible,
            config.association.silhouette_tolerance_m,
            config.association.silhouette_gate_m,
            config.occlusion.behind_m,
        )
        clock("associate")
        vertices_world = transform_points(T_world_camera, view.vertices_camera)
        surface = surface_residual(
            human.skin,
            pairs.vertex,
            transform_points(T_world_camera, pairs.points_camera),
            vertices_world,
            view.normals_camera @ R.T,
            config.surface,
            gate_m / 8 if gate_m > config.association.last_gate_m else 0.0,
        )
        outside = silhouette_residual(
            human.skin,
            beside.vertex,
            transform_points(T_world_camera, beside.points_camera),
            vertices_world,
            config.surface,
        )
        data = surface.joined(outside)
        if contact is not None:
            data = data.joined(
                contact_residual(human.skin, contact, vertices_world, config.contact)
            )
        view = None
        before = state.joint_positions_world
        solution = SOLVERS[config.solver.method](
            human.body, state, [data, *priors], config.solver.steps, damping
        )
        state, damping = solution.state, solution.damping
        iterations += solution.steps
        clock("solve")
        moved = np.linalg.norm(state.joint_positions_world - before, axis=1).max()
        if moved < config.solver.tolerance_m:
            remaining = remaining[-1:]
    assert surface is not None
    return Fit(state, surface, iterations)

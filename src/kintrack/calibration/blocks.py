# SPDX-License-Identifier: Apache-2.0
"""One frame of a calibration: pairs, weights, and the blocks of its Gauss-Newton matrix."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numba import njit
from numpy import ndarray

from kintrack.alignment import view_skin
from kintrack.association.observation import Observation
from kintrack.association.silhouette import outside_pairs
from kintrack.association.window import associate
from kintrack.body import BodyState, run_kinematics
from kintrack.calibration.config import BundleConfig
from kintrack.config import TrackerConfig
from kintrack.geometry import invert_rigid, transform_points, tukey_weights
from kintrack.human import Human
from kintrack.residuals.contact import Contact, contact_residual
from kintrack.residuals.prior import TangentPrior
from kintrack.residuals.surface import SurfaceResidual, silhouette_residual, surface_residual
from kintrack.shape import ShapeSpace, vertex_shape_jacobians
from kintrack.skin import skinned_vertices, vertex_jacobians


@dataclass(frozen=True)
class Snapshot:
    """A frame and a pose in it that is roughly right."""

    observation: Observation
    """What was observed, its region the person."""
    q: Float[ndarray, " nq"]
    """Pose."""
    T_world_camera: Float[ndarray, "4 4"]
    """Camera pose."""
    contact: Contact | None = None
    """The floor and both soles, one of which stands on it; None where no floor is known."""


@dataclass(frozen=True)
class Blocks:
    """Blocks of one frame: poses, shape, and both."""

    H_pose: Float[ndarray, "nv nv"]
    """Poses, pose prior and damping included."""
    g_pose: Float[ndarray, " nv"]
    """Gradient of the pose."""
    H_cross: Float[ndarray, "nv p"]
    """Poses against shape."""
    H_shape: Float[ndarray, "p p"]
    """Shape, no prior."""
    g_shape: Float[ndarray, " p"]
    """Gradient of the shape."""
    rms_m: float
    """Root mean square of the inliers' point-to-plane residuals [m]."""
    inliers: int
    """Pairs with a robust weight above one half."""


def blocks_of(
    space: ShapeSpace,
    human: Human,
    q: ndarray,
    snapshot: Snapshot,
    rest: TangentPrior,
    fold_m: ndarray,
    gate_m: float,
    tracker: TrackerConfig,
    config: BundleConfig,
) -> Blocks:
    """Associate one frame and linearise it.

    Args:
        space: Bodies, clothes included.
        human: The person as she is thought to be.
        q: Her pose in the frame.
        snapshot: The frame.
        rest: Pose prior; weighed against the pairs as while tracking.
        fold_m: Spread of the seen surface about each vertex [m].
        gate_m: Largest distance between a point and its vertex [m].
        tracker: Association.
        config: Weights.

    Raises:
        AssociationError: if nothing observed lies near the skin.
    """
    state = run_kinematics(human.body, q)
    surface = surface_of(human, state, snapshot, fold_m, gate_m, tracker, config)
    J = (
        vertex_jacobians(state, human.skin, surface.vertex),
        vertex_shape_jacobians(state, space, surface.vertex),
    )
    d = skinned_vertices(state, human.skin)[surface.vertex] - surface.points_world
    rows, r = _rooted(surface.roots, surface.weights, *J, d)
    H, g = rows.T @ rows, r @ rows
    nv = human.body.nv
    prior = rest.quadratic(state)
    share = tracker.surface.correlation / config.correlation
    H_pose = H[:nv, :nv] + share * prior.H
    H_pose += np.diag(config.damping * np.diag(H_pose) + 1e-9)
    return Blocks(
        H_pose,
        g[:nv] + share * prior.g,
        H[:nv, nv:],
        H[nv:, nv:],
        g[nv:],
        surface.rms_m,
        surface.inliers,
    )


def surface_of(
    human: Human,
    state: BodyState,
    snapshot: Snapshot,
    fold_m: ndarray,
    gate_m: float,
    tracker: TrackerConfig,
    config: BundleConfig,
) -> SurfaceResidual:
    """Pairs of a frame with asymmetric robust weights by the folds of each vertex.

    Args are those of `blocks_of`, with the pose run through the kinematics.
    """
    observation, T_world_camera = snapshot.observation, snapshot.T_world_camera
    view = view_skin(human, state, invert_rigid(T_world_camera), observation, tracker)
    a = tracker.association
    pairs = associate(
        observation,
        view.vertices_camera,
        view.visible,
        a.gate_m,
        gate_m,
        config.pixel_pairs,
        human.skin.labels,
        a.part_m,
    )
    vertices = transform_points(T_world_camera, view.vertices_camera)
    normals = view.normals_camera @ T_world_camera[:3, :3].T
    points = transform_points(T_world_camera, pairs.points_camera)
    surface = surface_residual(
        human.skin,
        pairs.vertex,
        points,
        vertices,
        normals,
        replace(tracker.surface, point_weight=config.point_weight),
    )
    plane = np.einsum("ij,ij->i", normals[pairs.vertex], vertices[pairs.vertex] - points)
    sigma = np.hypot(fold_m[pairs.vertex], config.noise_m)
    if gate_m > config.last_gate_m:
        sigma = np.maximum(sigma, gate_m / 8)
    robust = tukey_weights(plane / np.where(plane < 0.0, config.outside * sigma, sigma), 1.0)
    inlier = robust > 0.5
    beside = outside_pairs(
        observation,
        view.vertices_camera,
        view.visible,
        a.silhouette_tolerance_m,
        a.silhouette_gate_m,
        tracker.occlusion.behind_m,
    )
    outline = silhouette_residual(
        human.skin,
        beside.vertex,
        transform_points(T_world_camera, beside.points_camera),
        vertices,
        replace(
            tracker.surface,
            correlation=config.correlation,
            silhouette_weight=config.silhouette_weight,
        ),
    )
    surface = replace(
        surface,
        weights=robust / (config.correlation * sigma**2),
        inliers=int(inlier.sum()),
        rms_m=float(np.sqrt(np.mean(plane[inlier] ** 2))) if inlier.any() else float("nan"),
    ).joined(outline)
    if snapshot.contact is None:
        return surface
    lower = snapshot.contact.lower(vertices)
    return surface.joined(contact_residual(human.skin, lower, vertices, config.contact))


@njit(cache=True, nogil=True)
def _rooted(roots, weights, J_pose, J_shape, offsets):
    """Rows sqrt(w_i) A_i [J_pose, J_shape] of all pairs, and sqrt(w_i) A_i d_i."""
    n, m, k = J_pose.shape[0], J_pose.shape[2], J_shape.shape[2]
    rows, r = np.empty((3 * n, m + k)), np.empty(3 * n)
    for i in range(n):
        root = np.sqrt(weights[i])
        for a in range(3):
            x, y, z = root * roots[i, a, 0], root * roots[i, a, 1], root * roots[i, a, 2]
            row = rows[3 * i + a]
            for c in range(m):
                row[c] = x * J_pose[i, 0, c] + y * J_pose[i, 1, c] + z * J_pose[i, 2, c]
            for c in range(k):
                row[m + c] = x * J_shape[i, 0, c] + y * J_shape[i, 1, c] + z * J_shape[i, 2, c]
            r[3 * i + a] = x * offsets[i, 0] + y * offsets[i, 1] + z * offsets[i, 2]
    return rows, r

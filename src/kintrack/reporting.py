# SPDX-License-Identifier: Apache-2.0
"""What the tracker hands out for a frame."""

from __future__ import annotations

import time

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.alignment import Fit, View
from kintrack.association.observation import Observation
from kintrack.body import Body, BodyState
from kintrack.confidence import joint_covariances
from kintrack.config import ConfidenceConfig
from kintrack.geometry import transform_points
from kintrack.joints import JOINT_NAMES
from kintrack.judge import Agreement, joint_visibility, label_agreement, label_counts
from kintrack.lifecycle import Reading
from kintrack.result import FrameResult
from kintrack.sequence.frame import Frame


def empty_result(
    frame: Frame, body: Body, status: str, began_s: float, reason: str | None = None
) -> FrameResult:
    """A result without a pose.

    Args:
        frame: The frame.
        body: The body whose pose is not known.
        status: One of `kintrack.result.STATUSES`.
        began_s: `time.perf_counter()` when the frame came.
        reason: Why there is none.
    """
    n = len(JOINT_NAMES)
    return FrameResult(
        timestamp_s=frame.timestamp_s,
        status=status,
        q=np.full(body.nq, np.nan),
        joint_positions_camera_m=np.full((n, 3), np.nan),
        joint_covariances_m2=np.full((n, 3, 3), np.nan),
        joint_visible=np.zeros(n),
        residual_rms_m=float("nan"),
        inliers=0,
        milliseconds=1e3 * (time.perf_counter() - began_s),
        reason=reason,
    )


def fitted_result(
    frame: Frame,
    status: str,
    fit: Fit,
    view: View,
    supported: Bool[ndarray, " v"],
    covariance: Float[ndarray, "nv nv"],
    T_camera_world: Float[ndarray, "4 4"],
    config: ConfidenceConfig,
    began_s: float,
) -> FrameResult:
    """The result of a frame with a fit.

    Args:
        frame: The frame.
        status: One of `kintrack.result.STATUSES`.
        fit: The fit.
        view: Its skin as the camera sees it.
        supported: Vertices with an observed point near them.
        covariance: Inverse of the solver's matrix at the fit.
        T_camera_world: Inverse of the camera pose.
        config: What the solver's covariance does not know.
        began_s: `time.perf_counter()` when the frame came.
    """
    R = T_camera_world[:3, :3]
    positions = transform_points(T_camera_world, fit.state.joint_positions_world)
    visible = joint_visibility(view, supported, positions)
    covariances = joint_covariances(fit.state, covariance, fit.surface, visible, config)
    return FrameResult(
        timestamp_s=frame.timestamp_s,
        status=status,
        q=fit.state.q,
        joint_positions_camera_m=positions,
        joint_covariances_m2=R @ covariances @ R.T,
        joint_visible=visible,
        residual_rms_m=fit.surface.rms_m,
        inliers=fit.surface.inliers,
        milliseconds=1e3 * (time.perf_counter() - began_s),
        iterations=fit.iterations,
    )


def coasted_result(
    frame: Frame,
    state: BodyState,
    covariance: Float[ndarray, "nv nv"],
    T_camera_world: Float[ndarray, "4 4"],
    config: ConfidenceConfig,
    began_s: float,
) -> FrameResult:
    """The result of a frame that showed nothing of a tracked person; no joint is seen.

    Args:
        frame: The frame.
        state: Predicted pose.
        covariance: Of the prediction, tangent space.
        T_camera_world: Inverse of the camera pose.
        config: What the covariance does not know.
        began_s: `time.perf_counter()` when the frame came.
    """
    nothing = empty_result(frame, state.body, "tracking", began_s)
    R = T_camera_world[:3, :3]
    nothing.q[:] = state.q
    nothing.joint_positions_camera_m[:] = transform_points(
        T_camera_world, state.joint_positions_world
    )
    covariances = joint_covariances(state, covariance, None, nothing.joint_visible, config)
    nothing.joint_covariances_m2[:] = R @ covariances @ R.T
    return nothing


def reading_of(fit: Fit, view: View, agreed: Agreement, observation: Observation) -> Reading:
    """What a fitted frame says about itself."""
    labels = 1.0
    if observation.labels is not None:
        labels = label_agreement(label_counts(view, observation))
    return Reading(fit.surface.rms_m, agreed.explained, agreed.supported, labels, agreed.seen)

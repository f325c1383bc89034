# SPDX-License-Identifier: Apache-2.0
"""The method on one screen: predict, observe, associate and solve, judge, report [Wan19, 4]."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray
from threadpoolctl import ThreadpoolController

from kintrack.alignment import Fit, View, fit_pose, view_skin
from kintrack.association.observation import Observation, observe, within
from kintrack.association.window import associate
from kintrack.begin import begin
from kintrack.body import BodyState, joint_jacobians, run_kinematics
from kintrack.config import TrackerConfig
from kintrack.errors import AssociationError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.human import RESTING_DEG, Human, load_human, motion_sigma, posed, prior_sigma
from kintrack.joints import JOINT_NAMES
from kintrack.judge import acceptable, agreement, joint_visibility
from kintrack.residuals.prior import TangentPrior, diagonal_prior, gaussian_prior
from kintrack.result import FrameResult
from kintrack.sequence.frame import Frame
from kintrack.solver.gauss_newton import normal_equations
from kintrack.start import Start, sized, start

NONE = np.zeros(0, dtype=np.int64)
UNSEEN_SHARE = 0.08
"""A hinge that moves skin of which less than this share is observed counts as not seen."""


@dataclass(frozen=True)
class Belief:
    """Where the body is thought to be between frames."""

    q: Float[ndarray, " nq"]
    """Configuration."""
    velocity: Float[ndarray, " nv"]
    """Tangent velocity [m/s, rad/s]."""
    covariance: Float[ndarray, "nv nv"]
    """Covariance in the tangent space at q."""
    timestamp_s: float
    """When [s]."""
    misses: int = 0
    """Bad frames in a row."""


class Tracker:
    """Follows one person through the frames of one camera."""

    def __init__(
        self,
        config: TrackerConfig | None = None,
        human: Human | None = None,
        T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
        clock: Callable[[str], None] = lambda stage: None,
    ):
        """Set up a tracker that has seen nothing yet.

        Args:
            config: All weights; the defaults if None.
            human: Body and skin; the average adult if None.
            T_world_camera: Camera pose; a level camera if not given.
            clock: Called after each stage with its name, for benchmarks.
        """
        self.config = TrackerConfig() if config is None else config
        self.T_world_camera = T_world_camera
        self.belief: Belief | None = None
        self._failed_s = -np.inf
        self._clock = clock
        self._threads = ThreadpoolController()
        self._meet(load_human() if human is None else human)

    def _meet(self, human: Human) -> None:
        """Take this person's body and what belongs to it."""
        self.human = human
        self._resting = posed(human.body, RESTING_DEG)
        self._prior_sigma = prior_sigma(human.body, self.config.prior)

    def step(self, frame: Frame) -> FrameResult:
        """Fit the body to the next frame.

        Args:
            frame: The next frame in time; one with a problem is skipped.

        Returns:
            Pose, joints, covariances and status.
        """
        with self._threads.limit(limits=1, user_api="blas"):
            return self._step(frame)

    def begin(self, frame: Frame, joints_camera: Float[ndarray, "j 3"]) -> FrameResult:
        """Start from joints that somebody else has found roughly, whatever the fit says of them.

        Args:
            frame: A frame that shows the person.
            joints_camera: Joint centres [m], order of `JOINT_NAMES`, camera frame; NaN for unknown
                ones, but hips and shoulders are needed.

        Returns:
            Pose, joints, covariances and status.

        Raises:
            ConfigError: if a joint that is needed is missing.
        """
        began = time.perf_counter()
        if frame.problem is not None or frame.depth_m is None:
            return self._nothing(frame, "skipped", began, frame.problem or "no depth")
        with self._threads.limit(limits=1, user_api="blas"):
            a = self.config.association
            observation = observe(frame, a.max_width_px, a.background_share)
            try:
                found = begin(
                    self.human, observation, joints_camera, self.T_world_camera, self.config
                )
            except AssociationError:
                return self._nothing(frame, "initialising", began)
            person, sized_start = self._sized(found)
            return self._meet_at(frame, person, sized_start or found, began)

    def _step(self, frame: Frame) -> FrameResult:
        began = time.perf_counter()
        if frame.problem is not None or frame.depth_m is None:
            return self._nothing(frame, "skipped", began, frame.problem or "no depth")
        config, a = self.config, self.config.association
        observation = observe(frame, a.max_width_px, a.background_share)
        if not observation.region.any():
            return self._nothing(frame, "skipped", began, "no depth reading")
        if self.belief is None:
            return self._start(frame, observation, began)
        predicted, covariance = self._predict(self.belief, frame.timestamp_s)
        expected = self._view(run_kinematics(self.human.body, predicted), observation)
        observation = within(observation, self._box(expected))
        self._clock("observe")
        unseen = self._unseen(expected, observation)
        dt_s = max(frame.timestamp_s - self.belief.timestamp_s, 1e-3)
        priors = [gaussian_prior(predicted, covariance), self._pose_prior(unseen, dt_s)]
        gates = np.geomspace(a.first_gate_m, a.last_gate_m, config.solver.rounds).tolist()
        try:
            fit = fit_pose(
                self.human,
                observation,
                predicted,
                priors,
                self.T_world_camera,
                config,
                gates,
                self._clock,
                expected,
            )
        except AssociationError:
            return self._miss(frame, began)
        return self._report(frame, observation, fit, priors, unseen, began)

    def _start(self, frame: Frame, observation: Observation, began: float) -> FrameResult:
        """First frame, or the first after a loss: find the person and fit from several guesses."""
        config, person = self.config, self.human
        if 0.0 <= frame.timestamp_s - self._failed_s < config.start.retry_s:
            return self._nothing(frame, "initialising", began)
        found = start(person, observation, self.T_world_camera, config)
        person, found = self._sized(found)
        self._clock("start")
        if (
            found is None
            or found.agreed.explained < config.judge.start_explained
            or not acceptable(found.agreed, found.fit.surface.rms_m, config.judge)
        ):
            self._failed_s = -np.inf if found is None else frame.timestamp_s
            return self._nothing(frame, "initialising", began)
        return self._meet_at(frame, person, found, began)

    def _sized(self, found: Start | None) -> tuple[Human, Start | None]:
        """The person of a start in her own size, unless it is known already."""
        person, config = self.human, self.config
        if found is None or len(person.shape) or not config.start.shape_coefficients:
            return person, found
        try:
            return sized(person, found, self.T_world_camera, config)
        except AssociationError:
            return person, None

    def _meet_at(self, frame: Frame, person: Human, found: Start, began: float) -> FrameResult:
        """Take a start as the first pose."""
        self._meet(person)
        priors = [diagonal_prior(self._resting, self._prior_sigma)]
        return self._report(frame, found.observation, found.fit, priors, NONE, began)

    def _predict(self, belief: Belief, timestamp_s: float) -> tuple[ndarray, ndarray]:
        """Constant velocity within the limits, and how sure it is."""
        body, motion = self.human.body, self.config.motion
        dt = max(timestamp_s - belief.timestamp_s, 1e-3)
        q = body.integrate(belief.q, belief.velocity * motion.damping * dt)
        q[7:] = np.clip(q[7:], body.lower[6:], body.upper[6:])
        return q, belief.covariance + np.diag(motion_sigma(body, motion, dt) ** 2)

    def _unseen(self, expected: View, observation: Observation) -> Int[ndarray, " n"]:
        """Hinges of which hardly any skin that they move is observed where it is expected."""
        near_m = self.config.judge.explained_m
        found = associate(
            observation, expected.vertices_camera, expected.visible, near_m, near_m, 0
        )
        body, owner = self.human.body, self.human.skin.links[:, 0]
        n = len(body.link_names)
        seen = np.bincount(owner[found.vertex], minlength=n) @ body.support
        moved = np.bincount(owner, minlength=n) @ body.support
        return np.flatnonzero(seen < UNSEEN_SHARE * moved)

    def _pose_prior(self, unseen: Int[ndarray, " n"], dt_s: float) -> TangentPrior:
        """Towards rest; slowly for limbs that were not seen, so that they stay predicted."""
        sigma = self._prior_sigma.copy()
        sigma[unseen] *= np.sqrt(max(self.config.prior.unseen_s / dt_s, 1.0))
        return diagonal_prior(self._resting, sigma)

    def _view(self, state: BodyState, observation: Observation) -> View:
        """The skin of a state as the camera sees it."""
        T_camera_world = invert_rigid(self.T_world_camera)
        return view_skin(self.human, state, T_camera_world, observation, self.config)

    def _box(self, expected: View) -> Float[ndarray, "2 3"]:
        """Camera-frame box around the expected skin, grown by the region's margin [m]."""
        v, margin = expected.vertices_camera, self.config.association.region_margin_m
        return np.stack([v.min(axis=0) - margin, v.max(axis=0) + margin])

    def _report(
        self,
        frame: Frame,
        observation: Observation,
        fit: Fit,
        priors: list[TangentPrior],
        unseen: Int[ndarray, " n"],
        began: float,
    ) -> FrameResult:
        """Judge the fit, update the belief, and say how sure every joint is."""
        config, body = self.config, self.human.body
        T_camera_world = invert_rigid(self.T_world_camera)
        view = self._view(fit.state, observation)
        agreed = agreement(view, observation, config.judge.explained_m)
        good = acceptable(agreed, fit.surface.rms_m, config.judge)
        H, _, _ = normal_equations(fit.state, [fit.surface, *priors])
        covariance = np.linalg.inv(H + 1e-9 * np.eye(body.nv))
        self.belief = self._update(fit, covariance, unseen, frame.timestamp_s, good)
        R = T_camera_world[:3, :3]
        J = R @ joint_jacobians(fit.state)
        positions = transform_points(T_camera_world, fit.state.joint_positions_world)
        result = FrameResult(
            timestamp_s=frame.timestamp_s,
            status="tracking" if self.belief is not None else "lost",
            q=fit.state.q,
            joint_positions_camera_m=positions,
            joint_covariances_m2=J @ covariance @ J.transpose(0, 2, 1),
            joint_visible=joint_visibility(view, agreed.vertex_supported, positions),
            residual_rms_m=fit.surface.rms_m,
            inliers=fit.surface.inliers,
            milliseconds=1e3 * (time.perf_counter() - began),
            iterations=fit.iterations,
        )
        self._clock("report")
        return result

    def _update(
        self,
        fit: Fit,
        covariance: ndarray,
        unseen: Int[ndarray, " n"],
        timestamp_s: float,
        good: bool,
    ) -> Belief | None:
        """The belief after a frame; None once too many bad frames came in a row."""
        body, last = self.human.body, self.belief
        if last is None:
            return Belief(fit.state.q, np.zeros(body.nv), covariance, timestamp_s)
        misses = 0 if good else last.misses + 1
        if misses >= self.config.judge.patience:
            return None
        dt = max(timestamp_s - last.timestamp_s, 1e-3)
        velocity = body.difference(last.q, fit.state.q) / dt
        velocity[unseen] = self.config.motion.damping * last.velocity[unseen]
        return Belief(fit.state.q, velocity, covariance, timestamp_s, misses)

    def _miss(self, frame: Frame, began: float) -> FrameResult:
        """Nothing of the person was seen: forget him."""
        self.belief = None
        return self._nothing(frame, "lost", began)

    def _nothing(
        self, frame: Frame, status: str, began: float, reason: str | None = None
    ) -> FrameResult:
        """A result without a pose."""
        n = len(JOINT_NAMES)
        return FrameResult(
            timestamp_s=frame.timestamp_s,
            status=status,
            q=np.full(self.human.body.nq, np.nan),
            joint_positions_camera_m=np.full((n, 3), np.nan),
            joint_covariances_m2=np.full((n, 3, 3), np.nan),
            joint_visible=np.zeros(n),
            residual_rms_m=float("nan"),
            inliers=0,
            milliseconds=1e3 * (time.perf_counter() - began),
            reason=reason,
        )

# SPDX-License-Identifier: Apache-2.0
"""The method on one screen: predict, observe, associate and solve, judge, report [Wan19, 4]."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray
from threadpoolctl import ThreadpoolController

from kintrack.alignment import Fit, View, fit_pose, view_skin
from kintrack.association.observation import Observation, box_around, observe, within
from kintrack.begin import begin
from kintrack.belief import Belief, awaited_state, coasted, first, tracking_priors, updated
from kintrack.body import BodyState, run_kinematics
from kintrack.config import TrackerConfig
from kintrack.deformation.surface import Surface, followed, met
from kintrack.errors import AssociationError
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.human import RESTING_DEG, Human, load_human, posed, prior_sigma
from kintrack.judge import agreement
from kintrack.lifecycle import HIDDEN, NOBODY, Life, LifecycleConfig, absent, judged
from kintrack.occlusion import hidden_hinges, unseen_hinges
from kintrack.person import LabelledConfig, geometric_lifecycle, own_pixels, part_pull
from kintrack.reporting import coasted_result, empty_result, fitted_result, reading_of
from kintrack.residuals.prior import TangentPrior, diagonal_prior
from kintrack.result import FrameResult
from kintrack.segmenter import Segmenter, checked_labels, region_of
from kintrack.sequence.frame import Frame
from kintrack.sides import settle_sides
from kintrack.solver.gauss_newton import normal_equations
from kintrack.start import Start, found_by, in_own_size
from kintrack.whereabouts import Whereabouts


class Tracker:
    """Follows one person through the frames of one camera."""

    def __init__(
        self,
        config: TrackerConfig | None = None,
        human: Human | None = None,
        T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
        clock: Callable[[str], None] = lambda stage: None,
        segmenter: Segmenter | None = None,
        labelled: LabelledConfig | None = None,
    ):
        """Set up a tracker that has seen nothing yet.

        Args:
            config: All weights; the defaults if None.
            human: Body and skin; the average adult if None.
            T_world_camera: Camera pose; a level camera if not given.
            clock: Called after each stage with its name, for benchmarks.
            segmenter: Labels every frame; None for the geometry alone.
            labelled: What belongs to labels; the defaults if None.
        """
        self.config = TrackerConfig() if config is None else config
        self.T_world_camera = T_world_camera
        self.segmenter = segmenter
        self.labelled = LabelledConfig() if labelled is None else labelled
        self.belief: Belief | None = None
        self._life, self._where = Life(), Whereabouts()
        self._failed_s = -np.inf
        self.surface: Surface | None = None
        self._clock = clock
        self._threads = ThreadpoolController()
        self._meet(load_human() if human is None else human)

    def _meet(self, human: Human) -> None:
        """Take this person's body and what belongs to it."""
        self.surface = met(self.surface, human, self.config.deformation)
        self.human = self._fitted = human
        if self.surface is not None:
            self.human, self._fitted = self.surface.shown(human), self.surface.fitted(human)
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
            try:
                human, T, seen = self._fitted, self.T_world_camera, self._observe(frame)
                found = begin(human, seen, joints_camera, T, self.config)
            except AssociationError:
                return self._nothing(frame, "initialising", began)
            self._life = Life("tracking", None)
            person, sized_start = in_own_size(human, found, T, self.config)
            return self._meet_at(frame, person, sized_start or found, began)

    def _step(self, frame: Frame) -> FrameResult:
        began = time.perf_counter()
        if frame.problem is not None or frame.depth_m is None:
            return self._nothing(frame, "skipped", began, frame.problem or "no depth")
        config, a, now_s = self.config, self.config.association, frame.timestamp_s
        awaited = awaited_state(self._fitted.body, self.belief, now_s, config.motion)
        observation = self._observe(frame, awaited)
        if not observation.points_camera[..., 2].any():
            return self._nothing(frame, "skipped", began, "no depth reading")
        observation, self._where = own_pixels(
            observation,
            self._where,
            self.belief is not None,
            now_s,
            self.T_world_camera,
            self.labelled,
        )
        if self.belief is None or awaited is None:
            return self._start(frame, observation, began)
        expected = self._view(awaited, observation)
        seen = settle_sides(
            within(observation, box_around(expected.vertices_camera, a.region_margin_m)),
            expected.vertices_camera,
            expected.visible,
            expected.labels,
            a.side_m,
        )
        self._clock("observe")
        unseen = unseen_hinges(self._fitted, expected, seen, config.judge.explained_m)
        hidden = hidden_hinges(self._fitted, expected, seen, config.occlusion)
        priors = tracking_priors(
            awaited, self.belief, self._resting, self._prior_sigma, unseen, hidden, now_s, config
        )
        gates = np.geomspace(a.first_gate_m, a.last_gate_m, config.solver.rounds).tolist()
        try:
            fit = fit_pose(
                self._fitted,
                seen,
                awaited.q,
                [*priors, part_pull(seen, self.T_world_camera, config.pull)],
                self.T_world_camera,
                config,
                gates,
                self._clock,
                expected,
            )
        except AssociationError:
            return self._miss(frame, seen, began)
        return self._report(frame, seen, fit, priors, unseen, hidden, began)

    def _observe(self, frame: Frame, awaited: BodyState | None = None) -> Observation:
        """Points of a frame, with labels if there is a segmenter."""
        a, region = self.config.association, None
        if awaited is not None and not self._life.bad:
            T_camera_world = invert_rigid(self.T_world_camera)
            joints = transform_points(T_camera_world, awaited.joint_positions_world)
            region = region_of(joints, frame.camera)
        labels = None if self.segmenter is None else checked_labels(self.segmenter, frame, region)
        return observe(frame, a.max_width_px, a.background_share, labels)

    def _lifecycle(self, observation: Observation) -> LifecycleConfig:
        """When tracking begins and ends."""
        if observation.labels is None:
            return geometric_lifecycle(self.config.judge)
        return self.labelled.lifecycle

    def _start(self, frame: Frame, observation: Observation, began: float) -> FrameResult:
        """First frame, or the first after a loss: find the person and fit from several guesses."""
        config, person, machine = self.config, self._fitted, self._lifecycle(observation)
        waits = 0.0 <= frame.timestamp_s - self._failed_s < config.start.retry_s
        if not (observation.region.any() and self._life.may_begin) or waits:
            self._life = absent(self._life, machine)
            return self._nothing(frame, self._life.status, began)
        found = found_by(person, observation, self.T_world_camera, config, self.labelled.start)
        person, found = in_own_size(person, found, self.T_world_camera, config)
        self._clock("start")
        if found is None:
            self._life = absent(self._life, machine)
            return self._nothing(frame, self._life.status, began)
        T_camera_world = invert_rigid(self.T_world_camera)
        view = view_skin(person, found.fit.state, T_camera_world, found.observation, config)
        reading = reading_of(found.fit, view, found.agreed, found.observation)
        self._life = judged(self._life, reading, machine)
        if not self._life.tracks:
            self._failed_s = frame.timestamp_s if observation.labels is None else -np.inf
            return self._nothing(frame, self._life.status, began)
        return self._meet_at(frame, person, found, began)

    def _meet_at(self, frame: Frame, person: Human, found: Start, began: float) -> FrameResult:
        """Take a start as the first pose."""
        self._meet(person)
        priors = [diagonal_prior(self._resting, self._prior_sigma)]
        none = np.zeros(person.body.nv, dtype=bool)
        return self._report(frame, found.observation, found.fit, priors, none, none, began)

    def _view(self, state: BodyState, observation: Observation) -> View:
        """The skin of a state as the camera sees it."""
        T_camera_world = invert_rigid(self.T_world_camera)
        return view_skin(self._fitted, state, T_camera_world, observation, self.config)

    def _report(
        self,
        frame: Frame,
        observation: Observation,
        fit: Fit,
        priors: list[TangentPrior],
        unseen: Bool[ndarray, " nv"],
        hidden: Bool[ndarray, " nv"],
        began: float,
    ) -> FrameResult:
        """Judge the fit, update the belief, and say how sure every joint is."""
        config, body = self.config, self._fitted.body
        T_camera_world = invert_rigid(self.T_world_camera)
        view = self._view(fit.state, observation)
        agreed = agreement(view, observation, config.judge.explained_m)
        H, _, _ = normal_equations(fit.state, [fit.surface, *priors])
        covariance = np.linalg.inv(H + 1e-9 * np.eye(body.nv))
        last, now_s, q = self.belief, frame.timestamp_s, fit.state.q
        if last is None:
            self.belief = first(q, covariance, now_s)
        else:
            reading = reading_of(fit, view, agreed, observation)
            self._life = judged(self._life, reading, self._lifecycle(observation))
            new = updated(body, last, q, covariance, unseen, hidden, now_s, config.motion)
            new = replace(new, misses=self._life.bad)
            self.belief = new if self._life.tracks else None
        offsets_m = self._deform(fit.state, observation, now_s)
        result = fitted_result(
            frame,
            self._life.status,
            fit,
            view,
            agreed.vertex_supported,
            covariance,
            T_camera_world,
            config.confidence,
            began,
        )
        self._clock("report")
        return replace(result, offsets_m=offsets_m)

    def _deform(
        self, state: BodyState, observation: Observation, now_s: float
    ) -> Float[ndarray, " v"] | None:
        """Let the skin follow the surface of a person who is tracked well; its offsets [m]."""
        if self.surface is None:
            return None
        if self._life.tracks and not self._life.bad:
            T, deformation = invert_rigid(self.T_world_camera), self.config.deformation
            self.surface = followed(self.surface, state, observation, T, now_s, deformation)
            self._fitted = self.surface.fitted(self._fitted)
            self.human = self.surface.shown(self._fitted)
            self._clock("deform")
        return self.surface.offsets_m

    def _miss(self, frame: Frame, observation: Observation, began: float) -> FrameResult:
        """Nothing of the person was seen: with labels she is hidden, or else forgotten."""
        assert self.belief is not None
        body, config, now_s = self._fitted.body, self.config, frame.timestamp_s
        machine, labelled = self._lifecycle(observation), observation.labels is not None
        self._life = absent(self._life, machine, HIDDEN) if labelled else Life("lost", NOBODY)
        if not self._life.tracks:
            self.belief = None
            return self._nothing(frame, "lost", began)
        coasting = coasted(body, self.belief, now_s, config.motion, self._prior_sigma)
        self.belief = replace(coasting, misses=self._life.bad)
        state = run_kinematics(body, self.belief.q)
        T_camera_world = invert_rigid(self.T_world_camera)
        result = coasted_result(
            frame, state, self.belief.covariance, T_camera_world, config.confidence, began
        )
        return replace(result, offsets_m=None if self.surface is None else self.surface.offsets_m)

    def _nothing(
        self, frame: Frame, status: str, began: float, reason: str | None = None
    ) -> FrameResult:
        """A result without a pose."""
        return empty_result(frame, self._fitted.body, status, began, reason)

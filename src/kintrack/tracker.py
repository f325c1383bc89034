# SPDX-License-Identifier: Apache-2.0
"""The method on one screen: predict, observe, associate and solve, judge, report [Wan19, 4]."""

from __future__ import annotations

import time
from concurrent.futures import wait
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray

from kintrack.alignment import Fit, fit_pose, view_skin
from kintrack.association.observation import Observation, box_around, observe, within
from kintrack.begin import begin
from kintrack.belief import (
    awaited_state,
    coasted,
    covariance_of,
    first,
    guessed_habit,
    tracking_priors,
    updated,
)
from kintrack.body import BodyState, run_kinematics
from kintrack.deformation.surface import followed
from kintrack.errors import AssociationError
from kintrack.geometry import invert_rigid, transform_points
from kintrack.human import Human
from kintrack.joints import JOINT_NAMES
from kintrack.judge import agreement
from kintrack.lifecycle import HIDDEN, LEAST_SEEN, NOBODY, UNFITTED, Life, absent, judged, unbegun
from kintrack.memory import Memory
from kintrack.occlusion import hidden_hinges, unseen_hinges
from kintrack.person import own_pixels, part_pull
from kintrack.reporting import coasted_result, fitted_result, reading_of
from kintrack.residuals.prior import TangentPrior, diagonal_prior
from kintrack.result import FrameResult
from kintrack.rivals import Duel, Vigil, challenges, other_cores
from kintrack.segmenter import Told, checked_labels, region_of
from kintrack.sequence.frame import Frame, readable
from kintrack.settling import settle
from kintrack.solver.gauss_newton import normal_equations
from kintrack.start import Start, found_by, in_own_size
from kintrack.whereabouts import met

CHEST = JOINT_NAMES.index("chest")


class Tracker(Memory):
    """Follows one person through the frames of one camera."""

    def step(self, frame: Frame) -> FrameResult:
        """Fit the body to the next frame.

        Args:
            frame: The next frame in time; one with a problem is skipped.

        Returns:
            Pose, joints, covariances and status. Whoever begins to be tracked, or is doubtful, is
            followed facing the other way and on exchanged legs, too, for some frames; if that fits
            better, it is what is returned, and `amended` has the frames before.
        """
        with self._threads.limit(limits=1, user_api="blas"):
            if not self.tracks:
                self._vigil = Vigil(self.config.rival)
            self.amended, frame, self._taken = (), readable(frame), []
            try:
                result = self._step(frame)
                return self._settled(frame, result) if self.config.rival.most_frames else result
            finally:
                wait(self._taken)

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
        began, frame = time.perf_counter(), readable(frame)
        if frame.problem is not None or frame.depth_m is None:
            return self._nothing(frame, "skipped", began, frame.problem or "no depth")
        with self._threads.limit(limits=1, user_api="blas"):
            try:
                human, T, seen = self._fitted, self.T_world_camera, self._observe(frame)
                found = begin(human, seen, joints_camera, T, self.config)
            except AssociationError:
                return self._nothing(frame, "initialising", began)
            self.belief, self._life, self._duels = None, Life("tracking", None), []
            self._vigil = Vigil(self.config.rival, trusted=True)
            person, sized_start = in_own_size(human, found, T, self.config)
            return self._meet_at(frame, person, sized_start or found, began)

    def _settled(self, frame: Frame, result: FrameResult) -> FrameResult:
        """The frame's result, or that of a rival who stays."""
        began, winner = time.perf_counter(), None
        if self._duels:
            for taken in self._taken:
                taken.result()
            told = [(duel, duel.verdict(self.tracks, self.reading)) for duel in self._duels]
            won = [duel for duel, verdict in told if verdict.won]
            winner = max(won, key=lambda duel: duel.advantage, default=None)
            self._duels = [] if won else [duel for duel, verdict in told if not verdict.over]
        elif self.tracks and self._vigil.due(self.reading, frame.timestamp_s):
            self._duels = self._challenged(frame, result)
        else:
            return result
        self._clock("rival")
        all_ms = result.milliseconds + 1e3 * (time.perf_counter() - began)
        for duel in self._duels if winner is None else [winner]:
            duel.results[-1] = replace(duel.results[-1], milliseconds=all_ms)
        if winner is None:
            return replace(result, milliseconds=all_ms)
        self._become(winner.rival)
        self.amended = tuple(winner.results)
        return self.amended[-1]

    def _challenged(self, frame: Frame, result: FrameResult) -> list[Duel]:
        """Let rivals, who have none themselves, begin where the track is, in the same clothes."""
        rules, begun = self.config.rival, []
        kept = replace(self.config.deformation, reset_when_lost=False)
        alone = replace(self.config, rival=replace(rules, most_frames=0), deformation=kept)
        for challenge in challenges(result, rules):
            told = None if self.segmenter is None else Told(self.segmenter)
            human, T = self._met, self.T_world_camera
            rival = Tracker(alone, human, T, segmenter=told, labelled=self.labelled)
            rival._where, rival._ground = self._where, self._ground
            rival._wear(self.surface)
            begun.append(other_cores().submit(Duel.begun, rival, challenge, frame, rules))
        return [duel for duel in (found.result() for found in begun) if duel is not None]

    def _step(self, frame: Frame) -> FrameResult:
        began, self.reading = time.perf_counter(), None
        if frame.problem is not None or frame.depth_m is None:
            self._send(frame)
            return self._nothing(frame, "skipped", began, frame.problem or "no depth")
        config, a, now_s = self.config, self.config.association, frame.timestamp_s
        awaited = awaited_state(self._fitted.body, self.belief, now_s, config.motion)
        observation = self._observe(frame, awaited)
        self._send(frame)
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
        box = box_around(expected.vertices_camera, a.region_margin_m)
        seen = settle(within(observation, box), expected, a.doubt_m, a.side_m)
        self._clock("observe")
        unseen = unseen_hinges(self._fitted, expected, seen, config.judge.explained_m)
        hidden = hidden_hinges(self._fitted, expected, seen, config.occlusion)
        priors = tracking_priors(
            awaited,
            self.belief,
            self._legs,
            self._resting,
            self._prior_sigma,
            unseen,
            hidden,
            now_s,
            config,
            self._stance(awaited),
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
                self._contact(unseen | hidden),
            )
        except AssociationError:
            return self._miss(frame, seen, began)
        return self._report(frame, seen, fit, priors, unseen, hidden, began)

    def _send(self, frame: Frame) -> None:
        """Let rivals take the frame, whose labels are known by now, beside the track."""
        self._taken = [other_cores().submit(duel.step, frame) for duel in self._duels]

    def _observe(self, frame: Frame, awaited: BodyState | None = None) -> Observation:
        """Points of a frame, with labels if there is a segmenter."""
        a, region = self.config.association, None
        if awaited is not None and not self._life.bad:
            T_camera_world = invert_rigid(self.T_world_camera)
            joints = transform_points(T_camera_world, awaited.joint_positions_world)
            region = region_of(joints, frame.camera)
        labels = None if self.segmenter is None else checked_labels(self.segmenter, frame, region)
        return observe(frame, a.max_width_px, a.background_share, labels)

    def _start(self, frame: Frame, observation: Observation, began: float) -> FrameResult:
        """First frame, or the first after a loss: find the person and fit from several guesses."""
        config, person, machine = self.config, self._fitted, self._lifecycle(observation)
        waits = 0.0 <= frame.timestamp_s - self._failed_s < config.start.retry_s
        in_view, blind = bool(observation.region.any()), observation.labels is None
        if not (in_view and self._life.may_begin) or waits:
            self._life = unbegun(self._life, machine, in_view)
            return self._nothing(frame, self._life.status, began)
        found = found_by(person, observation, self.T_world_camera, config, self.labelled.start)
        person, found = in_own_size(person, found, self.T_world_camera, config)
        self._clock("start")
        if found is None:
            self._life = absent(self._life, machine, NOBODY if blind else UNFITTED)
            return self._nothing(frame, self._life.status, began)
        T_camera_world = invert_rigid(self.T_world_camera)
        view = view_skin(person, found.fit.state, T_camera_world, found.observation, config)
        reading = reading_of(found.fit, view, found.agreed, found.observation)
        self._life = judged(self._life, reading, machine)
        if not self._life.tracks:
            self._failed_s = frame.timestamp_s if blind else -np.inf
            return self._nothing(frame, self._life.status, began)
        return self._meet_at(frame, person, found, began)

    def _meet_at(self, frame: Frame, person: Human, found: Start, began: float) -> FrameResult:
        """Take a start as the first pose of whom is followed from now on."""
        self._meet(person)
        place = found.fit.state.joint_positions_world[CHEST]
        self._where = met(self._where, place, frame.timestamp_s)
        priors, seen = [diagonal_prior(self._resting, self._prior_sigma)], found.observation
        none = np.zeros(person.body.nv, dtype=bool)
        hidden = hidden_hinges(
            self._fitted, self._view(found.fit.state, seen), seen, self.config.occlusion
        )
        return self._report(frame, seen, found.fit, priors, none, hidden, began)

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
        if self.belief is not None and agreed.seen < LEAST_SEEN:
            return self._miss(frame, observation, began)
        H, _, _ = normal_equations(fit.state, [fit.surface, *priors])
        covariance = covariance_of(H)
        last, now_s, q = self.belief, frame.timestamp_s, fit.state.q
        if last is None:
            habit = guessed_habit(q, self._resting, hidden, self._legs)
            self.belief = first(q, covariance, now_s, hidden, habit)
        else:
            self.reading = reading_of(fit, view, agreed, observation)
            self._life = judged(self._life, self.reading, self._lifecycle(observation))
            new = updated(body, last, q, covariance, unseen, hidden, now_s, config.motion)
            new = replace(new, misses=self._life.bad)
            self.belief = new if self._life.tracks else None
        offsets_m = self._deform(fit.state, observation, now_s)
        self._look_down(fit.state, observation, now_s)
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
        """Next to nothing of the person was seen: with labels she is hidden, or else forgotten."""
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

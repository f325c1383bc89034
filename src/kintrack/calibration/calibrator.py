# SPDX-License-Identifier: Apache-2.0
"""Collects frames while they pass, keeps the varied ones, and says who the person is.

Whoever tracks calls `add` for every frame that he is sure of, and `result` at the end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from threadpoolctl import threadpool_limits

from kintrack.association.observation import Observation
from kintrack.body import BodyState, run_kinematics
from kintrack.calibration.blocks import Snapshot
from kintrack.calibration.bundle import Bundle, Gaussian, Measurement, solve_bundle
from kintrack.calibration.config import CalibrationConfig
from kintrack.calibration.errors import CalibrationError
from kintrack.calibration.measures import Length, height, measured
from kintrack.calibration.person import Person
from kintrack.calibration.selection import spread, varied
from kintrack.calibration.verdict import LIMITS, Limits, problems_of
from kintrack.clothing import REGIONS, THICKEST_M, dressed_space, fold_sigma
from kintrack.config import TrackerConfig
from kintrack.errors import AssociationError
from kintrack.floor import floor_under, soles_of
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, invert_rigid, transform_points
from kintrack.human import Human
from kintrack.residuals.contact import Contact
from kintrack.shape import checked_shape, load_shape_space
from kintrack.skin import skinned_vertices

LEADING = 0.01
"""A coefficient that explains more of the population than this must stay within its bounds; the
others also take up what clothes do."""


def check_stated(height_m: float | None) -> None:
    """Pass if somebody may be as tall as stated [m].

    Raises:
        CalibrationError: if not.
    """
    low, high = LIMITS.height_m
    if height_m is not None and not low <= height_m <= high:
        raise CalibrationError(
            f"stated height {height_m!r} m: adults of {low} to {high} m are allowed"
        )


@dataclass(frozen=True)
class Candidate:
    """A frame that may be used."""

    index: int
    """Its number in the recording."""
    snapshot: Snapshot
    """What was observed, and the pose."""
    joints_m: Float[ndarray, "j 3"]
    """Joint centres, camera frame [m]."""
    seen: float
    """How well it shows the person, 0 to 1."""


class Calibrator:
    """Learns one person's shape from frames that somebody has fitted."""

    def __init__(
        self,
        human: Human,
        T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
        config: CalibrationConfig | None = None,
        tracker: TrackerConfig | None = None,
        stated_height_m: float | None = None,
    ):
        """Set up a calibrator that has seen nothing yet.

        Args:
            human: With whom the poses are fitted; her shape is the first guess.
            T_world_camera: Camera pose; a level camera if not given.
            config: How to calibrate.
            tracker: Association and pose priors.
            stated_height_m: Height of the person, if somebody knows it [m].

        Raises:
            CalibrationError: if nobody is as tall as stated.
        """
        check_stated(stated_height_m)
        self.human = human
        self.T_world_camera = T_world_camera
        self.config = CalibrationConfig() if config is None else config
        self.tracker = TrackerConfig() if tracker is None else tracker
        self.stated_height_m = stated_height_m
        self.candidates: list[Candidate] = []
        self._soles = soles_of(human)

    def add(self, index: int, observation: Observation, q: ndarray, seen: float = 1.0) -> None:
        """Take a frame.

        Args:
            index: Its number in the recording.
            observation: What was observed, its region the person as far as it is known.
            q: Pose in it, of a tracker that is sure.
            seen: Share of the person that it shows, 0 to 1.
        """
        state = run_kinematics(self.human.body, q)
        joints = transform_points(invert_rigid(self.T_world_camera), state.joint_positions_world)
        contact = self._contact(observation, state)
        snapshot = Snapshot(observation, np.array(q), self.T_world_camera, contact)
        self.candidates.append(Candidate(index, snapshot, joints, seen))
        if len(self.candidates) > self.config.pool:
            kept = self._varied(self.config.pool - self.config.pool // 4)
            self.candidates = [self.candidates[i] for i in kept]

    def _contact(self, observation: Observation, state: BodyState) -> Contact | None:
        """The floor under a body, and its soles."""
        soles = skinned_vertices(state, self.human.skin)[self._soles]
        floor = floor_under(observation, self.T_world_camera, soles, self.tracker.floor)
        return None if floor is None else Contact(floor, self._soles, np.ones(2, dtype=bool))

    def result(self, limits: Limits = LIMITS) -> Person:
        """The person, or the template with the reasons why.

        Args:
            limits: Whom to believe.

        Raises:
            CalibrationError: if no frame was added, or none shows the person.
        """
        if not self.candidates:
            raise CalibrationError(
                "nobody was tracked in any frame, so nobody can be calibrated; "
                "`kintrack fit` shows where the tracker stands"
            )
        chosen = [self.candidates[i] for i in self._varied(self.config.frames)]
        with threadpool_limits(1, user_api="blas"):
            bundle = self._solve(chosen, self._stated())
        return self._person(bundle, chosen, limits)

    def _varied(self, count: int) -> ndarray:
        joints = np.stack([c.joints_m for c in self.candidates])
        return varied(joints, np.array([c.seen for c in self.candidates]), count)

    def _solve(self, chosen: Sequence[Candidate], known: Sequence[Measurement]) -> Bundle:
        space = load_shape_space(self.human.folder)
        wide, c = dressed_space(space), self.config
        worn = np.array([region.mean_m for region in REGIONS])
        spare = np.zeros(len(worn))
        limit = np.full(len(space), c.shape_limit)
        prior = Gaussian(
            mean=np.concatenate([np.zeros(len(space)), worn]),
            sigma=np.concatenate(
                [np.full(len(space), c.shape_sigma), [region.sigma_m for region in REGIONS]]
            ),
            lower=np.concatenate([-limit, spare]),
            upper=np.concatenate([limit, spare + THICKEST_M]),
        )
        begun = np.clip(checked_shape(space, self.human.shape), -c.shape_limit, c.shape_limit)
        try:
            return solve_bundle(
                wide,
                [candidate.snapshot for candidate in chosen],
                np.concatenate([begun, worn]),
                prior,
                fold_sigma(space),
                self.tracker,
                c.bundle,
                known,
            )
        except AssociationError as error:
            raise CalibrationError(f"the person is not where the track says: {error}") from error

    def _stated(self) -> list[Measurement]:
        """The stated height as a linear measurement of the coefficients."""
        if self.stated_height_m is None:
            return []
        space = load_shape_space(self.human.folder)
        average, gradient = height(np.zeros(len(space)), self.human.folder)
        padded = np.concatenate([gradient, np.zeros(len(REGIONS))])
        sigma = self.config.stated_sigma_m
        return [Measurement(padded, self.stated_height_m - average, sigma)]

    def _person(self, bundle: Bundle, chosen: Sequence[Candidate], limits: Limits) -> Person:
        k = len(load_shape_space(self.human.folder))
        b, covariance = bundle.b[:k], bundle.covariance[:k, :k]
        tall, limbs = measured(b, covariance, self.human.folder)
        worn = {r.name: float(x) for r, x in zip(REGIONS, bundle.b[k:], strict=True)}
        found = Person(
            shape=b,
            covariance=covariance,
            clothing_m=worn,
            height=tall,
            limbs=limbs,
            frames=tuple(candidate.index for candidate in chosen),
            spread_m=spread(np.stack([candidate.joints_m for candidate in chosen])),
            rms_m=float(np.sqrt(np.nanmean(bundle.rms_m**2))),
            stated_height_m=self.stated_height_m,
        )
        leading = load_shape_space(self.human.folder).rig.explained > LEADING
        at_limit = bool((np.abs(b[leading]) > self.config.shape_limit - 1e-6).any())
        problems = problems_of(found, at_limit, self._unstated(chosen), limits)
        return found if not problems else replace(found, shape=np.zeros(k), problems=problems)

    def _unstated(self, chosen: Sequence[Candidate]) -> Length | None:
        """The height that the frames alone say; None if no other was stated."""
        if self.stated_height_m is None:
            return None
        k = len(load_shape_space(self.human.folder))
        alone = self._solve(chosen, [])
        return measured(alone.b[:k], alone.covariance[:k, :k], self.human.folder)[0]

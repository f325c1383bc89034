# SPDX-License-Identifier: Apache-2.0
"""What a tracker knows: its settings, the person's body, where she is, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray
from threadpoolctl import ThreadpoolController

from kintrack.alignment import View, view_skin
from kintrack.association.observation import Observation
from kintrack.belief import Belief
from kintrack.body import BodyState, leg_length
from kintrack.clothing import dressed_human
from kintrack.config import TrackerConfig
from kintrack.deformation.surface import Surface, met
from kintrack.floor import Ground, soles_of
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, UP_WORLD, invert_rigid
from kintrack.human import RESTING_DEG, Human, posed, prior_sigma
from kintrack.lifecycle import Life, LifecycleConfig, Reading
from kintrack.person import LabelledConfig, geometric_lifecycle
from kintrack.reporting import empty_result
from kintrack.residuals.contact import Contact
from kintrack.residuals.pose_prior import load_leg_prior, stance_of
from kintrack.result import FrameResult
from kintrack.rivals import Duel, Vigil
from kintrack.segmenter import Segmenter, Watched
from kintrack.sequence.frame import Frame
from kintrack.skin import skinned_vertices
from kintrack.solver.choice import check_installed
from kintrack.whereabouts import Whereabouts


class Memory:
    """State of a tracker between two frames."""

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
            human: Body and skin; the average adult, dressed as people are, if None.
            T_world_camera: Camera pose; a level camera if not given.
            clock: Called after each stage with its name, for benchmarks.
            segmenter: Labels every frame; None for the geometry alone.
            labelled: What belongs to labels; the defaults if None.

        Raises:
            ConfigError: if the solver is not installed.
        """
        self.config = TrackerConfig() if config is None else config
        check_installed(self.config.solver.method)
        self.T_world_camera = T_world_camera
        self.segmenter = None if segmenter is None else Watched(segmenter)
        self.labelled = LabelledConfig() if labelled is None else labelled
        self.belief: Belief | None = None
        self.reading: Reading | None = None
        """What the last frame said of the track; None if it was compared with nothing."""
        self.amended: tuple[FrameResult, ...] = ()
        """What the last frames should have been, if the last step found sides exchanged; that
        step's own result is the last of them."""
        self._duels: list[Duel] = []
        self._taken: list[Future[None]] = []
        self._vigil = Vigil(self.config.rival)
        self._life, self._where, self._ground = Life(), Whereabouts(), Ground()
        self._failed_s = -np.inf
        self.surface: Surface | None = None
        self._clock = clock
        self._threads = ThreadpoolController()
        self._meet(dressed_human() if human is None else human)

    def _meet(self, human: Human) -> None:
        """Take this person's body and what belongs to it."""
        self._met = self.human = self._fitted = human
        self._wear(met(self.surface, human, self.config.deformation))
        self._resting = posed(human.body, RESTING_DEG)
        self._legs = load_leg_prior(human.body, self.config.prior)
        self._prior_sigma = prior_sigma(human.body, self.config.prior)
        self._leg_m = leg_length(human.body)
        self._soles = soles_of(human)

    def _wear(self, surface: Surface | None) -> None:
        """Take a surface of this person; None for none."""
        self.surface = surface
        if surface is not None:
            self.human, self._fitted = surface.shown(self._met), surface.fitted(self._met)

    @property
    def in_doubt(self) -> bool:
        """Whether the last results may still be `amended`."""
        return bool(self._duels)

    @property
    def tracks(self) -> bool:
        """Whether there is a pose to go on from."""
        return self.belief is not None

    def _become(self, other: Memory) -> None:
        """Go on from where another tracker is."""
        self.belief, self.reading, self.surface = other.belief, other.reading, other.surface
        self._met, self.human, self._fitted = other._met, other.human, other._fitted
        self._resting, self._prior_sigma = other._resting, other._prior_sigma
        self._legs, self._leg_m = other._legs, other._leg_m
        self._life, self._where, self._soles = other._life, other._where, other._soles

    def _lifecycle(self, observation: Observation) -> LifecycleConfig:
        """When tracking begins and ends."""
        if observation.labels is None:
            return geometric_lifecycle(self.config.judge)
        return self.labelled.lifecycle

    def _view(self, state: BodyState, observation: Observation) -> View:
        """The skin of a state as the camera sees it."""
        T_camera_world = invert_rigid(self.T_world_camera)
        return view_skin(self._fitted, state, T_camera_world, observation, self.config)

    def _contact(self, lost: Bool[ndarray, " nv"]) -> Contact | None:
        """The floor, on which feet of which nothing is seen stand; None if there is none."""
        if self._ground.floor is None:
            return None
        ankles = [self._met.body.dof(f"{side}_ankle_dorsiflexion") for side in "lr"]
        return Contact(self._ground.floor, self._soles, lost[ankles])

    def _stance(self, state: BodyState) -> Float[ndarray, " 3"]:
        """How a body's pelvis is tilted, and how high it is if there is a floor."""
        floor = self._ground.floor
        if floor is None:
            return stance_of(state.q, self._leg_m, UP_WORLD, np.nan)
        return stance_of(state.q, self._leg_m, floor.normal, floor.height_m)

    def _look_down(self, state: BodyState, observation: Observation, now_s: float) -> None:
        """Look for the floor from time to time."""
        floor = self.config.floor
        if self._ground.due(now_s, floor):
            soles = skinned_vertices(state, self._fitted.skin)[self._soles]
            self._ground = self._ground.looked(
                observation, self.T_world_camera, soles, now_s, floor
            )

    def _nothing(
        self, frame: Frame, status: str, began: float, reason: str | None = None
    ) -> FrameResult:
        """A result without a pose; what keeps the person from being tracked unless told else."""
        return empty_result(frame, self._fitted.body, status, began, reason or self._life.reason)

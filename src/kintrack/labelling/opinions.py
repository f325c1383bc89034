# SPDX-License-Identifier: Apache-2.0
"""Labels of every frame by both ways of the tracker, and the verdict on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.fit import posed_skin
from kintrack.joints import JOINT_NAMES
from kintrack.labelling.disputes import disputes
from kintrack.labelling.foreground import Foreground, ForegroundConfig
from kintrack.labelling.keeping import (
    KeepingConfig,
    Opinion,
    Reason,
    fastest,
    objections,
    turning,
    unconfirmed,
)
from kintrack.labelling.measures import coverage, hinges_at_limit, share_outside
from kintrack.labelling.passes import Passes
from kintrack.labelling.transfer import Transfer, TransferConfig, transfer_labels, visible_skin
from kintrack.metrics import torso_rotations
from kintrack.result import FrameResult
from kintrack.sequence.frame import Frame, SequenceReader


@dataclass(frozen=True)
class LabellingConfig:
    """Everything between the tracker's poses and the labels that are kept."""

    foreground: ForegroundConfig = field(default_factory=ForegroundConfig)
    """Removing the room."""
    transfer: TransferConfig = field(default_factory=TransferConfig)
    """From skin to pixels."""
    keeping: KeepingConfig = field(default_factory=KeepingConfig)
    """The drop rule."""


@dataclass(frozen=True)
class Verdict:
    """Whether a frame is kept."""

    reasons: tuple[Reason, ...]
    """Why it is dropped; none for a frame that is kept."""
    way: str = ""
    """Whose labels are the better: `forward`, `backward`, or empty where there is no pose."""
    opinion: Opinion | None = None
    """The numbers behind the verdict."""
    opinions: int = 0
    """How many independent opinions there are."""


@dataclass(frozen=True)
class LabelledFrame:
    """A frame with the labels that the tracker gives it."""

    frame: Frame
    """The whole frame of the recording."""
    labels: UInt8[ndarray, "h w"] | None
    """Labels by the better opinion, whether kept or not; None if there is no pose."""
    verdict: Verdict
    """Whether to keep it."""
    result: FrameResult | None = None
    """The pose behind the labels."""

    @property
    def kept(self) -> bool:
        """True if the labels may be trained on."""
        return not self.verdict.reasons


class Labeller:
    """Labels and verdicts for the frames of one recording."""

    def __init__(
        self,
        sequence: SequenceReader,
        foreground: Foreground,
        passes: Passes,
        T_world_camera: Float[ndarray, "4 4"],
        config: LabellingConfig,
    ):
        """Take what tracking gave.

        Args:
            sequence: The whole recording.
            foreground: The person's masks.
            passes: Both ways of the tracker over the foreground.
            T_world_camera: Camera pose.
            config: Tolerances and thresholds.
        """
        self.sequence, self.foreground, self.passes = sequence, foreground, passes
        self.T_world_camera, self.config = T_world_camera, config
        self._ways = {"forward": _Way(passes.forward), "backward": _Way(passes.backward)}

    def verdicts(self, on_frame: Callable[[], None] = lambda: None) -> tuple[Verdict, ...]:
        """Judge every frame, N of them; `on_frame` is called after each."""
        found = []
        for frame in self.sequence:
            found.append(self._judge(frame))
            on_frame()
        alone = unconfirmed([not v.reasons for v in found], [v.opinions for v in found])
        reason = Reason("unconfirmed", "one opinion, and no two that agree before or after")
        return tuple(
            replace(verdict, reasons=(reason,)) if drop else verdict
            for verdict, drop in zip(found, alone, strict=True)
        )

    def frames(self, verdicts: tuple[Verdict, ...]) -> Iterator[LabelledFrame]:
        """Every frame in time order with the labels of its better opinion."""
        for frame, verdict in zip(self.sequence, verdicts, strict=True):
            if not verdict.way:
                yield LabelledFrame(frame, None, verdict)
                continue
            result = self._ways[verdict.way].results[frame.index]
            given = self._transfer(frame, result)
            yield LabelledFrame(frame, None if given is None else given[0].labels, verdict, result)

    def _judge(self, frame: Frame) -> Verdict:
        index = frame.index
        if frame.depth_m is None:
            return Verdict((Reason("not tracking", frame.problem or "no depth"),))
        found = []
        for name, way in self._ways.items():
            given = self._transfer(frame, way.results[index])
            if given is not None and not (name == "backward" and index == self.passes.turned_at):
                opinion = self._opinion(frame, way, *given)
                against = objections(opinion, self.config.keeping)
                found.append((bool(against), -opinion.score, name, against, opinion, given[0]))
        if not found:
            result = self.passes.forward[index]
            return Verdict((Reason("not tracking", result.reason or f"status {result.status}"),))
        found.sort(key=lambda one: one[:3])
        _, _, name, against, opinion, transfer = found[0]
        good = sum(not one[0] for one in found)
        if good == 2:
            against = disputes(
                transfer.labels,
                found[1][5].labels,
                self._ways[name].results[index].joint_positions_camera_m,
                self._ways[found[1][2]].results[index].joint_positions_camera_m,
                self.config.keeping,
            )
        return Verdict(against, name, opinion, good)

    def _transfer(
        self, frame: Frame, result: FrameResult
    ) -> tuple[Transfer, Float[ndarray, "v 3"]] | None:
        """Labels by a pose, and the skin's vertices; None where there is no pose."""
        human = self.passes.human
        vertices = posed_skin(human, result.q, self.T_world_camera)
        if vertices is None or frame.depth_m is None:
            return None
        seen = visible_skin(human.skin, vertices, frame.camera)
        mask, room = self.foreground.of(frame), self.foreground.room(frame)
        config = self.config.transfer
        return transfer_labels(frame.depth_m, mask, room, seen, frame.camera, config), vertices

    def _opinion(
        self, frame: Frame, way: _Way, transfer: Transfer, vertices: Float[ndarray, "v 3"]
    ) -> Opinion:
        assert frame.depth_m is not None
        result, mask = way.results[frame.index], self.foreground.of(frame)
        free = self.foreground.kind == "removed"
        return Opinion(
            status=result.status,
            residual_rms_m=result.residual_rms_m,
            coverage=coverage(transfer, frame.depth_m, mask, frame.camera, free),
            speed_m_s=float(way.speed_m_s[frame.index]),
            turn_rad_s=float(way.turn_rad_s[frame.index]),
            limits=hinges_at_limit(self.passes.human.body, result.q),
            outside=share_outside(vertices, frame.camera),
        )


class _Way:
    """One way through the recording, with what only neighbouring frames tell."""

    def __init__(self, results: tuple[FrameResult, ...]):
        self.results = results
        positions = np.array([r.joint_positions_camera_m for r in results])
        times = np.array([r.timestamp_s for r in results])
        self.speed_m_s = fastest(positions, times)
        self.turn_rad_s = turning(torso_rotations(JOINT_NAMES, positions), times)

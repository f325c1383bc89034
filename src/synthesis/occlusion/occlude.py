# SPDX-License-Identifier: Apache-2.0
"""A whole recording with a thing before the person, a real scene around her, or both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bounds import check_bounds
from kintrack.errors import SceneError
from kintrack.files import write_json
from kintrack.geometry import T_LEVEL_WORLD_CAMERA
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.occlusion import OCCLUSION_FILE, read_occlusion
from kintrack.sequence.reference import REFERENCE_FILE, read_reference_joints
from kintrack.sequence.write import SequenceWriter
from synthesis.mesh import Mesh
from synthesis.objects.thing import Thing
from synthesis.occlusion.behind import scale_behind
from synthesis.occlusion.layer import Layer, composite, layer
from synthesis.occlusion.placing import PlacingConfig, place
from synthesis.occlusion.sensing import sensor_for
from synthesis.occlusion.silhouette import Silhouette, hidden_joints, hidden_share, silhouette
from synthesis.sensors.catalogue import SENSORS

LOOKS = 24
"""In how many frames the person is looked for."""
LOOK_WIDTH_PX = 160
"""Widest image in which she is."""
FACTS_FILE = "occluder.json"


@dataclass(frozen=True)
class OccludeConfig:
    """What is put into a recording, and how."""

    placing: PlacingConfig = field(default_factory=PlacingConfig)
    """Where the thing stands."""
    scene_share: float = 0.08
    """Largest share of the person that the scene hides, mean over frames."""
    sensor: str = "auto"
    """How the inserted depth is misread: a sensor's name, or auto to tell by the image size."""
    seed: int = 0
    """Draws place, light and noise."""

    def __post_init__(self) -> None:
        if self.sensor not in ("auto", *SENSORS):
            raise SceneError(f"sensor = {self.sensor!r}; allowed: auto, {', '.join(SENSORS)}")
        check_bounds(self, scene_share=(0, 0.8))


@dataclass(frozen=True)
class Occluded:
    """What was written."""

    frames: int
    """Frames."""
    skipped: int
    """Bad frames of the recording, left out."""
    hidden_share: float
    """Mean share of the person that is hidden."""


def occlude(
    sequence: SequenceReader,
    folder: Path,
    thing: Thing | None,
    scene_camera: Mesh | None = None,
    config: OccludeConfig | None = None,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    on_frame: Callable[[int], None] = lambda n: None,
) -> Occluded:
    """Write a recording with something inserted by depth, and the truth about what it hides.

    Args:
        sequence: Any recording of a person with labels, or without background.
        folder: Sequence folder to write; must not hold anything.
        thing: What stands before her; None for nothing.
        scene_camera: Mesh of a real scene, camera frame; None for none.
        config: Distance, share, side, noise, seed.
        T_world_camera: Pose of the recording's camera; tells what is upright.
        on_frame: Called with the number of frames done.

    Returns:
        What was written.

    Raises:
        SceneError: if there is nothing to insert, the person is not known or not in the image, or
            no place hides that much of her.
        ResultError: if the folder cannot be written.
    """
    config = OccludeConfig() if config is None else config
    if thing is None and scene_camera is None:
        raise SceneError("nothing to insert; give an object, a scene, or both")
    rng = np.random.default_rng((config.seed, 7))
    step = -(-sequence.camera.width // LOOK_WIDTH_PX)
    persons = _look(sequence, step)
    small = sequence.camera.scaled(step)
    sensor = sensor_for(config.sensor, sequence.camera)
    layers: list[Layer] = []
    facts: dict[str, object] = {"config": asdict(config), "source": sequence.name}
    if scene_camera is not None:
        scale = scale_behind(scene_camera, small, persons, config.scene_share)
        placed = scene_camera.moved(T_world_camera @ np.diag([scale, scale, scale, 1.0]))
        layers.append(layer(placed, T_world_camera, sensor_for("perfect", sequence.camera), rng))
        facts["scene_scale"] = scale
    if thing is not None:
        found = place(thing.mesh, small, T_world_camera, persons, config.placing, rng, thing.name)
        placed = thing.mesh.moved(T_world_camera @ found.T_camera_thing)
        layers.append(layer(placed, T_world_camera, sensor, rng))
        facts |= {"thing": thing.name, "T_camera_thing": found.T_camera_thing.tolist()}
    return _write(sequence, folder, layers, facts, rng, on_frame)


def _look(sequence: SequenceReader, step: int) -> list[Silhouette]:
    """The person in some frames, evenly spread."""
    numbers = np.unique(np.linspace(0, len(sequence) - 1, LOOKS).astype(int))
    found = (silhouette(sequence.frame(int(n)), step) for n in numbers)
    return [person for person in found if person is not None]


def _write(sequence, folder, layers, facts, rng, on_frame) -> Occluded:
    names, joints = _reference(sequence)
    before = _hidden_before(sequence)
    writer = SequenceWriter(folder, sequence.camera, joint_names=names)
    shares: list[float] = []
    skipped = 0
    for n, frame in enumerate(sequence):
        person = silhouette(frame)
        if frame.depth_m is None:
            skipped += 1
            continue
        out, nearest = _insert(frame, layers, rng)
        assert out.depth_m is not None
        share = float("nan") if person is None else hidden_share(person, nearest)
        positions = joints[n] if n < len(joints) else np.full((len(names), 3), np.nan)
        behind = hidden_joints(positions, sequence.camera, nearest)
        hidden = {name for name, is_hidden in zip(names, behind, strict=True) if is_hidden}
        writer.write(
            frame.timestamp_s,
            out.depth_m,
            color=out.color,
            labels=out.labels,
            joint_positions_m=positions if names else None,
            hidden_share=share,
            hidden_joints=sorted(hidden | before.get(n, set()), key=JOINT_NAMES.index),
        )
        shares.append(share)
        on_frame(n + 1)
    mean = float(np.nanmean(shares)) if np.isfinite(shares).any() else float("nan")
    write_json(folder / FACTS_FILE, {**facts, "hidden_share": mean, "skipped": skipped})
    return Occluded(len(shares), skipped, mean)


def _insert(frame: Frame, layers, rng) -> tuple[Frame, Float[ndarray, "h w"]]:
    """All layers into a frame; also the depth of the nearest layer [m], 0 = none."""
    nearest = np.full((frame.camera.height, frame.camera.width), np.inf)
    for inserted in layers:
        done = composite(frame, inserted, rng)
        frame = done.frame
        nearest = np.minimum(nearest, np.where(done.depth_m > 0, done.depth_m, np.inf))
    return frame, np.where(np.isfinite(nearest), nearest, 0.0)


def _reference(sequence: SequenceReader) -> tuple[tuple[str, ...], Float[ndarray, "n j 3"]]:
    path = sequence.root / REFERENCE_FILE
    if not path.is_file():
        return (), np.zeros((0, 0, 3))
    return read_reference_joints(path)


def _hidden_before(sequence: SequenceReader) -> dict[int, set[str]]:
    """Joints that were hidden in the recording already."""
    path = sequence.root / OCCLUSION_FILE
    if not path.is_file():
        return {}
    _, hidden = read_occlusion(path)
    return {n: {JOINT_NAMES[j] for j in np.flatnonzero(row)} for n, row in enumerate(hidden)}

# SPDX-License-Identifier: Apache-2.0
"""From a take to a scene: who, what, where, seen by which camera."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.errors import SceneError
from synthesis.barrier import barrier
from synthesis.mesh import Mesh, join
from synthesis.motions.actions import ACTIONS, GRIPPING_ACTIONS, SHORTEST_S, act, default_things
from synthesis.motions.mocap import excerpt, load_clip
from synthesis.motions.motion import RATE_HZ, Motion
from synthesis.motions.performance import Performance, Prop
from synthesis.motions.retarget import retarget
from synthesis.motions.roaming import roaming
from synthesis.objects.catalogue import THINGS, held_out_things, training_things
from synthesis.objects.rooms import room
from synthesis.people.figure import Figure
from synthesis.people.person import Person, load_person
from synthesis.people.wardrobe import dress
from synthesis.render.filming import film_from
from synthesis.render.lights import Lights, draw_lights
from synthesis.sensors.catalogue import SENSORS
from synthesis.sensors.color import ColorCamera, draw_color_camera
from synthesis.sensors.sensor import Sensor
from synthesis.takes import Take


@dataclass(frozen=True)
class Held:
    """A thing that moves with the person."""

    mesh: Mesh
    """Own frame."""
    Ts_world_mesh: Float[ndarray, "n 4 4"]
    """Its pose in every frame."""

    def moved(self, n: int) -> Float[ndarray, "v 3"]:
        """Its vertices in frame n, world frame [m]."""
        return self.mesh.moved(self.Ts_world_mesh[n]).vertices


@dataclass(frozen=True)
class Scene:
    """Everything that a recording shows."""

    figure: Figure
    """The dressed person."""
    motion: Motion
    """What she does; world frame, floor at z = 0."""
    held: tuple[Held, ...]
    """Things that move with her."""
    fixed: Mesh | None
    """What stands still, world frame; None for nothing."""
    lights: Lights
    """Lamps."""
    sensor: Sensor
    """Depth sensor."""
    color: ColorCamera | None
    """Colour camera; None for depth alone."""
    Ts_world_camera: Float[ndarray, "n 4 4"]
    """Camera pose in every frame of the motion."""
    stride: int
    """Motion frames per recorded frame."""

    @property
    def moving(self) -> Mesh:
        """Figure and held things joined; the vertices change with every frame."""
        return join([self.figure.mesh, *(held.mesh for held in self.held)])


def build_scene(take: Take, mocap: Path | None = None) -> Scene:
    """Draw all that a take leaves open.

    Args:
        take: What is decided.
        mocap: Folder of motion capture clips, if the take's action is one.

    Returns:
        The scene.

    Raises:
        SceneError: if the action or the sensor is unknown, or no camera has the person in view.
    """
    if take.sensor not in SENSORS:
        raise SceneError(f"sensor {take.sensor!r}; allowed: {', '.join(SENSORS)}")
    outfit, acting, place, walls, lamps, colour = np.random.default_rng(take.seed).spawn(6)
    hands = "closed" if take.action in GRIPPING_ACTIONS else "relaxed"
    person = load_person(take.person, hands=hands)
    around = THINGS if take.held_out_things else training_things()
    before = held_out_things() if take.held_out_things else training_things()
    performance = _perform(take, person, acting, mocap)
    if take.roaming_arms:
        performance = roaming(person, performance, acting, default_things())
    motion = performance.motion
    sensor = SENSORS[take.sensor]()
    joints = np.stack([run_kinematics(person.body, q).joint_positions_world for q in motion.q])
    Ts_world_camera = film_from(
        joints,
        sensor.camera,
        place,
        facing_rad=_heading(motion) if take.facing else None,
        moving=take.moving_camera,
        truncated=take.truncated,
    )
    standing = [
        prop.thing.mesh.moved(prop.Ts_world_thing[0]) for prop in _props(performance, False)
    ]
    figure = dress(person, outfit)
    if take.room:
        keep_clear = np.concatenate(
            [joints[::5, :, :2].reshape(-1, 2), *(mesh.vertices[:, :2] for mesh in standing)]
        )
        view = Ts_world_camera[0]
        standing.append(room(walls, keep_clear, view[:3, 3], view, things=around))
    if take.barrier:
        before_her = barrier(person, motion, sensor.camera, Ts_world_camera[0], before, place)
        standing += [] if before_her is None else [before_her]
    return Scene(
        figure=figure,
        motion=motion,
        held=tuple(Held(p.thing.mesh, p.Ts_world_thing) for p in _props(performance, True)),
        fixed=join(standing) if standing else None,
        lights=draw_lights(lamps),
        sensor=sensor,
        color=draw_color_camera(colour),
        Ts_world_camera=Ts_world_camera,
        stride=take.stride,
    )


def _heading(motion: Motion) -> float:
    """Where the person looks in the first frame, about z [rad]."""
    ahead = pin.XYZQUATToSE3(motion.q[0, :7]).rotation[:, 0]
    return float(np.arctan2(ahead[1], ahead[0]))


def _props(performance: Performance, held: bool) -> list[Prop]:
    return [prop for prop in performance.props if prop.held is held]


def _perform(
    take: Take, person: Person, rng: np.random.Generator, mocap: Path | None
) -> Performance:
    """The take's action, as long as the take."""
    length = take.frames * take.stride
    if take.action in ACTIONS:
        things = default_things(take.on_sofa)
        duration_s = max(length / RATE_HZ, SHORTEST_S)
        return act(take.action, person, rng, duration_s, things).first(length)
    if mocap is None:
        raise SceneError(
            f"action {take.action!r}: none of {', '.join(ACTIONS)}; "
            f"a motion capture clip needs the folder of clips"
        )
    clip = load_clip(mocap / f"{take.action}.npz")
    if len(clip.times_s) < length:
        raise SceneError(f"{take.action} has {len(clip.times_s)} frames; {length} are needed")
    start = int(rng.integers(len(clip.times_s) - length + 1))
    mirrored = bool(rng.random() < 0.5)
    return Performance(take.action, retarget(person, excerpt(clip, start, length), mirrored))

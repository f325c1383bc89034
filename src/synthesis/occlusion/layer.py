# SPDX-License-Identifier: Apache-2.0
"""What is put into a recording: a mesh that stands still before the camera, as a sensor sees it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.sequence.frame import Frame
from synthesis.mesh import Mesh
from synthesis.render.lights import draw_lights
from synthesis.render.stage import Stage
from synthesis.render.view import View, pixel_radiance
from synthesis.sensors.color import ColorCamera, draw_color_camera
from synthesis.sensors.sensor import Sensor, rays


@dataclass(frozen=True)
class Layer:
    """A mesh seen by the recording's camera."""

    view: View
    """Its rays, without noise."""
    sensor: Sensor
    """How depth is misread."""
    color_camera: ColorCamera
    """How colour is."""

    @property
    def depth_m(self) -> Float[ndarray, "h w"]:
        """True depth at the image's pixels [m], 0 = nothing there."""
        k = self.sensor.supersampling
        return self.view.depth_m[::k, ::k]


def layer(
    mesh_world: Mesh,
    T_world_camera: Float[ndarray, "4 4"],
    sensor: Sensor,
    rng: np.random.Generator,
) -> Layer:
    """Look at a mesh.

    Args:
        mesh_world: The mesh.
        T_world_camera: Pose of the recording's camera.
        sensor: Sensor with the recording's camera.
        rng: Draws lamps and colour camera.
    """
    stage = Stage(mesh_world, None, draw_lights(rng))
    view = stage.view(None, rays(sensor.camera, sensor.supersampling), T_world_camera, color=True)
    return Layer(view, sensor, draw_color_camera(rng))


@dataclass(frozen=True)
class Composite:
    """A frame with a layer in it."""

    frame: Frame
    """Depth, colour and labels of whatever is nearer."""
    depth_m: Float[ndarray, "h w"]
    """True depth of what was put in [m], 0 = nothing."""
    nearer: Bool[ndarray, "h w"]
    """Where it is what the camera sees."""


def composite(frame: Frame, inserted: Layer, rng: np.random.Generator) -> Composite:
    """Put a layer into a frame: at every pixel the nearer of both is seen.

    A pixel whose sensor reading fails on the layer stays empty where the layer covers it.

    Args:
        frame: A good frame.
        inserted: The layer.
        rng: Draws the sensor's noise.
    """
    assert frame.depth_m is not None
    true = inserted.depth_m
    read = inserted.sensor.measure(inserted.view, rng)
    nearer = (true > 0) & ((frame.depth_m == 0) | (true < frame.depth_m))
    nearer |= (read > 0) & (true == 0) & (frame.depth_m == 0)
    depth = np.where(nearer, read, frame.depth_m).astype(np.float32)
    color = frame.color
    if color is not None:
        color = np.where(nearer[..., None], _color(inserted, rng), color)
    labels = None if frame.labels is None else _without(frame.labels, nearer)
    return Composite(replace(frame, depth_m=depth, color=color, labels=labels), true, nearer)


def _color(inserted: Layer, rng: np.random.Generator) -> UInt8[ndarray, "h w 3"]:
    radiance = pixel_radiance(inserted.view, inserted.sensor.supersampling)
    return inserted.color_camera.develop(radiance, rng)


def _without(
    labels: UInt8[ndarray, "h2 w2"], nearer: Bool[ndarray, "h w"]
) -> UInt8[ndarray, "h2 w2"]:
    """Labels with background where something else is nearer."""
    rows = (np.arange(labels.shape[0]) + 0.5) * nearer.shape[0] / labels.shape[0]
    columns = (np.arange(labels.shape[1]) + 0.5) * nearer.shape[1] / labels.shape[1]
    hidden = nearer[np.ix_(rows.astype(int), columns.astype(int))]
    return np.where(hidden, 0, labels).astype(np.uint8)

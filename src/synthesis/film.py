# SPDX-License-Identifier: Apache-2.0
"""From a scene to the frames of a recording, each with its truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, UInt8
from numpy import ndarray

from kintrack.body import run_kinematics
from kintrack.geometry import PinholeCamera, invert_rigid, transform_points
from kintrack.raster import rasterise
from synthesis.motions.motion import RATE_HZ
from synthesis.people.figure import move
from synthesis.render.stage import Stage
from synthesis.render.view import View, pixel_radiance
from synthesis.scene import Scene
from synthesis.sensors.sensor import rays
from synthesis.sensors.shown import labels_shown

SHARE_STEP = 4
"""Every how many pixels the hidden share is measured."""


@dataclass(frozen=True)
class Exposure:
    """One frame with its truth."""

    timestamp_s: float
    """Time [s]."""
    depth_m: Float[ndarray, "h w"]
    """Depth as the sensor reports it [m], 0 = no reading."""
    true_depth_m: Float[ndarray, "h w"]
    """Depth without noise [m], 0 = nothing there."""
    labels: UInt8[ndarray, "h w"]
    """True part labels of what the readings show; of the rays where there is none."""
    color: UInt8[ndarray, "h w 3"] | None
    """Colour registered to depth, R G B; None if the scene has no colour camera."""
    joint_positions_camera_m: Float[ndarray, "j 3"]
    """True joint centres, camera frame [m]."""
    hidden_share: float
    """Share of the person's pixels behind something else, 0..1; NaN if she is not in view."""
    hidden_joints: Bool[ndarray, " j"]
    """True for joints behind something else."""


def film(scene: Scene, rng: np.random.Generator) -> Iterator[Exposure]:
    """Record a scene.

    Args:
        scene: What there is.
        rng: Draws the noise of depth and colour.

    Yields:
        One exposure per `scene.stride` frames of the motion.
    """
    k = scene.sensor.supersampling
    camera = scene.sensor.camera
    samples = rays(camera, k)
    stage = Stage(scene.fixed, scene.moving, scene.lights)
    states = [run_kinematics(scene.figure.person.body, q) for q in scene.motion.q]
    skins = move(scene.figure, states, 1.0 / RATE_HZ)
    for n, (state, skin) in enumerate(zip(states, skins, strict=True)):
        if n % scene.stride:
            continue
        T = scene.Ts_world_camera[n]
        vertices = np.concatenate([skin, *(held.moved(n) for held in scene.held)])
        view = stage.view(vertices, samples, T, color=scene.color is not None)
        joints = transform_points(invert_rigid(T), state.joint_positions_world)
        faces = scene.figure.mesh.faces
        depth = scene.sensor.measure(view, rng)
        yield Exposure(
            timestamp_s=n / RATE_HZ,
            depth_m=depth,
            true_depth_m=view.depth_m[::k, ::k],
            labels=labels_shown(view, depth),
            color=None
            if scene.color is None
            else scene.color.develop(pixel_radiance(view, k), rng),
            joint_positions_camera_m=joints,
            hidden_share=_hidden_share(view, transform_points(invert_rigid(T), skin), faces),
            hidden_joints=_hidden_joints(view, joints),
        )


def _hidden_share(view: View, skin_camera: Float[ndarray, "v 3"], faces) -> float:
    """Share of the person alone that the view does not show as hers."""
    camera: PinholeCamera = view.camera.scaled(SHARE_STEP)
    alone = np.isfinite(rasterise(skin_camera, faces, camera)[0])
    if not alone.any():
        return float("nan")
    return float((view.labels[::SHARE_STEP, ::SHARE_STEP][alone] == 0).mean())


def _hidden_joints(view: View, joints_camera: Float[ndarray, "j 3"]) -> Bool[ndarray, " j"]:
    """Joints whose ray first meets something that is not the person, nearer than the joint."""
    out = np.zeros(len(joints_camera), dtype=bool)
    for j, joint in enumerate(joints_camera):
        if joint[2] <= 0:
            continue
        u, v = np.rint(view.camera.project(joint)).astype(int)
        if 0 <= u < view.camera.width and 0 <= v < view.camera.height:
            out[j] = view.labels[v, u] == 0 and 0 < view.depth_m[v, u] < joint[2]
    return out

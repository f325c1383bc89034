# SPDX-License-Identifier: Apache-2.0
"""Where frames are shown while they come: nowhere, or in a browser through meshcat's viewer."""

from __future__ import annotations

import json
import time
from itertools import count, islice
from pathlib import Path
from typing import Protocol

import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.body import Body, run_kinematics
from kintrack.deformation.relief import relief_of
from kintrack.errors import ResultError
from kintrack.export.coloring import colors_of
from kintrack.export.packing import assemble_page, pack_frame, pack_scene
from kintrack.export.server import CONNECT_LIVE, PageServer
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, PinholeCamera, invert_rigid, transform_points
from kintrack.result import TRACK_FILE, Track
from kintrack.sequence import Frame, SequenceReader
from kintrack.skin import Skin, skinned_vertices

MOST_POINTS = 20_000
"""Points shown in a frame."""


class Viewer(Protocol):
    """Something that shows frames as they come."""

    def show(
        self,
        frame: Frame,
        vertices_camera: Float[ndarray, "v 3"] | None,
        joint_positions_camera: Float[ndarray, "j 3"] | None,
        status: str,
        text: str = "",
        vertex_colors: UInt8[ndarray, "v 3"] | None = None,
    ) -> None:
        """Show one frame; returns at once.

        Args:
            frame: The frame.
            vertices_camera: Skin, camera frame [m], shape (V, 3); None or NaN hides it.
            joint_positions_camera: Joint centres, camera frame [m], shape (J, 3); None or NaN
                hides them.
            status: One of the statuses of a `FrameResult`.
            text: Anything else worth a line.
            vertex_colors: R G B of the skin; those of the parts if never given.
        """
        ...

    def close(self) -> None:
        """Stop showing; doing so twice is harmless."""
        ...


class NullViewer:
    """Shows nothing."""

    def show(
        self,
        frame: Frame,
        vertices_camera: Float[ndarray, "v 3"] | None,
        joint_positions_camera: Float[ndarray, "j 3"] | None,
        status: str,
        text: str = "",
        vertex_colors: UInt8[ndarray, "v 3"] | None = None,
    ) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class MeshcatViewer:
    """The body, the joints and the observed points, live in a browser on this machine."""

    def __init__(
        self,
        skin: Skin,
        port: int | None = None,
        T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    ) -> None:
        """Start serving.

        Args:
            skin: Skin whose vertices are shown.
            port: Port on the loopback interface; any free one if None.
            T_world_camera: The depth camera's place in a world with z up.

        Raises:
            ConfigError: if the port cannot be had.
        """
        self._skin = skin
        self._T_world_camera = T_world_camera
        self._camera: PinholeCamera | None = None
        page = assemble_page("kintrack", "follow(viewer);", connect=CONNECT_LIVE)
        self._server = PageServer(page, port)

    @property
    def url(self) -> str:
        """Address to open in a browser."""
        return self._server.url

    def show(
        self,
        frame: Frame,
        vertices_camera: Float[ndarray, "v 3"] | None,
        joint_positions_camera: Float[ndarray, "j 3"] | None,
        status: str,
        text: str = "",
        vertex_colors: UInt8[ndarray, "v 3"] | None = None,
    ) -> None:
        """Show one frame, see `Viewer.show`."""
        T = self._T_world_camera
        if frame.camera != self._camera:
            self._camera = frame.camera
            scene = pack_scene(self._skin, frame.camera, T, MOST_POINTS)
            self._server.begin(json.dumps(scene))
        self._server.publish(
            pack_frame(
                frame,
                vertices_camera,
                joint_positions_camera,
                status,
                text,
                T,
                MOST_POINTS,
                vertex_colors,
            )
        )

    def close(self) -> None:
        """Stop serving and free the port; doing so twice is harmless."""
        self._server.close()


def replay(
    result_folder: Path,
    sequence: SequenceReader,
    viewer: Viewer,
    body: Body,
    skin: Skin,
    *,
    T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
    fps: float | None = None,
    loop: bool = False,
    offsets_m: Float[ndarray, "n v"] | None = None,
    coloring: str = "part",
) -> None:
    """Show a written track over its recording.

    Args:
        result_folder: Folder with `track.npz`.
        sequence: The recording that was tracked.
        viewer: Where to show it.
        body: The body that was tracked.
        skin: Its skin.
        T_world_camera: The depth camera's place in the world of the track's q.
        fps: Frames per second [hz]; the recording's own time stamps if None.
        loop: Start again at the end, until interrupted.
        offsets_m: Offsets of the skin in every frame [m]; None for the skin as it is.
        coloring: What the skin's colours mean, one of `kintrack.export.coloring.COLORINGS`.

    Raises:
        ResultError: if the track cannot be read, is empty, or is of another recording or body.
    """
    path = Path(result_folder) / TRACK_FILE
    track = Track.load(path)
    if not 0 < len(track) <= len(sequence):
        raise ResultError(
            f"{path} has {len(track)} frames, {sequence.root} has {len(sequence)}: "
            "a track of this recording, with at least one frame, is needed"
        )
    if track.q.shape[1] != body.nq:
        raise ResultError(f"{path}: q has {track.q.shape[1]} numbers, the body has {body.nq}")
    due_s = track.timestamps_s - track.timestamps_s[0]
    if fps is not None:
        due_s = np.arange(len(track)) / fps
    T_camera_world, relief = invert_rigid(T_world_camera), relief_of(body, skin)
    for _ in count() if loop else range(1):
        started_s = time.monotonic()
        for i, frame in enumerate(islice(sequence, len(track))):
            vertices, colors = None, None
            if np.isfinite(track.q[i]).all():
                offsets = np.zeros(len(skin.labels)) if offsets_m is None else offsets_m[i]
                raised = skinned_vertices(run_kinematics(body, track.q[i]), relief.raised(offsets))
                vertices = transform_points(T_camera_world, raised)
                if coloring != "part":
                    colors = colors_of(coloring, skin, offsets, vertices, frame)
            time.sleep(max(0.0, started_s + due_s[i] - time.monotonic()))
            joints, status = track.joint_positions_camera_m[i], str(track.status[i])
            text = f"{track.milliseconds[i]:.0f} ms"
            viewer.show(frame, vertices, joints, status, text, colors)

# SPDX-License-Identifier: Apache-2.0
"""A track as one web page: the moving body and the observed points, to turn and to replay."""

from __future__ import annotations

import base64
from dataclasses import dataclass
from pathlib import Path

from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.export.packing import assemble_page, pack_frame, pack_scene, script_json
from kintrack.files import write_atomically
from kintrack.geometry import T_LEVEL_WORLD_CAMERA, PinholeCamera
from kintrack.sequence import Frame
from kintrack.skin import Skin

MOST_POINTS = 3000
"""Points shown in a frame."""

LARGEST_BYTES = 20_000_000
"""Frames are thinned to stay below this, before the 0.9 MB of meshcat's viewer [bytes]."""


@dataclass(frozen=True)
class _Kept:
    time_s: float
    data: str


class HtmlRecorder:
    """Takes frames one at a time and writes a page that needs neither network nor server.

    Once the frames outgrow `largest_bytes`, every second one is dropped and only every second of
    those to come is kept, again and again; the page states the rate that remains.
    """

    def __init__(
        self,
        skin: Skin,
        T_world_camera: Float[ndarray, "4 4"] = T_LEVEL_WORLD_CAMERA,
        title: str = "kintrack",
        largest_bytes: int = LARGEST_BYTES,
    ) -> None:
        """Start without frames.

        Args:
            skin: Skin whose vertices the frames give.
            T_world_camera: The depth camera's place in a world with z up.
            title: Title of the page.
            largest_bytes: Size of the frames above which they are thinned [bytes].
        """
        self._skin = skin
        self._T_world_camera = T_world_camera
        self._title = title
        self._largest_bytes = largest_bytes
        self._camera: PinholeCamera | None = None
        self._kept: list[_Kept] = []
        self._taken = 0
        self._every = 1

    def __len__(self) -> int:
        """How many frames the page will show."""
        return len(self._kept)

    def add(
        self,
        frame: Frame,
        vertices_camera: Float[ndarray, "v 3"] | None,
        joint_positions_camera: Float[ndarray, "j 3"] | None,
        status: str,
        text: str = "",
        vertex_colors: UInt8[ndarray, "v 3"] | None = None,
    ) -> None:
        """Take one frame, later than those before.

        Args:
            frame: The frame.
            vertices_camera: Skin, camera frame [m], shape (V, 3); None or NaN hides it.
            joint_positions_camera: Joint centres, camera frame [m], shape (J, 3); None or NaN
                hides them.
            status: One of the statuses of a `FrameResult`.
            text: Anything else worth a line.
            vertex_colors: R G B of the skin; those of the parts if never given.
        """
        self._camera = frame.camera
        self._taken += 1
        if (self._taken - 1) % self._every:
            return
        packed = pack_frame(
            frame,
            vertices_camera,
            joint_positions_camera,
            status,
            text,
            self._T_world_camera,
            MOST_POINTS,
            vertex_colors,
        )
        self._kept.append(_Kept(frame.timestamp_s, base64.b64encode(packed).decode()))
        while len(self._kept) > 1 and sum(len(k.data) for k in self._kept) > self._largest_bytes:
            self._kept = self._kept[::2]
            self._every *= 2

    def write(self, path: Path | str) -> None:
        """Write the page in one step.

        Args:
            path: The file to make or replace; its folder must exist.

        Raises:
            ResultError: if there are no frames, or the file cannot be written.
        """
        if self._camera is None:
            raise ResultError(f"cannot write {path}: there are no frames to show")
        scene = pack_scene(self._skin, self._camera, self._T_world_camera, MOST_POINTS)
        frames = [{"time_s": kept.time_s, "data": kept.data} for kept in self._kept]
        script = f"play(new PersonScene(viewer, {script_json(scene)}), {script_json(frames)});"
        page = assemble_page(self._title, script, note=self._note(), connect="'none'")
        write_atomically(Path(path), lambda file: file.write(page.encode()))

    def _note(self) -> str:
        span_s = self._kept[-1].time_s - self._kept[0].time_s
        rate = f", {(len(self._kept) - 1) / span_s:.1f} frames/s" if span_s > 0 else ""
        return f"{len(self._kept)} of {self._taken} frames{rate}"

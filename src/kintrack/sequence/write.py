# SPDX-License-Identifier: Apache-2.0
"""Writing kintrack's sequence folder one frame at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8
from numpy import ndarray

from kintrack.errors import ResultError
from kintrack.geometry import PinholeCamera
from kintrack.joints import JOINT_NAMES
from kintrack.sequence.camera_file import check_positive, write_camera_file
from kintrack.sequence.images import encode_depth
from kintrack.sequence.occlusion import OCCLUSION_FILE, OCCLUSION_HEADER, occlusion_row
from kintrack.sequence.reference import (
    JOINTS_HEADER,
    REFERENCE_FILE,
    check_joint_names,
    reference_rows,
)

INDEX_HEADER = "# timestamp_s filename\n"
JPEG_QUALITY = 95

_IMAGES = ("depth/*.png", "rgb/*.jpg", "labels/*.png")
_TABLES = ("depth.txt", "rgb.txt", REFERENCE_FILE, OCCLUSION_FILE, "camera.json")


class SequenceWriter:
    """A sequence folder that grows by a frame per call and is valid after each.

    A frame counts once its line stands in `depth.txt`, which is written after its images; so a
    writer that is killed leaves every frame it finished.
    """

    def __init__(
        self,
        root: Path,
        camera: PinholeCamera,
        depth_scale_m: float = 0.001,
        *,
        joint_names: Sequence[str] = JOINT_NAMES,
        overwrite: bool = False,
    ) -> None:
        """Make the folder and its camera file.

        Args:
            root: The folder; made if missing.
            camera: Camera of the depth images.
            depth_scale_m: Metres per unit of the depth images.
            joint_names: The J joints of the reference positions, out of `JOINT_NAMES`.
            overwrite: Whether a sequence that is already in the folder may be replaced; files
                that are no part of one stay.

        Raises:
            ResultError: if the folder is not empty and may not be overwritten, cannot be
                written, or a joint name is unknown.
            SequenceError: if the depth scale is not above zero.
        """
        self.root = root
        self.camera = camera
        self.depth_scale_m = check_positive("depth_scale_m", depth_scale_m, root)
        self.joint_names = tuple(joint_names)
        self._frames = 0
        self._last_us: int | None = None
        check_joint_names(self.joint_names, root)
        with self._naming_the_folder():
            root.mkdir(parents=True, exist_ok=True)
            if any(root.iterdir()):
                if not overwrite:
                    raise ResultError(f"{root} is not empty; choose another folder or overwrite it")
                self._remove_old_sequence()
            (root / "depth").mkdir(exist_ok=True)
            write_camera_file(root / "camera.json", camera, self.depth_scale_m)
            self._append("depth.txt", "", header=INDEX_HEADER)

    def __len__(self) -> int:
        """How many frames have been written."""
        return self._frames

    def write(
        self,
        timestamp_s: float,
        depth_m: Float[ndarray, "h w"],
        *,
        color: UInt8[ndarray, "h w 3"] | None = None,
        labels: UInt8[ndarray, "h2 w2"] | None = None,
        joint_positions_m: Float[ndarray, "j 3"] | None = None,
        hidden_share: float | None = None,
        hidden_joints: Sequence[str] = (),
    ) -> None:
        """Append a frame.

        Args:
            timestamp_s: Time stamp [s], kept to the microsecond; above the one before.
            depth_m: Depth along z [m], shape (h, w); NaN, 0 and what exceeds 65535 units are
                written as no reading.
            color: R G B registered to depth, shape (h, w, 3).
            labels: True part labels, shape (h2, w2).
            joint_positions_m: Joint centres in the depth camera's frame [m], shape (J, 3) in the
                order of `joint_names`; rows with NaN are left out.
            hidden_share: Share of the person's pixels that something hides, 0..1.
            hidden_joints: Names of the joints that something hides; needs `hidden_share`.

        Raises:
            ResultError: if an array has a wrong shape, the time stamp does not increase, or the
                folder cannot be written.
        """
        now_us = round(timestamp_s * 1e6)
        if self._last_us is not None and now_us <= self._last_us:
            raise ResultError(
                f"{self.root}: time stamp {timestamp_s!r} s does not come after "
                f"{self._last_us / 1e6!r} s; they must increase strictly, by a microsecond at least"
            )
        size = (self.camera.height, self.camera.width)
        self._check_shape("depth_m", depth_m, size)
        self._check_shape("color", color, (*size, 3))
        self._check_shape("joint_positions_m", joint_positions_m, (len(self.joint_names), 3))
        stem = f"{self._frames:06d}"
        with self._naming_the_folder():
            self._image(f"depth/{stem}.png", encode_depth(depth_m, self.depth_scale_m))
            if labels is not None:
                self._image(f"labels/{stem}.png", np.asarray(labels, dtype=np.uint8))
            if color is not None:
                self._image(f"rgb/{stem}.jpg", cv2.cvtColor(color, cv2.COLOR_RGB2BGR))
                line = f"{now_us / 1e6:.6f} rgb/{stem}.jpg\n"
                self._append("rgb.txt", line, header=INDEX_HEADER)
            line = f"{now_us / 1e6:.6f} depth/{stem}.png\n"
            self._append("depth.txt", line, header=INDEX_HEADER)
            if joint_positions_m is not None:
                rows = reference_rows(self._frames, self.joint_names, joint_positions_m)
                self._append(REFERENCE_FILE, rows, header=JOINTS_HEADER + "\n")
            if hidden_share is not None:
                row = occlusion_row(self._frames, hidden_share, hidden_joints)
                self._append(OCCLUSION_FILE, row, header=OCCLUSION_HEADER)
        self._last_us = now_us
        self._frames += 1

    def _check_shape(self, name: str, array: ndarray | None, shape: tuple[int, ...]) -> None:
        if array is not None and np.shape(array) != shape:
            raise ResultError(
                f"{self.root}: {name} of frame {self._frames} has shape {np.shape(array)}; "
                f"allowed: {shape}"
            )

    def _image(self, name: str, image: ndarray) -> None:
        path = self.root / name
        path.parent.mkdir(exist_ok=True)
        options = [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY] if path.suffix == ".jpg" else []
        path.write_bytes(cv2.imencode(path.suffix, image, options)[1].tobytes())

    def _append(self, name: str, lines: str, *, header: str) -> None:
        path = self.root / name
        lines = lines if path.exists() else header + lines
        with path.open("a", encoding="utf-8", newline="\n") as file:
            file.write(lines)

    def _remove_old_sequence(self) -> None:
        for pattern in (*_TABLES, *_IMAGES):
            for path in self.root.glob(pattern):
                path.unlink()

    @contextmanager
    def _naming_the_folder(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise ResultError(f"cannot write the sequence folder {self.root}: {error}") from error

# SPDX-License-Identifier: Apache-2.0
"""Pictures into an H.264 file that browsers play."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType

import av
import numpy as np
from av.video.stream import VideoStream
from jaxtyping import UInt8
from numpy import ndarray

from kintrack.errors import ResultError

_CONTAINER = {"movflags": "hybrid_fragmented+frag_keyframe", "flush_packets": "1"}
"""In fragments while it grows, so that a killed process leaves a readable file; plain at last."""

_CODEC = {"crf": "20", "preset": "veryfast"}


class VideoWriter:
    """An mp4 of pictures of one size, at a steady rate.

    Leaving the `with` block finishes the file, whatever ended it. A process killed outright loses
    about the last two seconds. A writer that was given no picture leaves no file.
    """

    def __init__(self, path: Path | str, fps: float) -> None:
        """Open the file.

        Args:
            path: The file to make or replace; its folder must exist.
            fps: Pictures per second of the video [hz].

        Raises:
            ResultError: if the file cannot be written, its name does not end in .mp4, or the rate
                is not a positive number.
        """
        self.path = Path(path)
        if self.path.suffix.lower() != ".mp4":
            raise ResultError(f"cannot write {path}: a video's name must end in .mp4")
        if not 0.1 <= fps <= 1000:
            raise ResultError(f"cannot write {path}: fps = {fps!r}; allowed: 0.1 to 1000")
        self._rate = Fraction(fps).limit_denominator(1001)
        try:
            with open(self.path, "wb"):
                pass
            self._container = av.open(str(self.path), "w", options=_CONTAINER)
        except OSError as error:
            raise ResultError(f"cannot write {path}: {error.strerror or error}") from error
        self._stream: VideoStream | None = None
        self._shape: tuple[int, ...] = ()
        self._count = 0
        self._closed = False

    def write(self, picture: UInt8[ndarray, "h w 3"]) -> None:
        """Append one picture; odd sizes gain a copy of their last row or column.

        Args:
            picture: R G B, shape (H, W, 3), the same shape each time.

        Raises:
            ResultError: if the shape differs from the first picture's, or the disk is full.
        """
        if self._stream is None:
            self._stream = self._start(picture.shape)
        if picture.shape != self._shape:
            raise ResultError(
                f"{self.path}: picture {self._count} has shape {picture.shape}; "
                f"the video began with {self._shape}"
            )
        odd_rows, odd_columns = picture.shape[0] % 2, picture.shape[1] % 2
        even = np.pad(picture, ((0, odd_rows), (0, odd_columns), (0, 0)), mode="edge")
        image = av.VideoFrame.from_ndarray(np.ascontiguousarray(even), format="rgb24")
        image.pts = self._count
        self._mux(self._stream, image)
        self._count += 1

    def close(self) -> None:
        """Finish the file; doing so twice is harmless.

        Raises:
            ResultError: if the disk is full.
        """
        if self._closed:
            return
        self._closed = True
        try:
            if self._stream is not None:
                self._mux(self._stream, None)
        finally:
            self._container.close()
            if self._stream is None:
                self.path.unlink(missing_ok=True)

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _start(self, shape: tuple[int, ...]) -> VideoStream:
        height, width = shape[:2]
        keyframe_every = max(1, round(self._rate))
        options = _CODEC | {"g": str(keyframe_every)}
        stream = self._container.add_stream("libx264", rate=self._rate, options=options)
        stream.width, stream.height = width + width % 2, height + height % 2
        stream.pix_fmt = "yuv420p"
        stream.codec_context.time_base = 1 / self._rate
        self._shape = shape
        return stream

    def _mux(self, stream: VideoStream, image: av.VideoFrame | None) -> None:
        try:
            self._container.mux(stream.encode(image))
        except OSError as error:
            raise ResultError(f"cannot write {self.path}: {error.strerror or error}") from error

# SPDX-License-Identifier: Apache-2.0
"""RGB regression as a roboticist would do it today: joints of the colour image, lifted by depth.

MediaPipe Pose (Bazarevsky et al. 2020, BlazePose) finds landmarks in the colour image; each is put
at the median depth around its pixel and pushed inward by a fixed thickness of the body there.
Landmarks it calls invisible, and those without depth, are missing. The joints of the trunk lie on
fixed places between hips, shoulders and ears. Whatever stands before a joint is taken for it.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from kintrack.bench import rgb_worker
from kintrack.errors import ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.result import FrameResult, Track
from kintrack.result_writer import TrackWriter
from kintrack.sequence.frame import Frame, SequenceReader
from kintrack.sequence.reference import read_reference_pixels

VISIBLE = 0.5
"""Landmarks of lower visibility are missing."""
WINDOW_SHARE = 1.0 / 128.0
"""Half the window in which depth is read, share of the image's width."""
THICKNESS_M = {
    "ear": 0.08,
    "shoulder": 0.065,
    "elbow": 0.045,
    "wrist": 0.03,
    "hand": 0.02,
    "hip": 0.11,
    "knee": 0.06,
    "ankle": 0.045,
    "foot": 0.03,
}
"""From the skin to the joint along the line of sight [m], rounded from the average adult of
`model/` seen from the front."""
TRUNK = {"pelvis": 0.0, "spine": 0.21, "chest": 0.54, "neck": 1.42}
"""Place on the line from mid-hips to mid-shoulders, of the same adult; 1 is at the shoulders."""


def regress(
    sequence: SequenceReader,
    folder: Path,
    pixels: Path,
    python: Path | None,
    on_frame: Callable[[], None],
) -> Track:
    """Joints of a whole recording.

    Args:
        sequence: A recording with colour.
        folder: Result folder to write.
        pixels: Table of joints in the images (`frame,joint,u_px,v_px,visibility`); made by
            MediaPipe if missing.
        python: Interpreter that has MediaPipe; this one if None.
        on_frame: Called after every frame.

    Raises:
        ResultError: if MediaPipe does not run, or what it wrote cannot be read.
    """
    if not pixels.is_file():
        find_pixels(sequence.root / "rgb", pixels, python)
    names, found, visibility = read_reference_pixels(pixels)
    with TrackWriter(
        folder,
        JOINT_NAMES,
        sequence_name=sequence.name,
        camera=sequence.camera,
        config={"method": "MediaPipe Pose lifted by depth"},
    ) as writer:
        for frame in sequence:
            joints = np.full((len(JOINT_NAMES), 3), np.nan)
            if frame.depth_m is not None and frame.index < len(found):
                sure = visibility[frame.index] > VISIBLE
                places = np.where(sure[:, None], found[frame.index], np.nan)
                joints = lift(frame, dict(zip(names, places, strict=True)))
            writer.append(_result(frame, joints))
            on_frame()
        return writer.close()


def find_pixels(images: Path, pixels: Path, python: Path | None) -> None:
    """Let MediaPipe look at every image of a folder.

    It runs in a process of its own, under an interpreter of its own if one is given: it brings
    other versions of what this package uses.

    Raises:
        ResultError: if it does not run to the end.
    """
    pixels.parent.mkdir(parents=True, exist_ok=True)
    part = pixels.with_suffix(".part")
    command = [str(python or sys.executable), rgb_worker.__file__, str(images), str(part)]
    try:
        subprocess.run(command, check=True, capture_output=True, text=True)
    except OSError as error:
        raise ResultError(f"{command[0]} cannot be started: {error.strerror}") from error
    except subprocess.CalledProcessError as error:
        last = (error.stderr.strip().splitlines() or ["no message"])[-1]
        raise ResultError(f"MediaPipe on {images} under {command[0]}: {last}") from error
    part.replace(pixels)


def obstacle(python: Path | None) -> str | None:
    """Why MediaPipe cannot be run; None if it can."""
    command = [str(python or sys.executable), "-c", "import mediapipe"]
    try:
        subprocess.run(command, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        return (
            f"{command[0]} has no MediaPipe; `pip install 'kintrack[rgb]'`, or name an "
            "interpreter that has it"
        )
    return None


def lift(frame: Frame, pixels: dict[str, Float[ndarray, " 2"]]) -> Float[ndarray, "j 3"]:
    """Joints in the camera frame from joints in the image.

    Args:
        frame: A good frame.
        pixels: Joint -> (u, v) [px], NaN where missing; `l_ear` and `r_ear` stand for the head.

    Returns:
        Joints [m] in the order of `JOINT_NAMES`, shape (J, 3), NaN where missing.
    """
    lifted = {name: lifted_pixel(frame, place, name[2:]) for name, place in pixels.items()}
    missing = np.full(3, np.nan)

    def middle(name: str) -> Float[ndarray, " 3"]:
        return 0.5 * (lifted.get(f"l_{name}", missing) + lifted.get(f"r_{name}", missing))

    hips, shoulders = middle("hip"), middle("shoulder")
    lifted |= {name: hips + share * (shoulders - hips) for name, share in TRUNK.items()}
    # from the side only one ear is seen
    ears = np.stack([lifted.get("l_ear", missing), lifted.get("r_ear", missing)])
    seen = ears[np.isfinite(ears).all(axis=1)]
    lifted["head"] = seen.mean(axis=0) if len(seen) else missing
    return np.stack([lifted.get(name, missing) for name in JOINT_NAMES])


def lifted_pixel(frame: Frame, place: Float[ndarray, " 2"], what: str) -> Float[ndarray, " 3"]:
    """A joint from its pixel: median depth around, pushed inward along the line of sight [m]."""
    assert frame.depth_m is not None
    camera, missing = frame.camera, np.full(3, np.nan)
    if not np.isfinite(place).all():
        return missing
    u, v = np.rint(place).astype(int)
    if not (0 <= u < camera.width and 0 <= v < camera.height):
        return missing
    reach = max(1, round(WINDOW_SHARE * camera.width))
    window = frame.depth_m[max(v - reach, 0) : v + reach + 1, max(u - reach, 0) : u + reach + 1]
    read = window[window > 0]
    if read.size == 0:
        return missing
    ray = np.array([(place[0] - camera.cx) / camera.fx, (place[1] - camera.cy) / camera.fy, 1.0])
    return ray * float(np.median(read)) + THICKNESS_M[what] * ray / np.linalg.norm(ray)


def _result(frame: Frame, joints: Float[ndarray, "j 3"]) -> FrameResult:
    known = np.isfinite(joints).all(axis=1)
    status = "tracking" if known.any() else "lost"
    n = len(JOINT_NAMES)
    return FrameResult(
        timestamp_s=frame.timestamp_s,
        status="skipped" if frame.depth_m is None else status,
        q=np.zeros(0),
        joint_positions_camera_m=joints,
        joint_covariances_m2=np.full((n, 3, 3), np.nan),
        joint_visible=known.astype(float),
        residual_rms_m=float("nan"),
        inliers=0,
        milliseconds=0.0,
    )

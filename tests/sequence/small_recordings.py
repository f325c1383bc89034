# SPDX-License-Identifier: Apache-2.0
"""Small synthetic recordings for the tests beside this file."""

import json
from pathlib import Path

import cv2
import numpy as np

from kintrack.geometry import PinholeCamera

CAMERA = PinholeCamera(width=8, height=6, fx=10.0, fy=11.0, cx=3.5, cy=2.5)
OURS = {
    "model": "pinhole",
    "width": 8,
    "height": 6,
    "fx": 10.0,
    "fy": 11.0,
    "cx": 3.5,
    "cy": 2.5,
    "depth_scale_m": 0.001,
}
OPEN3D = {"width": 8, "height": 6, "intrinsic_matrix": [10.0, 0, 0, 0, 11.0, 0, 3.5, 2.5, 1]}


def save_json(path: Path, content: object) -> Path:
    path.write_text(json.dumps(content))
    return path


def save_image(path: Path, image: np.ndarray) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)
    return path


def depth_units(value: int = 2000) -> np.ndarray:
    units = np.full((6, 8), value, np.uint16)
    units[0, 0] = 0
    return units


def save_index(root: Path, name: str, times_s: list[float], suffix: str = ".png") -> None:
    folder = Path(name).stem
    lines = [f"{t:.6f} {folder}/{i:06d}{suffix}\n" for i, t in enumerate(times_s)]
    (root / name).write_text("# timestamp_s filename\n" + "".join(lines))


def save_recording(
    root: Path, times_s: list[float], rgb_times_s: list[float] | None = None
) -> Path:
    """Index files and images, no camera file; pixel values tell the frame: 2000 + n, 40 + n."""
    root.mkdir(exist_ok=True)
    save_index(root, "depth.txt", times_s)
    for n in range(len(times_s)):
        save_image(root / f"depth/{n:06d}.png", depth_units(2000 + n))
    if rgb_times_s is not None:
        save_index(root, "rgb.txt", rgb_times_s)
        for n in range(len(rgb_times_s)):
            save_image(root / f"rgb/{n:06d}.png", np.full((6, 8, 3), 40 + n, np.uint8))
    return root

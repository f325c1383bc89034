# SPDX-License-Identifier: Apache-2.0
"""MediaPipe Pose on a folder of images; a script that needs nothing but MediaPipe.

    python rgb_worker.py FOLDER TABLE.csv

It imports nothing of kintrack, so that it runs under any interpreter that has MediaPipe.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

LANDMARKS = {
    "ear": (7, 8),
    "shoulder": (11, 12),
    "elbow": (13, 14),
    "wrist": (15, 16),
    "hand": (19, 20),
    "hip": (23, 24),
    "knee": (25, 26),
    "ankle": (27, 28),
    "foot": (31, 32),
}
"""Joint -> MediaPipe's left and right landmark; the hand is an index finger, the foot its toes."""


def main(images: Path, table: Path) -> None:
    """Write joint pixels of every image: the "full" model, one person, no smoothing."""
    import cv2
    import mediapipe

    lines = ["frame,joint,u_px,v_px,visibility"]
    pose = mediapipe.solutions.pose.Pose(model_complexity=1, smooth_landmarks=False)
    for path in sorted(images.glob("*.jpg")):
        image = cv2.imread(str(path))
        if image is None:
            continue
        found = pose.process(cv2.cvtColor(image, cv2.COLOR_BGR2RGB)).pose_landmarks
        if found is None:
            continue
        height, width = image.shape[:2]
        for joint, sides in LANDMARKS.items():
            for side, number in zip("lr", sides, strict=True):
                point = found.landmark[number]
                u, v = point.x * width - 0.5, point.y * height - 0.5
                lines.append(f"{int(path.stem)},{side}_{joint},{u:.2f},{v:.2f},"
                             f"{point.visibility:.3f}")  # fmt: skip
    table.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    sys.path.pop(0)  # this folder, whose modules MediaPipe's imports could take for others
    os.environ.setdefault("GLOG_minloglevel", "2")
    main(Path(sys.argv[1]), Path(sys.argv[2]))

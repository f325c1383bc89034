# SPDX-License-Identifier: Apache-2.0
"""Small recordings of a figure made of boxes, one colour a part, before a wall."""

import numpy as np

from kintrack.geometry import PinholeCamera
from kintrack.sequence.write import SequenceWriter
from segmentation.augment.insertion import Cutouts
from segmentation.picture import Picture

CAMERA = PinholeCamera(192, 159, 137.0, 137.0, 95.5, 79.0)
BOXES = {
    1: (0.42, 0.10, 0.16, 0.14),
    2: (0.36, 0.24, 0.28, 0.30),
    3: (0.22, 0.24, 0.14, 0.28),
    4: (0.64, 0.24, 0.14, 0.28),
    5: (0.36, 0.54, 0.14, 0.40),
    6: (0.50, 0.54, 0.14, 0.40),
}
"""Left, top, width and height of each part, share of the figure's square; seen from the front."""
PAINT = np.array([[90, 90, 90], [230, 60, 60], [60, 200, 60], [60, 60, 230], [240, 200, 40],
                  [200, 60, 220], [40, 210, 210]], dtype=np.uint8)  # fmt: skip


def figure(seed, camera=CAMERA):
    """Depth [m], colour and labels of a figure 2 to 3 m away; every part has a depth of its own."""
    rng = np.random.default_rng(seed)
    depth = np.full((camera.height, camera.width), 4.0, np.float32)
    labels = np.zeros(depth.shape, np.uint8)
    side = rng.uniform(0.6, 0.85) * camera.height
    left = rng.uniform(0.0, camera.width - side)
    top = rng.uniform(0.0, camera.height - side)
    away = rng.uniform(2.0, 3.0)
    for label, (x, y, w, h) in BOXES.items():
        rows = slice(round(top + y * side), round(top + (y + h) * side))
        columns = slice(round(left + x * side), round(left + (x + w) * side))
        depth[rows, columns] = away + 0.01 * label
        labels[rows, columns] = label
    return depth, PAINT[labels], labels


def picture(seed=0, colored=True):
    depth, color, labels = figure(seed)
    return Picture(depth, color if colored else None, labels, CAMERA.fx)


def record(folder, frames=4, seed=0, labelled=True, colored=True):
    writer = SequenceWriter(folder, CAMERA)
    for n in range(frames):
        depth, color, labels = figure(10 * seed + n)
        writer.write(n / 10, depth, color=color if colored else None,
                     labels=labels if labelled else None)  # fmt: skip
    return folder


def squares(count=3, side=24):
    """Cut-outs: a square board, 0.5 m wide."""
    relief = np.full((count, side, side), np.nan, np.float32)
    relief[:, 2:-2, 2:-2] = 0.0
    color = np.full((count, side, side, 3), 255, np.uint8)
    return Cutouts(relief, color, np.full(count, 0.5 / (side - 4)))

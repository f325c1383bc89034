# SPDX-License-Identifier: Apache-2.0
"""Recordings of a figure of boxes, networks with random weights, and one that knows the truth."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from kintrack.bench.segmentation.networks import Network
from kintrack.geometry import PinholeCamera
from kintrack.sequence.write import SequenceWriter
from segmentation.architecture import NetworkConfig, plan
from segmentation.evaluate import N
from segmentation.preprocess import DEPTH_SCALE, HOLE
from segmentation.weights import Weights, save_weights
from synthesis.takes import Take

CAMERA = PinholeCamera(256, 212, 182.5, 182.5, 127.5, 105.5)
SLIM = NetworkConfig("fast_fcn", (4, 4, 8, 8))
BOXES = {
    1: (0.42, 0.06, 0.16, 0.14),
    2: (0.36, 0.20, 0.28, 0.34),
    3: (0.22, 0.20, 0.14, 0.32),
    4: (0.64, 0.20, 0.14, 0.32),
    5: (0.36, 0.54, 0.14, 0.42),
    6: (0.50, 0.54, 0.14, 0.42),
}
"""Left, top, width and height of each part, share of the figure's square; seen from the front."""


def figure(shift=0):
    """Depth [m], colour and labels of a figure 2.6 m away before a wall."""
    depth = np.full((CAMERA.height, CAMERA.width), 4.0, np.float32)
    labels = np.zeros(depth.shape, np.uint8)
    side, left, top = 180, 38 + shift, 16
    for label, (x, y, w, h) in BOXES.items():
        rows = slice(round(top + y * side), round(top + (y + h) * side))
        columns = slice(round(left + x * side), round(left + (x + w) * side))
        depth[rows, columns] = 2.6 + 0.01 * label
        labels[rows, columns] = label
    color = (35 * labels[..., None] + np.array([0, 10, 20])).astype(np.uint8)
    return depth, color, labels


def record(folder, frames=3, colored=True, labelled=True, removed=False):
    """Write a recording of it; `removed` leaves nothing but the figure."""
    writer = SequenceWriter(folder, CAMERA)
    for n in range(frames):
        depth, color, labels = figure(4 * n)
        writer.write(
            n / 10,
            np.where(labels > 0, depth, 0.0) if removed else depth,
            color=color if colored else None,
            labels=labels if labelled else None,
        )
    return folder


def witnessed(folder, rows, header="frame,joint,u_px,v_px,visibility"):
    """Write joints that a witness saw."""
    lines = [header, *(",".join(map(str, row)) for row in rows)]
    (folder / "reference_mediapipe.csv").write_text("\n".join(lines) + "\n")


def paper_set(root, part="test", frames=2):
    """A dataset of one take."""
    take = Take("00_boxes", part, (0, 1, 0), 1, "boxes", "kinect_v2", frames)
    folder = record(root / part / take.name, frames)
    pose = [[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.2], [0, 0, 0, 1]]
    (folder / "take.json").write_text(
        json.dumps({"take": asdict(take), "draw": 0, "T_world_camera": pose})
    )
    (root / "dataset.json").write_text(json.dumps({"recipe": "paper", "takes": [asdict(take)]}))
    return root


def weights(seed=0, config=SLIM, training=None):
    rng = np.random.default_rng(seed)
    tensors = {}
    for layer in plan(config).layers:
        shape = layer.weight_shape
        tensors[f"{layer.name}.weight"] = rng.normal(0, 0.3, shape).astype(np.float32)
        tensors[f"{layer.name}.bias"] = rng.normal(0, 0.1, layer.outputs).astype(np.float32)
    return Weights(config, tensors, {}, training or {})


def weights_file(path, seed=0, training=None):
    save_weights(path, weights(seed, training=training))
    return path


class Oracle:
    """A segmenter that reads the truth off the figure's relief, and answers as it is told to."""

    runtime = "oracle"

    def __init__(self, answers):
        self.answers, self.images = np.array(answers, np.uint8), []

    def logits_of(self, image):
        self.images.append(image)
        read = image[3] != HOLE
        ratio = np.exp(DEPTH_SCALE * (image[3] - image[3][read].max()))
        wall = 4.0 if ratio[read].min() < 0.8 else 2.66
        labels = np.round((wall * ratio - 2.6) / 0.01)
        labels = np.where(read & (labels >= 1) & (labels < N), labels, 0).astype(np.uint8)
        return np.eye(N, dtype=np.float32)[self.answers[labels]].transpose(2, 0, 1)


def oracle(answers=range(N), name="oracle", digest="0" * 64):
    """A network that says `answers[label]` where the truth is `label`."""
    return Network(name, Path("none"), digest, weights(), Oracle(answers))

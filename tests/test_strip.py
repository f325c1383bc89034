# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import cv2
import numpy as np
import pytest

from kintrack.config import StartConfig, TrackerConfig
from kintrack.errors import ResultError
from kintrack.fit import fit_sequence
from kintrack.joints import JOINT_NAMES
from kintrack.result_writer import TrackWriter
from kintrack.sequence import open_sequence
from kintrack.strip import write_strip

DEMO = Path(__file__).parents[1] / "src" / "kintrack" / "demo"


class FirstFrames:
    """The first frames of a recording."""

    def __init__(self, sequence, count):
        self.name, self.root, self.camera = sequence.name, sequence.root, sequence.camera
        self._sequence, self._count = sequence, count

    def __len__(self):
        return self._count

    def __iter__(self):
        return map(self.frame, range(self._count))

    def frame(self, index):
        return self._sequence.frame(index)


def test_the_strip_shows_the_depth_above_and_the_tinted_fit_below(tmp_path):
    sequence = FirstFrames(open_sequence(DEMO), 3)
    fit_sequence(sequence, tmp_path, TrackerConfig(start=StartConfig(shape_coefficients=0)))
    write_strip(tmp_path, sequence, tmp_path / "strip.png", columns=2)
    picture = cv2.imread(str(tmp_path / "strip.png")).astype(int)
    above, below = np.array_split(picture, 2)
    colorful = [(np.ptp(half, axis=2) > 60).mean() for half in (above, below)]
    assert colorful[0] < 0.001
    assert colorful[1] > 0.03
    assert (above.max(axis=2) > 60).mean() > 0.05


def test_a_result_without_a_pose_is_named(tmp_path):
    sequence = open_sequence(DEMO)
    with TrackWriter(
        tmp_path, JOINT_NAMES, sequence_name="demo", camera=sequence.camera, config={}
    ) as writer:
        writer.note(T_world_camera=np.eye(4))
    with pytest.raises(ResultError, match="no frame has a pose"):
        write_strip(tmp_path, sequence, tmp_path / "strip.png")

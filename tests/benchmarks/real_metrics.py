# SPDX-License-Identifier: Apache-2.0
"""The overall numbers on real recordings, with their targets."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from baseline import Metric
from scoring import RecordingScore, pool

from kintrack.metrics import THRESHOLDS_M


def metrics(scores: Sequence[RecordingScore]) -> list[Metric]:
    """The overall numbers with their targets."""
    p = pool(scores)
    return [
        Metric(
            "tracking", "frames with status `tracking`", 100 * p.tracking, "%", "higher", 0.3, 98
        ),
        Metric(
            "rms",
            "point-to-skin RMS of inliers, mean over frames",
            1e3 * p.rms_m,
            "mm",
            "lower",
            0.3,
            15,
        ),
        Metric(
            "worst_rms", "the same, worst recording", 1e3 * p.worst_rms_m, "mm", "lower", 1.0, 15
        ),
        Metric(
            "distance",
            "mean distance to the Kinect's joints",
            100 * p.mean_m,
            "cm",
            "lower",
            0.2,
            7,
        ),
        Metric(
            "offset_free",
            "the same, constant offsets per joint and recording taken off",
            100 * p.offset_free_m,
            "cm",
            "lower",
            0.2,
            4.5,
        ),
        Metric(
            "torso_offset_free",
            "the same, offsets that turn with the torso",
            100 * p.torso_offset_free_m,
            "cm",
            "lower",
            0.2,
        ),
        Metric(
            "within_10_cm",
            "joints within 10 cm of the Kinect's",
            100 * float(np.interp(0.10, THRESHOLDS_M, p.accuracy)),
            "%",
            "higher",
            1.0,
        ),
        Metric(
            "compared", "Kinect joints that have an estimate", 100 * p.compared, "%", "higher", 0.3
        ),
        Metric("swapped", "frames with left and right swapped", p.swapped, "", "lower", 0, 0),
        Metric("away", "frames facing away from the camera", p.away, "", "lower", 0, 0),
        Metric("inside_out", "frames with the skin inside out", p.inside_out, "", "lower", 0, 0),
    ]

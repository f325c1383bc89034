# SPDX-License-Identifier: Apache-2.0
"""From a frame to a first pose: without labels, with labels, and the person's size."""

from kintrack.start.begun import Start
from kintrack.start.blob import find_person, start
from kintrack.start.labelled import LabelledStartConfig, start_at, start_from_labels
from kintrack.start.sizing import sized

__all__ = [
    "LabelledStartConfig",
    "Start",
    "find_person",
    "sized",
    "start",
    "start_at",
    "start_from_labels",
]

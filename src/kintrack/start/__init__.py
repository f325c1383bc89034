# SPDX-License-Identifier: Apache-2.0
"""From a frame to a first pose: without labels, with labels, and the person's size."""

from kintrack.start.begun import Start
from kintrack.start.blob import find_person, start
from kintrack.start.finding import found_by
from kintrack.start.labelled import start_at, start_from_labels
from kintrack.start.sizing import in_own_size, sized

__all__ = [
    "Start",
    "find_person",
    "found_by",
    "in_own_size",
    "sized",
    "start",
    "start_at",
    "start_from_labels",
]

# SPDX-License-Identifier: Apache-2.0
"""What can go wrong in segmentation; every message names the value and the valid choices."""

from kintrack.errors import KintrackError


class SegmentationError(KintrackError):
    """A network cannot be built, fed or run as asked."""


class WeightsError(SegmentationError):
    """A weights file is missing, broken, or belongs to another network or label set."""


class InputError(SegmentationError):
    """A depth, colour or label image is not what the network can take."""


class RuntimeFallbackWarning(UserWarning):
    """Another runtime than the preferred one labels the frames, and why."""

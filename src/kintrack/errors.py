# SPDX-License-Identifier: Apache-2.0
"""What can go wrong by the caller's hand; every message names the value and the valid choices."""


class KintrackError(Exception):
    """Base of every error that a caller can mend; `kintrack` prints it and exits with code 2."""


class ConfigError(KintrackError):
    """A configuration field holds a value that is not allowed."""


class SequenceError(KintrackError):
    """A recording cannot be read: folder, camera file, index or image."""


class FrameError(SequenceError):
    """One frame of a recording is unusable; the stream goes on without it."""


class ModelError(KintrackError):
    """The human model (URDF or skin) is missing, broken, or lacks a joint that is needed."""


class AssociationError(KintrackError):
    """No observed point could be paired with the skin."""


class ResultError(KintrackError):
    """A result or reference cannot be written or read."""


class SceneError(KintrackError):
    """An object, a person or a room cannot be rendered as asked."""


class DatasetError(KintrackError):
    """A dataset cannot be built, or what is there does not fit the recipe."""


class SegmenterError(KintrackError):
    """A segmenter returned something that is no label map of the frame."""

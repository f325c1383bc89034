# SPDX-License-Identifier: Apache-2.0
"""What can go wrong with a calibration by the caller's hand."""

from __future__ import annotations

from kintrack.errors import KintrackError


class CalibrationError(KintrackError):
    """A person cannot be calibrated as asked, or `person.json` cannot be read."""

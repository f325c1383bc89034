# SPDX-License-Identifier: Apache-2.0
"""What a start gives."""

from __future__ import annotations

from dataclasses import dataclass

from kintrack.alignment import Fit
from kintrack.association.observation import Observation
from kintrack.judge import Agreement


@dataclass(frozen=True)
class Start:
    """The best guess of a start."""

    fit: Fit
    """Fitted pose."""
    agreed: Agreement
    """How well it explains the person."""
    observation: Observation
    """The observation, its region the person."""
    mismatch_m2: float = 0.0
    """Mean squared distance between skin and labelled points; 0 without labels [m^2]."""

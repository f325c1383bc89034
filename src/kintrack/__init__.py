# SPDX-License-Identifier: Apache-2.0
"""kintrack: an articulated, skinned human fitted to every frame of a depth camera."""

__version__ = "0.1.0"

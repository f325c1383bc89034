# SPDX-License-Identifier: Apache-2.0
"""Measuring: the same recordings through several methods, scored against the truth."""

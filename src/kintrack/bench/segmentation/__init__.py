# SPDX-License-Identifier: Apache-2.0
"""Measuring the part segmentation: the paper's three tables, real recordings, runtimes."""

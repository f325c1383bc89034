# SPDX-License-Identifier: Apache-2.0
"""Part segmentation: which body part, or none, each pixel of an RGB-D frame shows [Wan19]."""

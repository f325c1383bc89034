# SPDX-License-Identifier: Apache-2.0
"""How depth and colour cameras misread what is there."""

# SPDX-License-Identifier: Apache-2.0
"""The surface of clothes and folds, as offsets of the skin along its normals."""

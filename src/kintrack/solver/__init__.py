# SPDX-License-Identifier: Apache-2.0
"""Minimisers of the summed terms."""

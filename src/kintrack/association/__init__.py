# SPDX-License-Identifier: Apache-2.0
"""Which observed point belongs to which place of the skin."""

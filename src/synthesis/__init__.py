# SPDX-License-Identifier: Apache-2.0
"""People who move, and a depth camera that looks at them."""

# SPDX-License-Identifier: Apache-2.0
"""Many recordings at once: what they contain, and making them in parallel, resumably."""

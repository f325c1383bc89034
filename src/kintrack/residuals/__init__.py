# SPDX-License-Identifier: Apache-2.0
"""Terms of the objective, one file each."""

# SPDX-License-Identifier: Apache-2.0
"""Changes drawn anew for every sample, so that a network never sees a picture twice."""

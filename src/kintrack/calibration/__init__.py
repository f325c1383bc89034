# SPDX-License-Identifier: Apache-2.0
"""Who the person is: shape and clothes, from a few frames of a recording."""

# SPDX-License-Identifier: Apache-2.0
"""What light does: rays into the scene, colour and infrared reflectance of what they meet."""

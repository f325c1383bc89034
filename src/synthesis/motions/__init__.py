# SPDX-License-Identifier: Apache-2.0
"""What they do: authored actions and retargeted motion capture, feet on the floor."""

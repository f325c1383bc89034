# SPDX-License-Identifier: Apache-2.0
"""Putting a thing in front of a person in any recording, by depth."""

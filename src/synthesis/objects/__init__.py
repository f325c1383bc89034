# SPDX-License-Identifier: Apache-2.0
"""What stands in the way: furniture, carried things, rooms; made or read from files."""

# SPDX-License-Identifier: Apache-2.0
"""How `model/` is made: URDF and skins from the `anny` body (needs the extra `model`)."""

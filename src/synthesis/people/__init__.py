# SPDX-License-Identifier: Apache-2.0
"""Who stands before the camera: bodies of a population, clothes, hair, shoes."""

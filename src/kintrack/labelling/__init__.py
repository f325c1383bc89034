# SPDX-License-Identifier: Apache-2.0
"""Labels without hands: the geometric tracker labels clean recordings and drops what it doubts."""

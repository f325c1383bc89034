# SPDX-License-Identifier: Apache-2.0
"""The joints that kintrack reports, in the order of every array that has one row per joint.

Each is a joint centre; no anatomical landmark is claimed. `neck` is the base of the skull; left
and right are the person's.
"""

JOINT_NAMES = (
    "pelvis",
    "spine",
    "chest",
    "neck",
    "head",
    "l_shoulder",
    "l_elbow",
    "l_wrist",
    "l_hand",
    "l_hip",
    "l_knee",
    "l_ankle",
    "l_foot",
    "r_shoulder",
    "r_elbow",
    "r_wrist",
    "r_hand",
    "r_hip",
    "r_knee",
    "r_ankle",
    "r_foot",
)

# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.body import run_kinematics
from kintrack.joints import JOINT_NAMES
from synthesis.motions.arms import arm

CASES = [
    ((0.0, 1.0, 0.0), (0.0, 1.0, 0.2), 0.0),
    ((1.0, 0.1, 0.0), (1.0, -0.3, 0.3), 5.0),
    ((-0.4, 0.2, -1.0), (0.3, 0.1, -1.0), 0.0),
    ((0.2, 0.4, 1.0), (0.2, 0.0, 1.0), 25.0),
]


@pytest.mark.parametrize(("upper", "forearm", "clavicle_deg"), CASES)
@pytest.mark.parametrize(("side", "outward"), [("l", 1.0), ("r", -1.0)])
def test_an_arm_points_where_it_is_told(person, side, outward, upper, forearm, clavicle_deg):
    body, q = person.body, person.body.neutral()
    for name, deg in arm(upper, forearm, clavicle_deg).items():
        q[body.dof(f"{side}_{name}") + 1] = np.radians(deg)
    joints = run_kinematics(body, q).joint_positions_world
    shoulder, elbow, wrist = (
        joints[JOINT_NAMES.index(f"{side}_{name}")] for name in ("shoulder", "elbow", "wrist")
    )
    for told, bone in ((upper, elbow - shoulder), (forearm, wrist - elbow)):
        direction = np.array(told) * [1.0, outward, 1.0] / np.linalg.norm(told)
        angle = np.degrees(np.arccos(direction @ bone / np.linalg.norm(bone)))
        assert angle < 3.0

# SPDX-License-Identifier: Apache-2.0
"""Hands that go where they are wanted, and things that go with the hands.

A palm frame lies in the middle of each palm: x the way the palm faces, z towards the wrist. So y is
the axis of a bar in the fist: towards the thumb on the left, towards the little finger on the
right. With hanging arms z is up, as it is at a suitcase's handle.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray

from kintrack.body import Body
from kintrack.geometry import invert_rigid
from synthesis.motions.measures import Measures, measure
from synthesis.motions.motion import Motion
from synthesis.people.person import Person

ARM_HINGES = {
    "clavicle_elevation": 12.0,
    "clavicle_protraction": 12.0,
    "shoulder_elevation": 60.0,
    "shoulder_plane": 60.0,
    "shoulder_rotation": 60.0,
    "elbow_flexion": 70.0,
    "forearm_pronation": 45.0,
    "wrist_flexion": 25.0,
    "wrist_deviation": 15.0,
}
"""Hinge of an arm -> how readily it leaves its scripted angle, a standard deviation [deg]."""
PALM_SIGMA_M = 0.001
"""How exactly a palm reaches its place [m]."""
TURN_SIGMA_RAD = 0.2
"""How exactly it is turned [rad]."""
CLEAR_SIGMA_M = 0.015
"""How firmly elbow and forearm stay outside the trunk [m]."""
ARM_RADIUS_M = 0.045
"""Half the thickness of an arm [m]."""
FADE_M = 0.10
"""Over what length the trunk ends below the shoulders and above the hips [m]."""
PALM_DEPTH, PALM_LENGTH = 0.55, 1.6
"""Middle of the grip before and beyond the wrist, in lengths from wrist to hand joint."""
ITERATIONS = 30
STEADY_RAD = 0.12
"""How readily the arm changes its way round from frame to frame [rad]."""
RETURNING = 20.0
"""How much more the scripted posture counts when the palm has let go."""
FURTHEST = 0.985
"""Longest way from shoulder to wrist, as a share of the straight arm."""
FIRST_ROUNDS = 6
"""How often as many in the first frame, which no frame before it prepares."""
CONVERGED_RAD = 1e-5
"""Largest step that ends the iteration [rad]."""


@dataclass(frozen=True)
class HandPath:
    """Where a palm should be."""

    side: str
    """`l` or `r`."""
    Ts_world_palm: Float[ndarray, "n 4 4"]
    """Its pose in every frame."""
    share: Float[ndarray, " n"]
    """0 = the arm moves as scripted, 1 = the palm is there; between, on the way."""
    turn: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """How much turns about the palm's x, y and z matter; 0 = free."""


def palm_in_hand(body: Body, side: str) -> pin.SE3:
    """T_hand_palm of the side `l` or `r`."""
    model = body.model
    hand = model.frames[model.getFrameId(f"{side}_hand")].placement
    middle = model.frames[model.getFrameId(f"{side}_hand_center")].placement
    length_m = -(hand.actInv(middle)).translation[2]
    inward = -1.0 if side == "l" else 1.0
    x, z = np.array([0.0, inward, 0.0]), np.array([0.0, 0.0, 1.0])
    R = np.stack([x, np.cross(z, x), z], axis=1)
    return pin.SE3(R, length_m * (PALM_DEPTH * x - PALM_LENGTH * z))


def frame_path(person: Person, motion: Motion, frame: str) -> Float[ndarray, "n 4 4"]:
    """T_world_frame of a frame of the body throughout a motion, shape (N, 4, 4)."""
    model, data = person.body.model, person.body.model.createData()
    index = model.getFrameId(frame)
    out = np.empty((len(motion.q), 4, 4))
    for T, q in zip(out, motion.q, strict=True):
        pin.forwardKinematics(model, data, q)
        T[:] = pin.updateFramePlacement(model, data, index).homogeneous
    return out


def palm_path(person: Person, motion: Motion, side: str) -> Float[ndarray, "n 4 4"]:
    """T_world_palm throughout a motion, shape (N, 4, 4)."""
    T_hand_palm = palm_in_hand(person.body, side).homogeneous
    return frame_path(person, motion, f"{side}_hand") @ T_hand_palm


def in_hand(
    person: Person,
    motion: Motion,
    side: str,
    T_palm_place: Float[ndarray, "4 4"],
    T_thing_place: Float[ndarray, "4 4"],
) -> Float[ndarray, "n 4 4"]:
    """Poses of a thing held by one of its places.

    Args:
        person: Who holds it.
        motion: How the hand moves.
        side: Which hand, `l` or `r`.
        T_palm_place: How the place lies in the palm.
        T_thing_place: Where the place is on the thing.

    Returns:
        T_world_thing for every frame, shape (N, 4, 4).
    """
    T_palm_thing = T_palm_place @ invert_rigid(T_thing_place)
    return palm_path(person, motion, side) @ T_palm_thing


def reach(person: Person, motion: Motion, paths: Sequence[HandPath]) -> Motion:
    """Bend the arms so that the palms follow their paths.

    Damped Gauss-Newton over `ARM_HINGES` within their limits. The scripted posture decides what
    the palm leaves open, so the result is as smooth as the script and the path. Trunk and legs
    are kept.

    Args:
        person: Who.
        motion: The scripted motion.
        paths: Where the palms should be, at most one for each side.

    Returns:
        The motion with other arms. A palm that cannot reach comes as near as the arm allows.
    """
    measures, q = measure(person), motion.q.copy()
    for path in paths:
        arm = _Arm.of(person.body, path.side, measures)
        offset, steady = np.zeros(len(arm.dofs)), np.inf
        for n in range(len(q)):
            if path.share[n] > 1e-9:
                scripted = motion.q[n, arm.dofs + 1]
                goal = pin.SE3(path.Ts_world_palm[n])
                for _ in range(FIRST_ROUNDS if np.isinf(steady) else 1):
                    q[n, arm.dofs + 1] = _solve(
                        arm, q[n], scripted, offset, steady, goal, path.turn, path.share[n]
                    )
                    offset = q[n, arm.dofs + 1] - scripted
            steady = STEADY_RAD
    return replace(motion, q=q)


@dataclass(frozen=True)
class _Arm:
    """What the solver needs of one arm."""

    body: Body
    data: pin.Data
    dofs: ndarray
    sigma: ndarray
    hand: int
    upper: int
    forearm: int
    distal: int
    chest: int
    T_hand_palm: pin.SE3
    measures: Measures

    @staticmethod
    def of(body: Body, side: str, measures: Measures) -> _Arm:
        frame = body.model.getFrameId
        return _Arm(
            body,
            body.model.createData(),
            np.array([body.dof(f"{side}_{hinge}") for hinge in ARM_HINGES]),
            np.radians(list(ARM_HINGES.values())),
            frame(f"{side}_hand"),
            frame(f"{side}_upper_arm"),
            frame(f"{side}_forearm"),
            frame(f"{side}_forearm_distal"),
            frame("chest"),
            palm_in_hand(body, side),
            measures,
        )


def _solve(
    arm: _Arm,
    q: Float[ndarray, " nq"],
    scripted: Float[ndarray, " k"],
    offset: Float[ndarray, " k"],
    steady_rad: float,
    goal: pin.SE3,
    turn: tuple[float, float, float],
    share: float,
) -> Float[ndarray, " k"]:
    """Angles of one arm in one frame [rad]."""
    body, data, q = arm.body, arm.data, q.copy()
    lower, upper = body.lower[arm.dofs] + 0.002, body.upper[arm.dofs] - 0.002
    start = scripted + offset
    returning = 1.0 + RETURNING * (1.0 - share) ** 2
    posture, steady = returning / arm.sigma**2, 1.0 / (steady_rad * returning) ** 2
    weights = np.concatenate([np.full(3, 1.0 / PALM_SIGMA_M), np.array(turn) / TURN_SIGMA_RAD])
    X = arm.T_hand_palm.inverse().action
    q[arm.dofs + 1] = scripted
    pin.forwardKinematics(body.model, data, q)
    here = pin.updateFramePlacement(body.model, data, arm.hand) * arm.T_hand_palm
    way = pin.log3(here.rotation.T @ goal.rotation)
    shoulder = pin.updateFramePlacement(body.model, data, arm.upper).translation
    target = pin.SE3(
        here.rotation @ pin.exp3(share * way),
        here.translation + share * (goal.translation - here.translation),
    )
    wrist = target * arm.T_hand_palm.inverse()
    most = FURTHEST * arm.measures.arm_m
    excess = max(0.0, 1.0 - most / float(np.linalg.norm(wrist.translation - shoulder)))
    target.translation = target.translation + excess * (shoulder - wrist.translation)
    q[arm.dofs + 1] = np.clip(start, lower, upper)
    for _ in range(ITERATIONS):
        pin.computeJointJacobians(body.model, data, q)
        pin.updateFramePlacements(body.model, data)
        palm = data.oMf[arm.hand] * arm.T_hand_palm
        local = pin.ReferenceFrame.LOCAL
        J = weights[:, None] * (
            X @ pin.getFrameJacobian(body.model, data, arm.hand, local)[:, arm.dofs]
        )
        difference = palm.actInv(target)
        r = weights * np.concatenate([difference.translation, pin.log3(difference.rotation)])
        clear_r, clear_J = _clearance(arm, share)
        before = q[arm.dofs + 1].copy()
        pull = posture * (scripted - before) + steady * (start - before)
        H = J.T @ J + clear_J.T @ clear_J + np.diag(posture + steady)
        slope = J.T @ r + clear_J.T @ clear_r + pull
        at_limit = ((before <= lower) & (slope < 0.0)) | ((before >= upper) & (slope > 0.0))
        free = np.flatnonzero(~at_limit)
        step = np.zeros(len(slope))
        step[free] = np.linalg.solve(H[np.ix_(free, free)], slope[free])
        q[arm.dofs + 1] = np.clip(before + np.clip(step, -0.3, 0.3), lower, upper)
        if np.abs(q[arm.dofs + 1] - before).max() < CONVERGED_RAD:
            break
    return q[arm.dofs + 1]


def _clearance(arm: _Arm, share: float) -> tuple[Float[ndarray, " 2"], Float[ndarray, "2 k"]]:
    """How deep elbow and middle of the forearm are in the trunk, an elliptic cylinder."""
    m, data, model = arm.measures, arm.data, arm.body.model
    T_chest = data.oMf[arm.chest]
    half = np.array([m.half_depth_m + ARM_RADIUS_M, m.half_width_m + ARM_RADIUS_M])
    r, J = np.zeros(2), np.zeros((2, len(arm.dofs)))
    world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    for k, frame in enumerate((arm.forearm, arm.distal)):
        x = T_chest.actInv(data.oMf[frame].translation)
        rho = np.hypot(*((x[:2] - [m.middle_x_m, 0.0]) / half))
        if not 1e-3 < rho < 1.0:
            continue
        ends = (m.shoulder[2] - x[2], x[2] + m.pelvis_chest[2] + ARM_RADIUS_M)
        inside = float(np.prod(np.clip(np.array(ends) / FADE_M, 0.0, 1.0)))
        slope = (x[:2] - [m.middle_x_m, 0.0]) / (half**2 * rho)
        J_point = pin.getFrameJacobian(model, data, frame, world)[:3, arm.dofs]
        scale = inside * share * half.min() / CLEAR_SIGMA_M
        r[k] = scale * (1.0 - rho)
        J[k] = scale * slope @ (T_chest.rotation.T @ J_point)[:2]
    return r, J

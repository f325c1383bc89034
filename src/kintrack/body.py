# SPDX-License-Identifier: Apache-2.0
"""The URDF human: its kinematic tree in Pinocchio and the joints that kintrack reports."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin
from jaxtyping import Bool, Float, Int
from numpy import ndarray

from kintrack.errors import ModelError
from kintrack.joints import JOINT_NAMES
from kintrack.rig import Rig, load_rig, model_folder

FRAME_OF_JOINT = {
    "pelvis": "pelvis",
    "spine": "abdomen",
    "chest": "chest",
    "neck": "head",
    "head": "head_center",
    **{
        f"{s}_{joint}": f"{s}_{frame}"
        for s in "lr"
        for joint, frame in (
            ("shoulder", "upper_arm"),
            ("elbow", "forearm"),
            ("wrist", "hand"),
            ("hand", "hand_center"),
            ("hip", "thigh"),
            ("knee", "shank"),
            ("ankle", "foot"),
            ("foot", "toe_base"),
        )
    },
}
"""Reported joint centre -> URDF frame whose origin it is. `neck` is the base of the skull."""


class Scratch(threading.local):
    """Pinocchio's work space, one for each thread, so that tracks may be followed side by side."""

    def __init__(self, model: pin.Model):
        """Make the present thread's; every other thread's is made when it first asks."""
        self.model, self.data = model, model.createData()

    def __reduce__(self) -> tuple[type[Scratch], tuple[pin.Model]]:
        return Scratch, (self.model,)


@dataclass(frozen=True)
class Body:
    """Kinematic tree with a free-flyer root; q is (x y z, qx qy qz qw, hinges), v is (48,)."""

    model: pin.Model
    """Pinocchio model, nq = 49, nv = 48."""
    link_names: tuple[str, ...]
    """Links that carry skin, parents before children."""
    link_joints: Int[ndarray, " l"]
    """Pinocchio joint that moves each link."""
    support: Bool[ndarray, "l nv"]
    """True where a velocity component moves a link."""
    joint_frames: Int[ndarray, " j"]
    """Pinocchio frame of each of `JOINT_NAMES`."""
    lower: Float[ndarray, " nv"]
    """Lower bound per velocity component [rad]; -inf for the root."""
    upper: Float[ndarray, " nv"]
    """Upper bound per velocity component [rad]; inf for the root."""
    joint_support: Bool[ndarray, "j nv"]
    """True where a velocity component moves a reported joint."""
    scratch: Scratch
    """Work space of `run_kinematics`; what it computes is copied out."""

    @property
    def nq(self) -> int:
        """Length of q."""
        return self.model.nq

    @property
    def nv(self) -> int:
        """Length of v, the tangent space."""
        return self.model.nv

    def neutral(self) -> Float[ndarray, " nq"]:
        """Standing at the origin with hanging arms."""
        return pin.neutral(self.model)

    def dof(self, joint: str) -> int:
        """Index into v of a hinge, by its URDF name.

        Raises:
            ModelError: if the body has no such hinge.
        """
        if not self.model.existJointName(joint):
            names = ", ".join(list(self.model.names)[2:])
            raise ModelError(f"no joint {joint!r} in the body; it has: {names}")
        return self.model.joints[self.model.getJointId(joint)].idx_v

    def integrate(self, q: Float[ndarray, " nq"], v: Float[ndarray, " nv"]) -> ndarray:
        """Q moved by the tangent vector v (`pin.integrate`)."""
        return pin.integrate(self.model, q, v)

    def difference(self, q0: Float[ndarray, " nq"], q1: Float[ndarray, " nq"]) -> ndarray:
        """Tangent vector from q0 to q1 (`pin.difference`)."""
        return pin.difference(self.model, q0, q1)


@dataclass(frozen=True)
class BodyState:
    """A body whose kinematics have been run at q; world frame."""

    body: Body
    """The body."""
    q: Float[ndarray, " nq"]
    """Configuration."""
    Ts_world_link: Float[ndarray, "l 4 4"]
    """Pose of every skin-carrying link."""
    J_world: Float[ndarray, "6 nv"]
    """Spatial motion of each velocity component (linear at the world origin, angular).

    A point x of a link that component k moves has velocity `J[:3, k] + J[3:, k] x x`.
    """
    joint_positions_world: Float[ndarray, "j 3"]
    """Reported joint centres [m], order of `JOINT_NAMES`."""


def load_body(folder: Path | None = None, shape: Float[ndarray, " k"] | None = None) -> Body:
    """Read the human's URDF and put it on a free-flyer.

    Args:
        folder: Folder with `human.urdf` and `skin/`; the one that ships if None.
        shape: Shape coefficients [standard deviations]; the average adult if None.

    Returns:
        The body.

    Raises:
        ModelError: if the file is missing, is no URDF, or lacks a frame that kintrack needs.
    """
    folder = model_folder() if folder is None else Path(folder)
    _urdf(folder)
    return rigged_body(folder, load_rig(folder, shape))


def rigged_body(folder: Path, rig: Rig) -> Body:
    """Read the human's URDF and move its joints to where a rig has them.

    Args:
        folder: Folder with `human.urdf` and `skin/`.
        rig: Bind frames of a person, turned as those of the model are.

    Returns:
        The body.

    Raises:
        ModelError: as `load_body`.
    """
    urdf = _urdf(folder)
    try:
        model = pin.buildModelFromUrdf(str(urdf), pin.JointModelFreeFlyer())
    except (ValueError, RuntimeError) as error:
        raise ModelError(f"{urdf}: not a readable URDF ({error})") from error
    names = rig.link_names
    needed = set(FRAME_OF_JOINT.values()) | set(names)
    missing = sorted(name for name in needed if not model.existFrame(name))
    if missing:
        raise ModelError(f"{urdf}: lacks the frames {', '.join(missing)}, which kintrack needs")
    _move_origins(model, rig, load_rig(folder))
    joints = np.array([model.frames[model.getFrameId(n)].parentJoint for n in names])
    lower = np.full(model.nv, -np.inf)
    upper = np.full(model.nv, np.inf)
    for joint in list(model.joints)[2:]:
        lower[joint.idx_v] = model.lowerPositionLimit[joint.idx_q]
        upper[joint.idx_v] = model.upperPositionLimit[joint.idx_q]
    frames = np.array([model.getFrameId(FRAME_OF_JOINT[name]) for name in JOINT_NAMES])
    return Body(
        model=model,
        link_names=names,
        link_joints=joints,
        support=_support(model, joints),
        joint_frames=frames,
        lower=lower,
        upper=upper,
        joint_support=_support(model, [model.frames[int(f)].parentJoint for f in frames]),
        scratch=Scratch(model),
    )


def _urdf(folder: Path) -> Path:
    """The model's URDF, which must be there."""
    urdf = folder / "human.urdf"
    if not urdf.is_file():
        raise ModelError(f"{urdf}: no such file; a URDF of the human is needed")
    return urdf


def _support(model: pin.Model, joints) -> Bool[ndarray, "n nv"]:
    """True where a velocity component moves what hangs on a joint."""
    support = np.zeros((len(joints), model.nv), dtype=bool)
    for row, joint in zip(support, joints, strict=True):
        for ancestor in list(model.supports[int(joint)])[1:]:
            j = model.joints[ancestor]
            row[j.idx_v : j.idx_v + j.nv] = True
    return support


def _move_origins(model: pin.Model, rig: Rig, average: Rig) -> None:
    """Shift joint origins and fixed frames from the average body's to a person's."""
    moved = dict(zip(rig.link_names, rig.Ts_root_link[:, :3, 3], strict=True))
    before = dict(zip(rig.link_names, average.Ts_root_link[:, :3, 3], strict=True))
    R = dict(zip(rig.link_names, rig.Ts_root_link[:, :3, :3], strict=True))
    for name in rig.link_names[1:]:
        joint = model.frames[model.getFrameId(name)].parentJoint
        chain = [joint]
        while (owner := _link_of(model, model.parents[chain[-1]], rig.link_names)) is None:
            chain.append(model.parents[chain[-1]])
        delta = (moved[name] - before[name]) - (moved[owner] - before[owner])
        placement = model.jointPlacements[chain[-1]]
        placement.translation = placement.translation + R[owner].T @ delta
        model.jointPlacements[chain[-1]] = placement
    for name, offset in rig.extra_offsets.items():
        frame = model.frames[model.getFrameId(name)]
        owner = _link_of(model, frame.parentJoint, rig.link_names)
        assert owner is not None
        placement = frame.placement
        placement.translation = placement.translation + R[owner].T @ (
            offset - (moved[owner] - before[owner])
        )
        frame.placement = placement


def _link_of(model: pin.Model, joint: int, names: tuple[str, ...]) -> str | None:
    """The skin-carrying link that a joint moves, None for a joint between hinges."""
    for name in names:
        if model.frames[model.getFrameId(name)].parentJoint == joint:
            return name
    return None


def run_kinematics(body: Body, q: Float[ndarray, " nq"]) -> BodyState:
    """Forward kinematics and Jacobians at q.

    Args:
        body: The body.
        q: Configuration, shape (nq,).

    Returns:
        A state whose poses are current.
    """
    model, data = body.model, body.scratch.data
    J_world = pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    Ts = np.empty((len(body.link_joints), 4, 4))
    for T, joint in zip(Ts, body.link_joints, strict=True):
        T[:] = data.oMi[int(joint)].homogeneous
    positions = np.array([data.oMf[int(frame)].translation for frame in body.joint_frames])
    return BodyState(body, np.array(q), Ts, np.array(J_world, order="C"), positions)


def joint_jacobians(state: BodyState) -> Float[ndarray, "j 3 nv"]:
    """Derivative of the reported joint centres with respect to v, world frame, shape (J, 3, nv)."""
    lin, ang = state.J_world[:3], state.J_world[3:]
    x = state.joint_positions_world
    turned = ang[_NEXT][None] * x[:, _AFTER, None] - ang[_AFTER][None] * x[:, _NEXT, None]
    return np.where(state.body.joint_support[:, None, :], lin[None] + turned, 0.0)


_NEXT, _AFTER = [1, 2, 0], [2, 0, 1]


def leg_length(body: Body) -> float:
    """From hip through knee to ankle, left [m]."""
    joints = run_kinematics(body, body.neutral()).joint_positions_world
    hip, knee, ankle = (joints[JOINT_NAMES.index(f"l_{n}")] for n in ("hip", "knee", "ankle"))
    return float(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle))

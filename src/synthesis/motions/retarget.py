# SPDX-License-Identifier: Apache-2.0
"""From joint centres of one person to q(t) of another.

Frame by frame the solver turns the person's bones along the clip's and puts the hips where the
clip has them, in the person's size. Then the feet are planted (`contacts`), the whole body follows
them, and the legs are solved once more, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray
from scipy.ndimage import gaussian_filter1d

from kintrack.body import Body, run_kinematics
from kintrack.joints import JOINT_NAMES
from kintrack.residuals.linearization import Residual
from kintrack.residuals.prior import diagonal_prior
from kintrack.solver.gauss_newton import solve
from synthesis.motions.contacts import FootPath, floor_height_m, foot_path, standing
from synthesis.motions.grounding import lowered, stood
from synthesis.motions.legs import yaw_matrix
from synthesis.motions.mocap import Clip, despiked, facing_x, mirrored_clip
from synthesis.motions.motion import Motion
from synthesis.motions.pull import Pull
from synthesis.motions.targets import AXES, BONES, Targets, targets_of
from synthesis.people.person import Person
from synthesis.people.population import SIDES

HIPS_M = 0.01
"""Standard deviation of where the hips are [m]."""
FOLLOW_M, FOLLOW_RAD = 0.002, 0.01
"""Standard deviations of a foot on its path: of the ankle [m], of the axes [rad]."""
REST_RAD = 1.0
"""Pull of every hinge towards the zero pose, standard deviation [rad]."""
STIFFER_RAD = {
    "clavicle": 0.5,
    "forearm_pronation": 0.5,
    "head_rotation": 0.3,
    "neck_flexion": 0.6,
    "neck_lateral": 0.3,
    "neck_rotation": 0.3,
    "head_lateral": 0.3,
    "ankle_inversion": 0.12,
    "wrist": 0.5,
}
"""The same of hinges that the clip hardly shows, by the beginning of their name [rad]."""
STILL_RAD = 0.3
"""How far a hinge moves from one frame to the next, standard deviation [rad]."""
SMOOTH_S = 0.025
"""Standard deviation of the Gaussian that rounds the solved frames [s]."""
STRAIGHT_RAD = 0.02
"""Knees and elbows are bent by this at least [rad]."""
FIRST_STEPS, STEPS = 60, 5
"""Steps of the solver in the first frame, which starts from standing, and in the others."""
BENT_RAD = 0.4
"""Knees and elbows from which the first frame is solved [rad]."""


def retarget(person: Person, clip: Clip, mirrored: bool = False) -> Motion:
    """Let a person do what a clip shows.

    Args:
        person: Who, of any shape.
        clip: What; joint names of `JOINT_NAMES`, z up.
        mirrored: Change left and right.

    Returns:
        The motion at the clip's times, within the limits of every hinge. It starts at the origin,
        looking along x; feet that stand on the clip's floor stand on z = 0 and do not slide.
    """
    clip = facing_x(despiked(mirrored_clip(clip) if mirrored else clip))
    rate_hz, body = clip.rate_hz(), _bent_forward(person.body)
    targets = targets_of(person, clip)
    q = _smoothed(body, _follow(body, targets), rate_hz)
    floor_m = floor_height_m(clip)
    feet = {
        side: foot_path(
            person,
            side,
            _link_poses(body, q, f"{side}_foot"),
            standing(clip, side, floor_m),
            rate_hz,
        )
        for side in SIDES
    }
    q = _smoothed(body, _follow(body, targets, feet, q), rate_hz)
    q = lowered(body, q, feet, rate_hz)
    for n in range(len(q)):
        Ts = {side: path.Ts_world_foot[n] for side, path in feet.items()}
        free = [s for s, p in feet.items() if not any(a <= n < b for a, b in p.contacts)]
        q[n] = stood(person, body, q[n], Ts, free)
    return Motion(
        clip.times_s, _from_origin(q), {side: path.planted for side, path in feet.items()}
    )


def _follow(
    body: Body,
    targets: Targets,
    feet: dict[str, FootPath] | None = None,
    start: Float[ndarray, "n nq"] | None = None,
) -> Float[ndarray, "n nq"]:
    """Solve every frame, each from the one before.

    Args:
        body: The body.
        targets: Where bones point and the hips are.
        feet: Paths that the feet must follow, if known.
        start: Configurations to start from and to stay near, if known.

    Returns:
        Configurations, shape (N, nq).
    """
    q = _standing(body, targets)
    rest_sigma = _rest_sigma(body)
    still_sigma = np.full(body.nv, STILL_RAD)
    still_sigma[:6] = np.inf
    rest = diagonal_prior(body.neutral(), rest_sigma)
    out = np.empty((len(targets.hips), body.nq))
    damping = 1e-4
    for n in range(len(out)):
        known = q if start is None else start[n]
        terms: list[Residual] = [_pull(body, targets, n, feet), rest]
        if n or start is not None:
            terms.append(diagonal_prior(known, still_sigma))
        steps = FIRST_STEPS if n == 0 else STEPS
        solution = solve(body, run_kinematics(body, known), terms, steps, damping)
        out[n] = q = solution.state.q
        damping = min(solution.damping, 1e-3)
    return out


def _pull(body: Body, targets: Targets, n: int, feet: dict[str, FootPath] | None) -> Pull:
    """The targets of one frame, with the feet on their paths if those are known."""
    row = {name: k for k, name in enumerate(JOINT_NAMES)}
    link = {name: k for k, name in enumerate(body.link_names)}
    bones = [(row[p], row[c], targets.bones[n, k], s) for k, (p, c, s) in enumerate(BONES)]
    axes = [(link[name], a, targets.axes[n, k], s) for k, (name, a, s) in enumerate(AXES)]
    joints = [(row["pelvis"], targets.hips[n], HIPS_M)]
    for side, path in (feet or {}).items():
        T = path.Ts_world_foot[n]
        axes += [(link[f"{side}_foot"], a, T.rotation[:, a], FOLLOW_RAD) for a in range(3)]
        joints.append((row[f"{side}_ankle"], T.translation, FOLLOW_M))
    return Pull(_columns(bones), _columns(axes), _columns(joints))


def _columns(rows: Sequence[tuple]) -> tuple:
    """Columns of a table as arrays."""
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def _rest_sigma(body: Body) -> Float[ndarray, " nv"]:
    """Standard deviation of each hinge about the zero pose [rad]; inf for the root."""
    sigma = np.full(body.nv, REST_RAD)
    sigma[:6] = np.inf
    for joint in list(body.model.names)[2:]:
        name = joint[2:] if joint[:2] in ("l_", "r_") else joint
        for beginning, value in STIFFER_RAD.items():
            if name.startswith(beginning):
                sigma[body.dof(joint)] = value
    return sigma


def _standing(body: Body, targets: Targets) -> Float[ndarray, " nq"]:
    """Slightly bent at the first frame's place, from where its solve starts."""
    q = body.neutral()
    T = pin.SE3(targets.Rs_world_pelvis[0], targets.hips[0])
    q[:7] = pin.SE3ToXYZQUAT(T)
    for side in SIDES:
        for hinge in ("knee_flexion", "elbow_flexion", "hip_flexion"):
            q[body.dof(f"{side}_{hinge}") + 1] = BENT_RAD
    return q


def _link_poses(body: Body, q: Float[ndarray, "n nq"], link: str) -> list[pin.SE3]:
    """T_world_link in every frame."""
    k = body.link_names.index(link)
    return [pin.SE3(run_kinematics(body, row).Ts_world_link[k]) for row in q]


def _smoothed(body: Body, q: Float[ndarray, "n nq"], rate_hz: float) -> Float[ndarray, "n nq"]:
    """Configurations averaged under a Gaussian in time; convex limits stay met."""
    out = np.array(q)
    flips = np.where((q[1:, 3:7] * q[:-1, 3:7]).sum(axis=1) < 0.0, -1.0, 1.0)
    out[1:, 3:7] *= np.cumprod(flips)[:, None]
    out = gaussian_filter1d(out, SMOOTH_S * rate_hz, axis=0, mode="nearest", truncate=3.0)
    out[:, 3:7] /= np.linalg.norm(out[:, 3:7], axis=1, keepdims=True)
    out[:, 7:] = np.clip(out[:, 7:], body.lower[6:], body.upper[6:])
    return out


def _bent_forward(body: Body) -> Body:
    """The body with knees and elbows that cannot be bent backwards."""
    lower = body.lower.copy()
    for side in SIDES:
        for hinge in ("knee_flexion", "elbow_flexion"):
            lower[body.dof(f"{side}_{hinge}")] = STRAIGHT_RAD
    return replace(body, lower=lower)


def _from_origin(q: Float[ndarray, "n nq"]) -> Float[ndarray, "n nq"]:
    """The motion turned and moved over the floor so that it starts at the origin, along x."""
    R0 = pin.XYZQUATToSE3(q[0, :7]).rotation
    R = yaw_matrix(-np.arctan2(-R0[0, 1], R0[1, 1]))
    T = pin.SE3(R, -R @ (q[0, :3] * [1.0, 1.0, 0.0]))
    out = np.array(q)
    for row in out:
        row[:7] = pin.SE3ToXYZQUAT(T * pin.XYZQUATToSE3(row[:7]))
    return out

# SPDX-License-Identifier: Apache-2.0
"""A performance somewhere else on the floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from jaxtyping import Float
from numpy import ndarray

from synthesis.motions.legs import yaw_matrix
from synthesis.motions.performance import Performance


def floor_pose(x_m: float, y_m: float, yaw_rad: float) -> Float[ndarray, "4 4"]:
    """A transform that shifts along the floor and turns about z, shape (4, 4)."""
    T = np.eye(4)
    T[:3, :3] = yaw_matrix(yaw_rad)
    T[:2, 3] = x_m, y_m
    return T


def moved(performance: Performance, T_world_start: Float[ndarray, "4 4"]) -> Performance:
    """The same performance from another place and heading.

    Args:
        performance: Whose origin is where the person starts.
        T_world_start: Where that should be; a `floor_pose`, so that the floor stays z = 0.

    Returns:
        The performance, person and props moved together.
    """
    q, T = performance.motion.q.copy(), pin.SE3(T_world_start)
    for row in q:
        row[:7] = pin.SE3ToXYZQUAT(T * pin.XYZQUATToSE3(row[:7]))
    props = tuple(
        replace(prop, Ts_world_thing=T_world_start @ prop.Ts_world_thing)
        for prop in performance.props
    )
    return replace(performance, motion=replace(performance.motion, q=q), props=props)

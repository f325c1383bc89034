# SPDX-License-Identifier: Apache-2.0
"""The human, a camera, legal poses and depth pictures of them, shared by the tests of the core."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from kintrack.body import Body, run_kinematics
from kintrack.clothing import dressed_human
from kintrack.config import TrackerConfig
from kintrack.geometry import (
    T_LEVEL_WORLD_CAMERA,
    PinholeCamera,
    invert_rigid,
    transform_points,
)
from kintrack.human import RESTING_DEG, Human, load_human, posed
from kintrack.raster import rasterise
from kintrack.sequence.frame import Frame
from kintrack.skin import skinned_vertices

ROOT = Path(__file__).resolve().parents[1]
STEP = 1e-6
"""Half width of the central differences [m or rad]."""


@dataclass(frozen=True)
class Scene:
    """A person before a level camera at the world's origin, and what it sees."""

    human: Human
    camera: PinholeCamera

    def place(self, degrees=None, heading_deg=0.0, at=(2.8, 0.0, 0.0)):
        """Configuration of a person who looks at the camera when the heading is 0."""
        q = posed(self.human.body, RESTING_DEG | (degrees or {}))
        yaw = np.pi + np.radians(heading_deg)
        q[:3], q[3:7] = at, [0, 0, np.sin(yaw / 2), np.cos(yaw / 2)]
        return q

    def depth(self, q, human=None, wall_m=0.0):
        """Noiseless depth [m] of the tracking skin, before a wall if one is wanted."""
        human = human or self.human
        vertices = skinned_vertices(run_kinematics(human.body, q), human.skin)
        seen, _ = rasterise(
            transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), vertices),
            human.skin.faces,
            self.camera,
        )
        return np.where(np.isfinite(seen), seen, wall_m).astype(np.float32)

    def frame(self, depth_m, index=0, rate_hz=30.0):
        return Frame(index, index / rate_hz, self.camera, depth_m)

    def room(self, index=0, wall_m=4.5):
        """A frame of a wall with nobody before it."""
        shape = (self.camera.height, self.camera.width)
        return self.frame(np.full(shape, wall_m, dtype=np.float32), index)

    def joints(self, q, human=None):
        """True joint centres in the camera frame [m]."""
        state = run_kinematics((human or self.human).body, q)
        return transform_points(invert_rigid(T_LEVEL_WORLD_CAMERA), state.joint_positions_world)

    def errors(self, q, joints_camera):
        """Distance of every joint from the truth [m]."""
        return np.linalg.norm(joints_camera - self.joints(q), axis=1)


@pytest.fixture(scope="session")
def model_folder() -> Path:
    return ROOT / "model"


@pytest.fixture(scope="session")
def human() -> Human:
    return load_human()


@pytest.fixture(scope="session")
def body(human) -> Body:
    return human.body


@pytest.fixture(scope="session")
def scene() -> Scene:
    return Scene(dressed_human(), PinholeCamera(320, 240, 286.0, 286.0, 159.5, 119.5))


@pytest.fixture(scope="session")
def unsized() -> TrackerConfig:
    """The defaults without sizing the person, who is the average adult in these tests."""
    config = TrackerConfig()
    return replace(config, start=replace(config.start, shape_coefficients=0))


@pytest.fixture(scope="session")
def quick(unsized) -> TrackerConfig:
    """As `unsized`, and the person stands as expected, so that a start needs few rounds."""
    return replace(unsized, start=replace(unsized.start, rounds=8))


@pytest.fixture(scope="session")
def legal_pose(body):
    """A function of a seed: any root, every hinge anywhere within its limits."""

    def draw(seed):
        rng = np.random.default_rng(seed)
        q = body.neutral()
        q[:3], q[3:7] = rng.normal(size=3), rng.normal(size=4)
        q[3:7] /= np.linalg.norm(q[3:7])
        q[7:] = rng.uniform(body.lower[6:], body.upper[6:])
        return q

    return draw


@pytest.fixture(scope="session")
def differences(body):
    """A function (of_state, q): its derivative by central differences through `pin.integrate`."""

    def derive(of_state, q):
        def at(v):
            return np.asarray(of_state(run_kinematics(body, body.integrate(q, v))))

        steps = STEP * np.eye(body.nv)
        return np.stack([(at(v) - at(-v)) / (2 * STEP) for v in steps], axis=-1)

    return derive

# SPDX-License-Identifier: Apache-2.0
"""Arms that go anywhere: whatever the body does, its arms wander through all postures they have.

Authored and captured motions know a few dozen postures of arms, and a network learns to tell an arm
by them. Here every hinge is drawn within its limits; what goes through trunk, head, legs or the
other arm is drawn again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray
from scipy.spatial import cKDTree

from kintrack.body import BodyState, run_kinematics
from kintrack.skin import Skin, skinned_vertices, vertex_normals
from synthesis.motions.actions import Things
from synthesis.motions.actions.frames import draw_thing, place_of
from synthesis.motions.actions.small_things import phone_in_palm, upright_in_fist
from synthesis.motions.curves import keyed
from synthesis.motions.holding import in_hand
from synthesis.motions.motion import LIMIT_MARGIN_RAD, RATE_HZ, Motion
from synthesis.motions.performance import Performance, Prop
from synthesis.people.person import SIDES, Person

DRAWN_DEG = {
    "shoulder_elevation": None,
    "shoulder_plane": None,
    "shoulder_rotation": None,
    "elbow_flexion": None,
    "forearm_pronation": None,
    "clavicle_protraction": (0.0, 8.0),
    "wrist_flexion": (0.0, 22.0),
    "wrist_deviation": (0.0, 10.0),
}
"""Hinge -> mean and standard deviation [deg]; None: evenly between its limits."""
ARM_HINGES = (*DRAWN_DEG, "clavicle_elevation")
"""Every hinge that is set, without its side."""
CLAVICLE_SHARE = 0.12
"""Rise of the clavicle for the rise of the upper arm."""
STRAIGHT, STRAIGHT_DEG = 0.35, 35.0
"""Share of postures whose elbow is bent by less than that."""
LOW = 0.5
"""Share of postures whose upper arm hangs, more or less: people keep their arms down mostly."""
LOW_DEG = {"shoulder_elevation": (-5.0, 50.0), "shoulder_plane": (-35.0, 55.0)}
"""Range of the hinges then [deg]."""
FURTHEST_BACK = -0.7
"""How far behind the chest an upper arm points at most, of its length; raised, half of that."""
SPEED_DEG_S = (60.0, 260.0)
"""Fastest hinge on the way from posture to posture, slowest and fastest way [deg/s]."""
HOLD_S = (0.0, 0.9)
"""How long a posture is held [s]; shorter the longer a way on is looked for."""
STAY_S = 0.3
"""How long an arm stays where none is found [s]."""
CLEAR_M = 0.012
"""How far the skin of an arm stays from other skin [m]; clothes need some of it."""
EVERY = 4
"""Frames from one look at the skin to the next."""
TRIES = 60
"""Draws before an arm stays where it is."""
ARM_STEP, BODY_STEP = 9, 2
"""Every how many vertices are looked at."""
IN_HAND = ("cup", "bottle", "phone")
"""What a hand may hold meanwhile."""
HOLDING = 0.4
"""Chance that one does."""
REACHING_OUT = ("forearm", "forearm_distal", "hand")
"""Links whose skin must stay clear, with the half of the upper arm at the elbow."""


def roaming(
    person: Person, performance: Performance, rng: np.random.Generator, things: Things
) -> Performance:
    """A performance whose arms wander, at times with a small thing in one hand.

    Args:
        person: Who.
        performance: What she does; one with things in her hands stays as it is.
        rng: Draws.
        things: Draws things by kind, those of `IN_HAND` among them.
    """
    if any(prop.held for prop in performance.props):
        return performance
    motion = roam(person, performance.motion, rng)
    if rng.random() > HOLDING:
        return replace(performance, motion=motion)
    side, kind = str(rng.choice(SIDES)), str(rng.choice(IN_HAND))
    thing = draw_thing(things, kind, rng)
    grip = (
        phone_in_palm(thing)
        if kind == "phone"
        else (upright_in_fist(side), place_of(thing, "handle"))
    )
    held = Prop(thing, in_hand(person, motion, side, *grip), held=True)
    return replace(performance, motion=motion, props=(*performance.props, held))


def roam(person: Person, motion: Motion, rng: np.random.Generator) -> Motion:
    """Let both arms wander.

    Args:
        person: Who.
        motion: What she does; trunk, head and legs are kept.
        rng: Draws postures and times.

    Returns:
        The motion with other arms, within limits. Where no way out is found an arm stays.
    """
    q = motion.q.copy()
    looks = np.unique([*range(0, len(q), EVERY), len(q) - 1])
    for side in rng.permutation(SIDES):
        arm = _Arm.of(person, str(side))
        near = [arm.surroundings(q[n]) for n in looks]
        knots = [(0.0, _first(arm, q, looks, near, rng))]
        while knots[-1][0] < motion.times_s[-1]:
            knots += _onwards(arm, q, looks, near, knots[-1], rng)
        _follow(arm, q, motion.times_s, knots)
    return replace(motion, q=q)


@dataclass(frozen=True)
class _Arm:
    """One arm of a person, and the skin it may not touch."""

    person: Person
    columns: ndarray
    """Where its hinges are in q, in the order of `ARM_HINGES`."""
    lower: ndarray
    upper: ndarray
    links: tuple[int, int, int]
    """Chest, upper arm, forearm."""
    skin: Skin
    """Of the arm, thinned."""
    others: ndarray
    """Vertices that are not the arm's, thinned."""

    @staticmethod
    def of(person: Person, side: str) -> _Arm:
        body, skin = person.body, person.skin
        dofs = np.array([body.dof(f"{side}_{h}") for h in ARM_HINGES])
        number = {name: n for n, name in enumerate(skin.link_names)}
        main = skin.links[np.arange(len(skin.links)), skin.weights.argmax(axis=1)]
        outer = np.isin(main, [number[f"{side}_{name}"] for name in REACHING_OUT])
        upper_arm, forearm = number[f"{side}_upper_arm"], number[f"{side}_forearm"]
        elbow = person.rig.Ts_root_link[forearm][:3, 3]
        half = np.linalg.norm(elbow - person.rig.Ts_root_link[upper_arm][:3, 3]) / 2.0
        lower_half = np.linalg.norm(person.bind_vertices - elbow, axis=1) < half
        own = main == upper_arm
        looked = np.flatnonzero(outer | (own & lower_half))[::ARM_STEP]
        others = np.flatnonzero(~outer & ~own & (main != number[f"{side}_clavicle"]))[::BODY_STEP]
        return _Arm(
            person,
            dofs + 1,
            body.lower[dofs] + LIMIT_MARGIN_RAD,
            body.upper[dofs] - LIMIT_MARGIN_RAD,
            (number["chest"], upper_arm, forearm),
            replace(
                skin,
                links=skin.links[looked],
                weights=skin.weights[looked],
                points_link=np.ascontiguousarray(skin.points_link[looked]),
            ),
            others,
        )

    def surroundings(self, q: Float[ndarray, " nq"]) -> tuple[cKDTree, Float[ndarray, "n 3"]]:
        """The skin round the arm and its normals, in one frame."""
        skin = self.person.skin
        vertices = skinned_vertices(run_kinematics(self.person.body, q), skin)
        normals = vertex_normals(vertices, skin.faces)
        return cKDTree(vertices[self.others]), normals[self.others]

    def draw(self, rng: np.random.Generator) -> Float[ndarray, " k"]:
        """A posture, whatever it touches [rad]."""
        even = rng.uniform(self.lower, self.upper)
        angle = dict(zip(ARM_HINGES, np.degrees(even), strict=True))
        for name, drawn in DRAWN_DEG.items():
            angle[name] = angle[name] if drawn is None else rng.normal(*drawn)
        if rng.random() < STRAIGHT:
            angle["elbow_flexion"] = rng.uniform(0.0, STRAIGHT_DEG)
        if rng.random() < LOW:
            angle |= {name: rng.uniform(*ends) for name, ends in LOW_DEG.items()}
        angle["clavicle_elevation"] = CLAVICLE_SHARE * max(angle["shoulder_elevation"], 0.0)
        return np.clip(np.radians(list(angle.values())), self.lower, self.upper)

    def clear(
        self,
        q: Float[ndarray, " nq"],
        angles: Float[ndarray, " k"],
        near: tuple[cKDTree, Float[ndarray, "n 3"]],
    ) -> bool:
        """Whether the arm is where a person may have it, in one frame."""
        q = q.copy()
        q[self.columns] = angles
        state = run_kinematics(self.person.body, q)
        if not self._ahead(state):
            return False
        tree, normals = near
        points = skinned_vertices(state, self.skin)
        distance, nearest = (np.asarray(found) for found in tree.query(points))
        outside = ((points - tree.data[nearest]) * normals[nearest]).sum(axis=1)
        return bool((distance > CLEAR_M).all() and (outside > 0.0).all())

    def _ahead(self, state: BodyState) -> bool:
        """Whether the upper arm does not point further back than shoulders let it."""
        chest, upper_arm, forearm = (state.Ts_world_link[link] for link in self.links)
        way = chest[:3, :3].T @ (forearm[:3, 3] - upper_arm[:3, 3])
        x, _, z = way / np.linalg.norm(way)
        return bool(x > FURTHEST_BACK * (0.5 if z > 0.2 else 1.0))


def _first(arm: _Arm, q, looks, near, rng: np.random.Generator) -> Float[ndarray, " k"]:
    """A posture to begin with; the performance's own if nothing else is clear."""
    for _ in range(TRIES):
        angles = arm.draw(rng)
        if arm.clear(q[looks[0]], angles, near[0]):
            return angles
    return q[0, arm.columns]


def _onwards(
    arm: _Arm, q, looks, near, last: tuple[float, ndarray], rng: np.random.Generator
) -> list[tuple[float, ndarray]]:
    """The end of a hold and the next posture, with a clear way to it."""
    for left in np.linspace(1.0, 0.0, TRIES):
        start_s = last[0] + left * float(rng.uniform(*HOLD_S))
        goal = arm.draw(rng)
        furthest = float(np.degrees(np.abs(goal - last[1]).max()))
        end_s = start_s + max(0.4, furthest / rng.uniform(*SPEED_DEG_S))
        on_way = np.flatnonzero((looks >= last[0] * RATE_HZ) & (looks <= end_s * RATE_HZ))
        shares = np.clip((looks[on_way] / RATE_HZ - start_s) / (end_s - start_s), 0.0, 1.0)
        shares = shares * shares * (3.0 - 2.0 * shares)
        if all(
            arm.clear(q[looks[k]], last[1] + share * (goal - last[1]), near[k])
            for k, share in zip(on_way[::-1], shares[::-1], strict=True)
        ):
            return [(start_s, last[1]), (end_s, goal)]
    return [(last[0] + STAY_S, last[1])]


def _follow(arm: _Arm, q, times_s, knots: list[tuple[float, ndarray]]) -> None:
    """Write the curves through the postures into q."""
    times = [time_s for time_s, _ in knots]
    kept = [n for n in range(len(times)) if n == 0 or times[n] > times[n - 1] + 1e-6]
    for k, column in enumerate(arm.columns):
        curve = [(times[n], float(knots[n][1][k])) for n in kept]
        q[:, column] = np.clip(keyed(curve, times_s, RATE_HZ), arm.lower[k], arm.upper[k])

# SPDX-License-Identifier: Apache-2.0
"""How badly thinned skin and a labelled person agree, and where the skin would rather be.

The mismatch is an area integral over observation and skin, divided by the observed area [m^2]:

    ( sum_i w_i (min(d_i, cap)^2 + s^2 [other side]) + sum_v a min(f_v, cap)^2 ) / sum_i w_i

d_i from observed point i, of area w_i, to the nearest skin of its part that faces the camera. A
point of a limb may take the limb of the other side at the price s^2, since networks mistake sides.
Once a body is fitted, a point may take any part at the price p^2, as while tracking.
f_v is how far skin vertex v, of area a, sticks out into space that is seen to be free, or stands in
front of what is seen. Skin behind something nearer costs nothing.
"""

from __future__ import annotations

import numpy as np
from numba import njit

CAP_M = 0.22
"""Distances count at most so much [m]."""
FACING = 0.1
"""Least cosine between a normal and the ray for skin that can be seen."""
AT_REST_M2 = 4e-4
"""What a limb that is not at rest costs more, in squared metres of mean distance [m^2]."""
UNSEEN_M2, UNSEEN_M4 = 0.02, 3e-4
"""A limb that shows less than this [m^2] costs up to this more [m^4] if it is not at rest; an
unseen leg rests as the other one is."""
OTHER_PART_M = 0.06
"""What skin costs that lies on pixels of another part [m]."""
NEAR_M = 0.05
"""Skin this far behind what is seen is still taken to be seen [m]."""


@njit(cache=True, nogil=True)
def place(
    points, weights, ends, skins, normals, eye, R, shift,
    intrinsics, depth, away, labels, has_background, each, side2, turns, t, choice,
):  # fmt: skip
    """Mismatch of one heading and trunk, all in the root's axes; finds t and the choice of limbs.

    Six skins of shape (postures, V, 3), as the normals; only limbs have more than one posture.
    `t` and `choice` are changed; a NaN in `t` asks for a rough place first. Returns the mismatch
    and what the limbs cost that are not at rest.
    """
    chosen = np.zeros(6, dtype=np.int64)
    chosen[2:] = choice
    owner = np.zeros(len(points), dtype=np.int64)
    for k in range(6):
        owner[ends[k] : ends[k + 1]] = k
    trunk = weights[: ends[2]].sum() > 0.02
    caps2 = np.full(len(points), CAP_M * CAP_M)
    first = np.isnan(t[0])
    if first:
        t[:] = _roughly(points, weights, ends, skins, eye, trunk)
    rest = np.zeros(6, dtype=np.int64)
    for _ in range(turns):
        _rest_of_legs(weights, ends, owner, chosen, rest)
        for n in range(3):
            only = 2 if trunk and first and n < 2 else 6
            t[:] = _shifted(points, weights, ends, owner, skins, normals, chosen, t, eye, only)
        if side2 < 1.0:
            _take_sides(points, ends, owner, skins, normals, chosen, t, eye, side2)
        k = 0
        for v, n in zip(skins, normals):  # noqa: B905
            if k >= 2:
                best = np.inf
                low, high = _range(ends, k)
                for p in range(v.shape[0]):
                    cost = _part_cost(
                        points, weights, owner, low, high, v[p], n[p], t, eye, R, shift,
                        intrinsics, depth, away, labels, has_background, k, each[k], side2, caps2,
                        best,
                    ) + _unrest(weights, owner, low, high, k, p, rest[k])  # fmt: skip
                    if cost < best:
                        best = cost
                        chosen[k] = p
            k += 1
    for _ in range(2):
        t[:] = _shifted(points, weights, ends, owner, skins, normals, chosen, t, eye, 6)
    choice[:] = chosen[2:]
    cost = mismatch(
        points, weights, ends, owner, skins, normals, chosen, t, eye, R, shift,
        intrinsics, depth, away, labels, has_background, each, side2, np.inf,
    )  # fmt: skip
    unrest = 0.0
    for k in range(2, 6):
        low, high = _range(ends, k)
        unrest += _unrest(weights, owner, low, high, k, chosen[k], rest[k]) / weights.sum()
    return cost, unrest


@njit(cache=True, nogil=True)
def mismatch(
    points, weights, ends, owner, skins, normals, chosen, t, eye, R, shift,
    intrinsics, depth, away, labels, has_background, each, side2, part2,
):  # fmt: skip
    """The module's equation for chosen postures [m^2]; takes sides first. `part2` is p^2."""
    if side2 < 1.0:
        _take_sides(points, ends, owner, skins, normals, chosen, t, eye, side2)
    cost = 0.0
    caps2 = np.full(len(points), CAP_M * CAP_M)
    if part2 < CAP_M * CAP_M:
        k = 0
        for v, n in zip(skins, normals):  # noqa: B905
            for i in range(len(points)):
                j, d2 = _nearest(points[i], v[chosen[k]], n[chosen[k]], t, eye)
                caps2[i] = min(caps2[i], d2 + part2)
            k += 1
    k = 0
    for v, n in zip(skins, normals):  # noqa: B905
        low, high = _range(ends, k)
        cost += _part_cost(
            points, weights, owner, low, high, v[chosen[k]], n[chosen[k]], t, eye, R, shift,
            intrinsics, depth, away, labels, has_background, k, each[k], side2, caps2, np.inf,
        )  # fmt: skip
        for i in range(ends[k], ends[k + 1]):
            if owner[i] != k:
                cost += weights[i] * side2
        k += 1
    return cost / weights.sum()


@njit(cache=True, nogil=True)
def _range(ends, k):
    """First and last point that part k may own: its kind's."""
    if k < 2:
        return ends[k], ends[k + 1]
    first = k - k % 2
    return ends[first], ends[first + 2]


@njit(cache=True, nogil=True)
def _rest_of_legs(weights, ends, owner, chosen, rest):
    """The posture that costs an unseen leg nothing: that of the other leg, which shows more."""
    low, high = _range(ends, 4)
    right, left = _area(weights, owner, low, high, 4), _area(weights, owner, low, high, 5)
    rest[4], rest[5] = 0, 0
    if right < left:
        rest[4] = chosen[5]
    elif left < right:
        rest[5] = chosen[4]


@njit(cache=True, nogil=True)
def _area(weights, owner, low, high, k):
    """How much is seen of part k [m^2]."""
    area = 0.0
    for i in range(low, high):
        if owner[i] == k:
            area += weights[i]
    return area


@njit(cache=True, nogil=True)
def _unrest(weights, owner, low, high, k, posture, rest):
    """What it costs a limb not to be at rest, or, where it is unseen, not as the other leg."""
    area = _area(weights, owner, low, high, k)
    cost = 0.0 if posture == 0 else AT_REST_M2 * area
    return cost if posture == rest else cost + UNSEEN_M4 * max(1.0 - area / UNSEEN_M2, 0.0)


@njit(cache=True, nogil=True)
def _roughly(points, weights, ends, skins, eye, trunk):
    """The translation that brings the middles together, a hand's breadth behind the surface."""
    t, mass = np.zeros(3), 0.0
    k = 0
    for v in skins:
        if ends[k + 1] > ends[k] and (k < 2 or not trunk):
            middle = np.zeros(3)
            for j in range(v.shape[1]):
                middle += v[0, j] / v.shape[1]
            for i in range(ends[k], ends[k + 1]):
                t += weights[i] * (points[i] - middle)
                mass += weights[i]
        k += 1
    t /= mass
    behind = t - eye
    return t + 0.08 * behind / np.sqrt((behind**2).sum())


@njit(cache=True, nogil=True)
def _shifted(points, weights, ends, owner, skins, normals, chosen, t, eye, parts):
    """The translation after one closest-point step over the first parts."""
    step, mass = np.zeros(3), 0.0
    k = 0
    for v, n in zip(skins, normals):  # noqa: B905
        if k < parts:
            p = chosen[k]
            low, high = _range(ends, k)
            for i in range(low, high):
                if owner[i] != k:
                    continue
                j, d2 = _nearest(points[i], v[p], n[p], t, eye)
                if j >= 0:
                    w = weights[i] / (1.0 + d2 / 0.01)
                    mass += w
                    step += w * (points[i] - v[p, j] - t)
        k += 1
    return t + step / mass if mass > 0.0 else t


@njit(cache=True, nogil=True)
def _take_sides(points, ends, owner, skins, normals, chosen, t, eye, side2):
    """Give every point of a limb to the side that suits it better at the price of a wrong label."""
    d = np.full((2, len(points)), CAP_M * CAP_M)
    k = 0
    for v, n in zip(skins, normals):  # noqa: B905
        if k >= 2:
            low, high = _range(ends, k)
            for i in range(low, high):
                j, d2 = _nearest(points[i], v[chosen[k]], n[chosen[k]], t, eye)
                d[k % 2, i] = min(d2, CAP_M * CAP_M)
        k += 1
    for k in range(2, 6):
        other = k + 1 - 2 * (k % 2)
        for i in range(ends[k], ends[k + 1]):
            owner[i] = other if d[other % 2, i] + side2 < d[k % 2, i] else k


@njit(cache=True, nogil=True)
def _nearest(x, v, n, t, eye):
    """Nearest vertex that faces the eye, -1 if none does, and its squared distance."""
    best, at = np.inf, -1
    for j in range(v.shape[0]):
        a, b, c = v[j, 0] + t[0], v[j, 1] + t[1], v[j, 2] + t[2]
        d = (a - x[0]) ** 2 + (b - x[1]) ** 2 + (c - x[2]) ** 2
        if d < best:
            a, b, c = eye[0] - a, eye[1] - b, eye[2] - c
            towards = n[j, 0] * a + n[j, 1] * b + n[j, 2] * c
            if towards > 0.0 and towards * towards > FACING * FACING * (a * a + b * b + c * c):
                best, at = d, j
    return at, best


@njit(cache=True, nogil=True)
def _part_cost(
    points, weights, owner, low, high, v, n, t, eye, R, shift,
    intrinsics, depth, away, labels, has_background, k, each, side2, caps2, most,
):  # fmt: skip
    """Numerator of the module's equation for part k in one posture [m^4]; stops above `most`."""
    h, w = depth.shape
    cost = 0.0
    for j in range(v.shape[0]):
        a, b, c = v[j, 0] + t[0], v[j, 1] + t[1], v[j, 2] + t[2]
        ea, eb, ec = eye[0] - a, eye[1] - b, eye[2] - c
        towards = n[j, 0] * ea + n[j, 1] * eb + n[j, 2] * ec
        if towards < 0.0 or towards * towards < FACING * FACING * (ea * ea + eb * eb + ec * ec):
            continue
        x = R[0, 0] * a + R[0, 1] * b + R[0, 2] * c + shift[0]
        y = R[1, 0] * a + R[1, 1] * b + R[1, 2] * c + shift[1]
        z = R[2, 0] * a + R[2, 1] * b + R[2, 2] * c + shift[2]
        if z < 0.1:
            continue
        u = int(np.floor(intrinsics[0] * x / z + intrinsics[2] + 0.5))
        r = int(np.floor(intrinsics[1] * y / z + intrinsics[3] + 0.5))
        if u < 0 or r < 0 or u >= w or r >= h:
            continue
        seen, label = depth[r, u], labels[r, u]
        out = 0.0
        if label > 0:
            out = max(seen - z, 0.0)
            if label != k + 1 and seen > z - 0.08:
                same_kind = k >= 2 and label >= 3 and (label - 1) // 2 == k // 2
                out = max(out, min(OTHER_PART_M, np.sqrt(side2)) if same_kind else OTHER_PART_M)
        elif seen > z + NEAR_M or (seen == 0.0 and not has_background):
            out = away[r, u] * z / intrinsics[0]
        out = min(out, CAP_M)
        cost += each * out * out
    for i in range(low, high):
        if owner[i] == k:
            j, d2 = _nearest(points[i], v, n, t, eye)
            cost += weights[i] * min(d2, caps2[i])
            if cost > most:
                break
    return cost

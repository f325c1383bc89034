# SPDX-License-Identifier: Apache-2.0
"""Cutting, refining, smoothing and lengthening of a surface that is bound to the links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from numpy import ndarray
from scipy.sparse import csr_array, diags_array

SLIVER = 0.03
"""A cut passes no nearer to a corner than this share of the edge."""


@dataclass(frozen=True)
class Sheet:
    """A surface in bind pose, root frame."""

    vertices: Float[ndarray, "v 3"]
    """Vertices [m]."""
    faces: Int[ndarray, "f 3"]
    """Triangles, counter-clockwise from outside."""
    weights: Float[ndarray, "v l"]
    """Skinning weight of every link."""
    labels: UInt8[ndarray, " v"]
    """Body part of each vertex."""
    room_m: Float[ndarray, " v"]
    """How far each vertex may leave its place [m]."""
    gap_m: Float[ndarray, " v"]
    """How far each vertex may sink towards what is below it [m]."""
    edge: UInt8[ndarray, " v"]
    """Number of the cut that made each vertex, 0 = none."""
    base: Int[ndarray, " v"]
    """Vertex of the form that each vertex was, -1 = none."""
    fields: Float[ndarray, "v k"]
    """Values along which the sheet is cut, at every vertex."""


def triangulated(faces: Int[ndarray, "f 3"], keep: Bool[ndarray, " f"]) -> tuple[ndarray, ndarray]:
    """The kept faces renumbered (F', 3), and which vertices they use (V',)."""
    used, renumbered = np.unique(faces[keep], return_inverse=True)
    return renumbered.reshape(-1, 3), used


def refined(faces: Int[ndarray, "f 3"], n: int) -> tuple[ndarray, ndarray]:
    """Every triangle in four.

    Args:
        faces: Triangles, shape (F, 3).
        n: Number of vertices.

    Returns:
        Triangles (4 F, 3), and the two ends of the edge that each new vertex halves (E, 2); new
        vertices come after the n old ones.
    """
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends, place = np.unique(edges, axis=0, return_inverse=True)
    ab, bc, ca = (n + place.reshape(-1, 3)).T
    a, b, c = faces.T
    parts = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
    return np.concatenate([np.stack(part, axis=1) for part in parts]), ends


def smoother(faces: Int[ndarray, "f 3"], n: int) -> csr_array:
    """Mean of the neighbours as a matrix (n, n); on a border only the border counts."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    both = np.concatenate([edges, edges[:, ::-1]])
    count = csr_array((np.ones(len(both)), both.T), shape=(n, n))
    border = border_edges(faces)
    on = np.zeros(n, bool)
    on[border] = True
    inner = diags_array((~on).astype(float)) @ count
    ring = np.concatenate([border, border[:, ::-1]])
    outer = csr_array((np.ones(len(ring)), ring.T), shape=(n, n))
    total = csr_array(inner + outer)
    total.data[:] = 1.0
    degree = np.maximum(np.asarray(total.sum(axis=1)).ravel(), 1.0)
    return csr_array(diags_array(1.0 / degree) @ total)


def border_edges(faces: Int[ndarray, "f 3"]) -> Int[ndarray, "e 2"]:
    """Edges of one triangle only, in that triangle's direction, shape (E, 2)."""
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    n = int(edges.max()) + 1 if len(edges) else 1
    code, back = edges[:, 0] * n + edges[:, 1], edges[:, 1] * n + edges[:, 0]
    return edges[~np.isin(code, back)]


def cut(sheet: Sheet, field: Float[ndarray, " v"], number: int) -> Sheet:
    """The part of a sheet where the field is above zero, cut exactly along the zero line.

    Args:
        sheet: What to cut.
        field: Value at every vertex, shape (V,); linear along edges.
        number: `edge` of the vertices that the cut makes.

    Returns:
        The kept part.
    """
    inside = field > 0.0
    faces = sheet.faces[inside[sheet.faces].any(axis=1)]
    count = inside[faces].sum(axis=1)
    rolled = np.stack([np.roll(faces, -k, axis=1) for k in range(3)])
    one = _turned(rolled[:, count == 1], inside, True)
    two = _turned(rolled[:, count == 2], inside, False)
    crossing = np.concatenate([one[:, [0, 1]], one[:, [0, 2]], two[:, [1, 0]], two[:, [2, 0]]])
    ends, place = np.unique(crossing, axis=0, return_inverse=True)
    n = len(field)
    new = n + place.reshape(-1)
    k, m = len(one), len(two)
    ab, ac, ba, ca = np.split(new, [k, 2 * k, 2 * k + m])
    pieces = (
        faces[count == 3],
        np.stack([one[:, 0], ab, ac], axis=1),
        np.stack([two[:, 1], two[:, 2], ba], axis=1),
        np.stack([two[:, 2], ca, ba], axis=1),
    )
    a, b = ends.T
    t = np.clip(field[a] / np.maximum(field[a] - field[b], 1e-12), SLIVER, 1.0)[:, None]
    whole = _appended(sheet, a, b, t, number)
    kept, used = triangulated(np.concatenate(pieces), np.ones(sum(map(len, pieces)), bool))
    return _chosen(whole, used, kept)


def lengthened(
    sheet: Sheet,
    number: int,
    rows: Sequence[Float[ndarray, "n 3"]],
    weights: Sequence[Float[ndarray, "n l"]],
    labels: Sequence[UInt8[ndarray, " n"]],
    room_m: Float[ndarray, " k"],
    last: int | None = None,
) -> Sheet:
    """A sheet with rows of new vertices hung on one of its cuts.

    Args:
        sheet: What to lengthen.
        number: Cut on which to hang.
        rows: Places of each row's vertices, in the order of `hem(sheet, number)`.
        weights: Their weights.
        labels: Their labels.
        room_m: Room of each row [m], shape (K,).
        last: `edge` of the last row; `number` if None.
    """
    start = hem(sheet, number)
    n, size = len(sheet.vertices), len(start)
    place = np.full(n, -1)
    place[start] = np.arange(size)
    edges = border_edges(sheet.faces)
    a, b = place[edges[(place[edges] >= 0).all(axis=1)]].T
    index = np.concatenate([start, n + np.arange(size * len(rows))]).reshape(-1, size)
    quads = []
    for above, below in zip(index[:-1], index[1:], strict=True):
        quads.append(np.stack([above[b], above[a], below[a]], axis=1))
        quads.append(np.stack([above[b], below[a], below[b]], axis=1))
    edge = np.where(sheet.edge == number, 0, sheet.edge)
    tail = np.zeros((len(rows), size), np.uint8)
    tail[-1] = number if last is None else last
    room = np.repeat(room_m, size)
    return Sheet(
        np.concatenate([sheet.vertices, *rows]),
        np.concatenate([sheet.faces, *quads]),
        np.concatenate([sheet.weights, *weights]),
        np.concatenate([sheet.labels, *labels]),
        np.concatenate([sheet.room_m, room]),
        np.concatenate([sheet.gap_m, 0.5 * room]),
        np.concatenate([edge, tail.ravel()]).astype(np.uint8),
        np.concatenate([sheet.base, np.full(size * len(rows), -1)]),
        np.concatenate([sheet.fields, np.ones((size * len(rows), sheet.fields.shape[1]))]),
    )


def hem(sheet: Sheet, number: int) -> Int[ndarray, " n"]:
    """Border vertices that a cut has made, in increasing order, shape (N,)."""
    border = np.unique(border_edges(sheet.faces))
    return border[sheet.edge[border] == number]


def without(sheet: Sheet, hidden: Bool[ndarray, " v"]) -> Sheet:
    """The sheet without the triangles whose three corners are hidden."""
    faces, used = triangulated(sheet.faces, ~hidden[sheet.faces].all(axis=1))
    return _chosen(sheet, used, faces)


def _turned(rolled: Int[ndarray, "3 n 3"], inside: ndarray, first: bool) -> Int[ndarray, "n 3"]:
    """Each triangle turned so that its first corner alone is inside (or outside)."""
    if rolled.shape[1] == 0:
        return np.zeros((0, 3), np.int64)
    turn = (inside[rolled[:, :, 0]] == first).argmax(axis=0)
    return rolled[turn, np.arange(rolled.shape[1])]


def _appended(sheet: Sheet, a: ndarray, b: ndarray, t: ndarray, number: int) -> Sheet:
    def mixed(values: ndarray) -> ndarray:
        share = t if values.ndim == 2 else t[:, 0]
        return np.concatenate([values, values[a] + share * (values[b] - values[a])])

    return replace(
        sheet,
        vertices=mixed(sheet.vertices),
        weights=mixed(sheet.weights),
        room_m=mixed(sheet.room_m),
        gap_m=mixed(sheet.gap_m),
        fields=mixed(sheet.fields),
        labels=np.concatenate([sheet.labels, sheet.labels[a]]),
        edge=np.concatenate([sheet.edge, np.full(len(a), number)]).astype(np.uint8),
        base=np.concatenate([sheet.base, np.full(len(a), -1)]),
    )


def _chosen(sheet: Sheet, used: ndarray, faces: ndarray) -> Sheet:
    return Sheet(
        sheet.vertices[used],
        faces,
        sheet.weights[used],
        sheet.labels[used],
        sheet.room_m[used],
        sheet.gap_m[used],
        sheet.edge[used],
        sheet.base[used],
        sheet.fields[used],
    )

# SPDX-License-Identifier: Apache-2.0
"""Triangle meshes as files: PLY (Turk 1994) and binary glTF 2.0 (Khronos 2021)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.files import write_atomically

_FLOAT, _UINT, _BYTE = 5126, 5125, 5121
_VERTICES, _INDICES = 34962, 34963
_Z_UP_TO_Y_UP = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]


def write_ply(
    path: Path,
    vertices: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    colors: UInt8[ndarray, "v 3"],
    values: Mapping[str, Float[ndarray, " v"]],
) -> None:
    """Write a binary PLY file.

    Args:
        path: The file to make or replace.
        vertices: Vertices [m].
        faces: Triangles, counter-clockwise from outside.
        colors: R G B.
        values: Further numbers per vertex by name, in metres, such as offset_m.

    Raises:
        ResultError: if the file cannot be written.
    """
    fields = [(axis, "<f4") for axis in "xyz"] + [(c, "u1") for c in ("red", "green", "blue")]
    columns = fields + [(name, "<f4") for name in values]
    table = np.zeros(len(vertices), dtype=columns)
    for k, axis in enumerate("xyz"):
        table[axis] = vertices[:, k]
    for k, name in enumerate(("red", "green", "blue")):
        table[name] = colors[:, k]
    for name, column in values.items():
        table[name] = column
    kinds = {"<f4": "float", "u1": "uchar"}
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    lines += [f"property {kinds[kind]} {name}" for name, kind in columns]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    triangles = np.zeros(len(faces), dtype=[("n", "u1"), ("corners", "<i4", 3)])
    triangles["n"], triangles["corners"] = 3, faces
    head = ("\n".join(lines) + "\n").encode()
    write_atomically(path, lambda file: file.write(head + table.tobytes() + triangles.tobytes()))


def write_glb(
    path: Path,
    vertices: Float[ndarray, "v 3"],
    normals: Float[ndarray, "v 3"],
    faces: Int[ndarray, "f 3"],
    colors: UInt8[ndarray, "v 3"],
) -> None:
    """Write a binary glTF 2.0 file; its node turns z up to glTF's y up.

    Args:
        path: The file to make or replace.
        vertices: Vertices [m], z up.
        normals: Unit normals.
        faces: Triangles, counter-clockwise from outside.
        colors: R G B.

    Raises:
        ResultError: if the file cannot be written.
    """
    rgba = np.column_stack([colors, np.full(len(colors), 255, dtype=np.uint8)])
    blocks = [
        (vertices.astype("<f4"), _FLOAT, "VEC3", _VERTICES),
        (normals.astype("<f4"), _FLOAT, "VEC3", _VERTICES),
        (rgba, _BYTE, "VEC4", _VERTICES),
        (faces.astype("<u4").ravel(), _UINT, "SCALAR", _INDICES),
    ]
    views, accessors, data = [], [], b""
    for array, kind, shape, target in blocks:
        raw = array.tobytes()
        views.append(
            {"buffer": 0, "byteOffset": len(data), "byteLength": len(raw), "target": target}
        )
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": kind,
                "count": len(array),
                "type": shape,
            }
        )
        data += raw
    accessors[0] |= {"min": blocks[0][0].min(0).tolist(), "max": blocks[0][0].max(0).tolist()}
    accessors[2]["normalized"] = True
    attributes = {"POSITION": 0, "NORMAL": 1, "COLOR_0": 2}
    content = {
        "asset": {"version": "2.0", "generator": "kintrack"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "person", "rotation": _Z_UP_TO_Y_UP}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.9}}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    head = json.dumps(content).encode()
    head += b" " * (-len(head) % 4)
    chunks = len(head).to_bytes(4, "little") + b"JSON" + head
    chunks += len(data).to_bytes(4, "little") + b"BIN\0" + data
    whole = b"glTF" + (2).to_bytes(4, "little") + (12 + len(chunks)).to_bytes(4, "little") + chunks
    write_atomically(path, lambda file: file.write(whole))

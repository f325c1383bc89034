# SPDX-License-Identifier: Apache-2.0
"""A person and a point cloud as the few bytes that `scene.js` shows, and the page around it.

A packed frame is little-endian: uint32 length of a JSON header, the header, then int16 millimetres
in the world frame, x y z of every vertex, joint and point, then uint8 R G B of every point and,
where the skin is not coloured by part, of every vertex. Half a millimetre is lost, and what lies
beyond 32 m is clipped.
"""

from __future__ import annotations

import base64
import importlib.util
import json
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
from jaxtyping import Float, Int, UInt8
from numpy import ndarray

from kintrack.errors import KintrackError
from kintrack.export.overlay import BONE_INDICES, PART_COLORS, STATUS_COLORS
from kintrack.geometry import PinholeCamera, transform_points
from kintrack.joints import JOINT_NAMES
from kintrack.sequence import Frame
from kintrack.skin import Skin

_POINT_COLOR = (235, 235, 225)
_NEAR_BODY_M = 0.4
_FRUSTUM_M = 0.25

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none';
 script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; connect-src $connect">
<title>$title</title>
<style>
body { margin: 0; overflow: hidden; font: 14px sans-serif; color: #eee; }
#meshcat-pane { width: 100vw; height: 100vh; overflow: hidden; }
#label { position: absolute; left: 12px; top: 12px; white-space: pre; }
#label span { padding: 4px 8px; background: #0008; }
#bar { position: absolute; left: 12px; right: 12px; bottom: 12px; display: flex; gap: 12px; }
#bar input { flex: 1; }
</style>
</head>
<body>
<div id="meshcat-pane"></div>
<div id="label"><span></span><span></span></div>
$controls
<script>
$meshcat
</script>
<script>
$script
</script>
<script type="text/plain" id="licences">
$licences
</script>
</body>
</html>
""")

_CONTROLS = """<div id="bar"><button id="play">pause</button>
<input id="time" type="range" min="0" value="0"><span>$note</span></div>"""


def pack_scene(
    skin: Skin, camera: PinholeCamera, T_world_camera: Float[ndarray, "4 4"], most_points: int
) -> dict[str, Any]:
    """What stays the same in all frames: triangles, colours, bones, and where the camera is.

    Args:
        skin: Skin whose vertices the frames give.
        camera: The depth camera.
        T_world_camera: Its place in the world.
        most_points: Largest number of points in a frame.

    Returns:
        A dictionary of JSON's types.
    """
    centre = T_world_camera[:3, 3]
    u = np.array([0, camera.width, camera.width, 0]) - 0.5
    v = np.array([0, 0, camera.height, camera.height]) - 0.5
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(4)], axis=-1)
    corners = transform_points(T_world_camera, _FRUSTUM_M * rays)
    edges = [(centre, c) for c in corners] + list(zip(corners, np.roll(corners, 1, 0), strict=True))
    return {
        "faces": _base64(skin.faces.astype("<u4")),
        "vertex_colors": _base64(PART_COLORS[skin.labels]),
        "bones": BONE_INDICES.tolist(),
        "joints": len(JOINT_NAMES),
        "most_points": most_points,
        "camera": centre.tolist(),
        "axis": T_world_camera[:3, 2].tolist(),
        "frustum": np.array(edges).reshape(-1, 3).tolist(),
    }


def pack_frame(
    frame: Frame,
    vertices_camera: Float[ndarray, "v 3"] | None,
    joint_positions_camera: Float[ndarray, "j 3"] | None,
    status: str,
    text: str,
    T_world_camera: Float[ndarray, "4 4"],
    most_points: int,
    vertex_colors: UInt8[ndarray, "v 3"] | None = None,
) -> bytes:
    """One frame for `scene.js`.

    Args:
        frame: The frame; one without a depth image has no points.
        vertices_camera: Skin, camera frame [m], shape (V, 3); None or NaN hides it.
        joint_positions_camera: Joint centres, camera frame [m], shape (J, 3); None or NaN hides
            them.
        status: One of the statuses of a `FrameResult`.
        text: Anything else worth a line.
        T_world_camera: The camera's place in the world.
        most_points: Largest number of points.
        vertex_colors: R G B of the skin; the last ones given, at first those of the parts, if None.

    Returns:
        The bytes.
    """
    vertices, joints = _known(vertices_camera), _known(joint_positions_camera)
    points, colors = sample_points(frame, vertices, most_points)
    header = {
        "index": frame.index,
        "status": status,
        "color": "#{:02x}{:02x}{:02x}".format(*STATUS_COLORS[status]),
        "text": text,
        "vertices": len(vertices),
        "joints": len(joints),
        "points": len(points),
        "vertex_colors": 0 if vertex_colors is None else len(vertex_colors),
    }
    head = json.dumps(header).encode()
    head += b" " * (len(head) % 2)
    blocks = [_millimetres(transform_points(T_world_camera, x)) for x in (vertices, joints, points)]
    blocks += [colors.tobytes(), b"" if vertex_colors is None else vertex_colors.tobytes()]
    return b"".join([len(head).to_bytes(4, "little"), head, *blocks])


def sample_points(
    frame: Frame, vertices_camera: Float[ndarray, "v 3"], most_points: int
) -> tuple[Float[ndarray, "n 3"], ndarray]:
    """Observed points, those around the body first; the same pixels in each frame.

    Args:
        frame: The frame.
        vertices_camera: Skin, camera frame [m]; may be empty.
        most_points: Largest number of points.

    Returns:
        Points in the camera frame [m], shape (N, 3), and their R G B, uint8, shape (N, 3).
    """
    if frame.depth_m is None:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8)
    points = frame.camera.back_project(frame.depth_m).reshape(-1, 3)
    order = _pixel_order(len(points))
    order = order[points[order, 2] > 0]
    if len(vertices_camera) and len(order) > most_points:
        low, high = vertices_camera.min(0) - _NEAR_BODY_M, vertices_camera.max(0) + _NEAR_BODY_M
        near = ((points[order] > low) & (points[order] < high)).all(axis=1)
        first = order[near][: 3 * most_points // 4]
        order = np.concatenate([first, order[~near], order[near][len(first) :]])
    chosen = order[:most_points]
    if frame.color is None:
        return points[chosen], np.full((len(chosen), 3), _POINT_COLOR, dtype=np.uint8)
    return points[chosen], frame.color.reshape(-1, 3)[chosen]


def assemble_page(title: str, script: str, *, note: str | None = None, connect: str) -> str:
    """A page with meshcat's viewer and `scene.js` in it; nothing outside it is needed.

    Args:
        title: Title of the page.
        script: JavaScript to run last; `viewer` is the meshcat viewer.
        note: Text beside the playback controls; no controls if None.
        connect: Where the page may connect to, a Content-Security-Policy source list.

    Returns:
        HTML.

    Raises:
        KintrackError: if meshcat's viewer is not installed.
    """
    spec = importlib.util.find_spec("meshcat")
    if spec is None or spec.origin is None:
        raise KintrackError("the package meshcat is needed for 3-D views: pip install meshcat")
    folder = Path(spec.origin).parent / "viewer"
    texts = (folder / "LICENSE", folder / "dist" / "main.min.js.THIRD_PARTY_LICENSES.json")
    viewer = 'const viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));\n'
    return _PAGE.substitute(
        title=_escape(title),
        connect=connect,
        controls="" if note is None else Template(_CONTROLS).substitute(note=_escape(note)),
        meshcat=(folder / "dist" / "main.min.js").read_text(encoding="utf-8"),
        script=viewer + (Path(__file__).parent / "scene.js").read_text(encoding="utf-8") + script,
        licences="\n".join(path.read_text(encoding="utf-8") for path in texts if path.is_file()),
    )


def script_json(value: Any) -> str:
    """JSON that may stand inside a `<script>`."""
    return json.dumps(value).replace("<", "\\u003c")


def _known(points: Float[ndarray, "n 3"] | None) -> Float[ndarray, "n 3"]:
    if points is None or not np.isfinite(points).all():
        return np.zeros((0, 3))
    return points


def _millimetres(points: Float[ndarray, "n 3"]) -> bytes:
    return np.clip(np.rint(1000 * points), -32767, 32767).astype("<i2").tobytes()


def _pixel_order(count: int) -> Int[ndarray, " n"]:
    """A fixed shuffling of the pixels, so that a prefix of it is spread over the image."""
    if count not in _ORDERS:
        _ORDERS[count] = np.random.default_rng(0).permutation(count)
    return _ORDERS[count]


_ORDERS: dict[int, Int[ndarray, " n"]] = {}


def _base64(array: ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()


def _escape(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")

# SPDX-License-Identifier: Apache-2.0
import asyncio
import json
import os
import signal
import socket
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from tornado.websocket import websocket_connect

from export.small_track import BODY, CAMERA, SKIN, shoot
from kintrack.errors import ConfigError, ResultError
from kintrack.joints import JOINT_NAMES
from kintrack.result import FrameResult, Track
from kintrack.viewer import MeshcatViewer, NullViewer, Viewer, replay


@pytest.fixture
def viewer():
    viewer = MeshcatViewer(SKIN)
    yield viewer
    viewer.close()


def show(viewer, index):
    shot = shoot(index)
    viewer.show(shot.frame, shot.vertices, shot.joints, "tracking", "live")


def port_of(viewer):
    return int(viewer.url.rstrip("/").rsplit(":", 1)[1])


def listening_addresses(port):
    """Hexadecimal local addresses that listen on a port, from the kernel's own tables."""
    rows = []
    for table in ("tcp", "tcp6"):
        path = Path("/proc/net") / table
        rows += path.read_text().splitlines()[1:] if path.exists() else []
    columns = [row.split() for row in rows]
    return {c[1].split(":")[0] for c in columns if c[3] == "0A" and c[1].endswith(f":{port:04X}")}


async def ask(connection):
    await connection.write_message("ready")
    message = await asyncio.wait_for(connection.read_message(), 5)
    size = int.from_bytes(message[:4], "little")
    return json.loads(message[4 : 4 + size])


def connect(viewer):
    return websocket_connect(viewer.url.replace("http", "ws") + "frames")


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="reads Linux's socket table")
def test_the_viewer_listens_on_the_loopback_interface_only(viewer):
    assert listening_addresses(port_of(viewer)) == {"0100007F"}


def test_the_page_is_served_and_connects_only_to_this_machine(viewer):
    page = urlopen(viewer.url, timeout=5).read().decode()
    assert "MeshCat" in page
    assert "connect-src ws://127.0.0.1:* ws://localhost:*" in page


def test_a_request_under_another_host_name_is_refused(viewer):
    with pytest.raises(HTTPError) as refusal:
        urlopen(Request(viewer.url, headers={"Host": "elsewhere.example"}), timeout=5)
    assert refusal.value.code == 404


def test_a_browser_gets_the_scene_and_then_the_newest_frame(viewer):
    async def browse():
        show(viewer, 0)
        show(viewer, 1)
        connection = await connect(viewer)
        scene = json.loads(await asyncio.wait_for(connection.read_message(), 5))
        first = await ask(connection)
        for index in range(2, 6):
            show(viewer, index)
        await asyncio.sleep(0.1)
        return scene, first, await ask(connection)

    scene, first, later = asyncio.run(browse())
    assert scene["joints"] == len(JOINT_NAMES)
    assert first["index"] == 1 and first["vertices"] == len(SKIN.labels)
    assert later["index"] == 5


def test_a_browser_that_came_first_is_served_when_frames_come(viewer):
    async def browse():
        connection = await connect(viewer)
        await asyncio.sleep(0.05)
        show(viewer, 3)
        await asyncio.wait_for(connection.read_message(), 5)
        return await ask(connection)

    assert asyncio.run(browse())["index"] == 3


def test_closing_frees_the_port_and_may_be_repeated():
    viewer = MeshcatViewer(SKIN)
    port = port_of(viewer)
    viewer.close()
    viewer.close()
    show(viewer, 0)
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection(("127.0.0.1", port), timeout=5)


def test_a_taken_port_is_named(viewer):
    with pytest.raises(ConfigError, match=str(port_of(viewer))):
        MeshcatViewer(SKIN, port=port_of(viewer))


def test_ctrl_c_ends_a_process_that_shows():
    program = (
        "import signal, time\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # even if it was ignored
        "from kintrack.skin import load_skin\n"
        "from kintrack.viewer import MeshcatViewer\n"
        "viewer = MeshcatViewer(load_skin())\n"
        "print('up', flush=True)\n"
        "time.sleep(60)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )
    assert process.stdout.readline() == b"up\n"
    os.kill(process.pid, signal.SIGINT)
    assert process.wait(timeout=10) != 0


@dataclass
class Recording:
    name = "waving"
    root = Path("waving")
    camera = CAMERA
    count: int

    def __len__(self):
        return self.count

    def __iter__(self):
        return (shoot(i).frame for i in range(self.count))

    def frame(self, index):
        return shoot(index).frame


@dataclass
class Witness:
    shown: list = field(default_factory=list)

    def show(self, *what):
        self.shown.append(what)

    def close(self):
        pass


def write_track(folder, count, nq=None):
    frames = []
    for i in range(count):
        shot = shoot(i)
        q = shot.q if i != 1 else np.full_like(shot.q, np.nan)
        frames.append(
            FrameResult(
                timestamp_s=i / 30,
                status="tracking" if i != 1 else "lost",
                q=q[:nq],
                joint_positions_camera_m=shot.joints,
                joint_covariances_m2=np.zeros((len(JOINT_NAMES), 3, 3)),
                joint_visible=np.ones(len(JOINT_NAMES)),
                residual_rms_m=0.01,
                inliers=100,
                milliseconds=20.0,
            )
        )
    Track.from_frames(JOINT_NAMES, frames).save(folder / "track.npz")


def test_a_replay_shows_each_frame_with_the_body_that_was_tracked(tmp_path):
    write_track(tmp_path, 3)
    viewer = Witness()
    replay(tmp_path, Recording(3), viewer, BODY, SKIN, fps=1000)
    frames, vertices, joints, statuses, texts, colors = zip(*viewer.shown, strict=True)
    assert colors == (None,) * len(frames)
    assert [frame.index for frame in frames] == [0, 1, 2]
    assert statuses == ("tracking", "lost", "tracking")
    assert vertices[1] is None
    assert np.allclose(vertices[2], shoot(2).vertices)
    assert np.allclose(joints[2], shoot(2).joints)
    assert texts[0] == "20 ms"


def test_a_loop_begins_again_until_interrupted(tmp_path):
    write_track(tmp_path, 2)

    class Impatient(Witness):
        def show(self, *what):
            super().show(*what)
            if len(self.shown) == 5:
                raise KeyboardInterrupt

    viewer = Impatient()
    with pytest.raises(KeyboardInterrupt):
        replay(tmp_path, Recording(2), viewer, BODY, SKIN, fps=1000, loop=True)
    assert [what[0].index for what in viewer.shown] == [0, 1, 0, 1, 0]


@pytest.mark.parametrize(("count", "nq"), [(0, None), (4, None), (2, 10)])
def test_a_track_of_something_else_is_refused(tmp_path, count, nq):
    write_track(tmp_path, count, nq)
    with pytest.raises(ResultError, match="track.npz"):
        replay(tmp_path, Recording(3), NullViewer(), BODY, SKIN)


def test_the_null_viewer_is_a_viewer_that_does_nothing():
    viewer: Viewer = NullViewer()
    show(viewer, 0)
    viewer.close()

# SPDX-License-Identifier: Apache-2.0
import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from kintrack.cli import main
from kintrack.sequence import open_sequence
from kintrack.sequence.write import SequenceWriter

DEMO = Path(__file__).resolve().parents[2] / "src" / "kintrack" / "demo"
BOX = """v -0.3 -0.3 0
v 0.3 -0.3 0
v 0.3 0.3 0
v -0.3 0.3 0
v -0.3 -0.3 0.8
v 0.3 -0.3 0.8
v 0.3 0.3 0.8
v -0.3 0.3 0.8
"""
FACES = ("1 4 3 2", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8")


@pytest.fixture
def recording(tmp_path):
    """Three frames of the recording that ships, with labels."""
    folder = tmp_path / "recording"
    for part in ("depth", "labels"):
        (folder / part).mkdir(parents=True)
        for n in range(3):
            shutil.copy(DEMO / part / f"{n:06d}.png", folder / part)
    shutil.copy(DEMO / "camera.json", folder)
    lines = (DEMO / "depth.txt").read_text().splitlines(keepends=True)
    (folder / "depth.txt").write_text("".join(lines[:4]))
    return folder


def refused(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    assert ended.value.code == 2
    return " ".join(capsys.readouterr().err.split())


def test_a_kind_of_thing_is_inserted(recording, tmp_path, capsys):
    out = tmp_path / "out"
    main(["occlude", str(recording), "-o", str(out), "--object", "box", "--share", "0.3"])
    assert "% of the person hidden" in capsys.readouterr().out
    facts = json.loads((out / "occluder.json").read_text())
    assert facts["thing"] == "box" and 0.2 < facts["hidden_share"] < 0.4
    before, after = open_sequence(recording).frame(1), open_sequence(out).frame(1)
    assert (after.labels > 0).sum() < 0.85 * (before.labels > 0).sum()


def test_a_mesh_file_is_inserted_on_the_side_that_is_asked_for(recording, tmp_path):
    mesh = tmp_path / "box.obj"
    mesh.write_text(BOX + "".join(f"f {face}\n" for face in FACES))
    out = tmp_path / "out"
    options = ["--object", str(mesh), "--side", "left", "--distance-m", "0.6"]
    main(["occlude", str(recording), "-o", str(out), *options])
    before, after = open_sequence(recording).frame(0).depth_m, open_sequence(out).frame(0).depth_m
    changed = np.nonzero((after > 0) & (np.abs(after - before) > 1e-3))[1]
    assert np.median(changed) < np.median(np.nonzero(before)[1])


def test_an_rgbd_cut_out_is_inserted(recording, tmp_path):
    camera = open_sequence(recording).camera
    depth = np.zeros((camera.height, camera.width), np.float32)
    depth[80:200, 120:220] = 1.5
    SequenceWriter(tmp_path / "cutout", camera).write(0.0, depth)
    out = tmp_path / "out"
    main(["occlude", str(recording), "-o", str(out), "--object", str(tmp_path / "cutout")])
    facts = json.loads((out / "occluder.json").read_text())
    assert facts["hidden_share"] == pytest.approx(0.33, abs=0.08)


@pytest.mark.parametrize(
    "content, says",
    [("", "no faces|cannot be read|empty"), ("v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "finite")],
)
def test_a_mesh_without_faces_or_with_nan_is_named(recording, tmp_path, capsys, content, says):
    mesh = tmp_path / "broken.obj"
    mesh.write_text(content)
    error = refused(capsys, "occlude", recording, "-o", tmp_path / "out", "--object", mesh)
    assert "broken.obj" in error
    assert any(part in error for part in says.split("|"))
    assert not (tmp_path / "out").exists()


def test_an_impossible_share_is_refused_before_anything_is_written(recording, tmp_path, capsys):
    common = ["occlude", recording, "-o", tmp_path / "out", "--object", "box"]
    assert "0.05 to 0.8" in refused(capsys, *common, "--share", "0.95")
    assert "cannot hide" in refused(capsys, *common[:-1], "pole", "--share", "0.75")
    assert not (tmp_path / "out").exists()


def test_an_unknown_object_lists_what_there_is(recording, tmp_path, capsys):
    error = refused(capsys, "occlude", recording, "-o", tmp_path / "o", "--object", "elephant")
    assert "elephant" in error and "desk_chair" in error


def test_a_person_outside_the_image_is_named(recording, tmp_path, capsys):
    for path in recording.glob("labels/*.png"):
        path.unlink()
    for path in recording.glob("depth/*.png"):
        cv2.imwrite(str(path), np.zeros((240, 320), np.uint16))
    error = refused(capsys, "occlude", recording, "-o", tmp_path / "o", "--object", "box")
    assert "no person in any frame" in error

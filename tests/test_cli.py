# SPDX-License-Identifier: Apache-2.0
import inspect
import json
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from kintrack.cli import COMMANDS, command, main
from kintrack.tracker import Tracker

ROOT = Path(__file__).resolve().parents[1]
DEMO = ROOT / "src" / "kintrack" / "demo"
HEAVY = {"torch", "pinocchio", "numba", "openvino", "cv2", "trimesh", "embreex"}
QUICK = ["--config.start.shape-coefficients", "0", "--config.start.rounds", "6"]


@pytest.fixture
def recording(tmp_path):
    """Three frames of the recording that ships."""
    folder = tmp_path / "recording"
    (folder / "depth").mkdir(parents=True)
    shutil.copy(DEMO / "camera.json", folder)
    names = [f"depth/{i:06d}.png" for i in range(3)]
    for name in names:
        shutil.copy(DEMO / name, folder / name)
    write_index(folder, [(i / 30, name) for i, name in enumerate(names)])
    return folder


def write_index(folder, entries):
    (folder / "depth.txt").write_text("".join(f"{t:.6f} {name}\n" for t, name in entries))


def edit_camera(folder, **changes):
    camera = json.loads((folder / "camera.json").read_text()) | changes
    kept = {key: value for key, value in camera.items() if value is not None}
    (folder / "camera.json").write_text(json.dumps(kept))


def refused(capsys, *arguments):
    """The one line on stderr of a command that must end with code 2."""
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    assert ended.value.code == 2
    text = capsys.readouterr().err
    assert "Traceback" not in text
    lines = [line for line in text.splitlines() if line.strip()]
    assert len(lines) == 1 and lines[0].startswith("kintrack: "), text
    return lines[0]


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def test_a_recording_is_fitted_into_its_own_folder_and_evaluated_against_the_truth(
    recording, capsys
):
    main(["fit", str(recording), *QUICK])
    assert summary_of(recording / "kintrack")["status_counts"]["tracking"] == 3
    output = capsys.readouterr().out
    assert "3 frames: 3 tracking" in output
    assert str(recording / "kintrack") in output.replace("\n", "")
    lines = (DEMO / "reference_joints.csv").read_text().splitlines()
    kept = [line for line in lines if line.split(",")[0] in ("frame", "0", "1", "2")]
    (recording / "reference_joints.csv").write_text("\n".join(kept) + "\n")
    main(["evaluate", str(recording / "kintrack"), str(recording), "--truth"])
    assert (recording / "kintrack" / "evaluation.json").is_file()
    assert (recording / "kintrack" / "evaluation.png").is_file()
    assert "l_knee" in capsys.readouterr().out


def test_a_missing_camera_file_is_named_with_its_format(recording, capsys):
    (recording / "camera.json").unlink()
    message = refused(capsys, "fit", recording, "--format", "folder")
    assert "camera.json" in message and "fx" in message


def test_a_recording_of_no_known_layout_is_told_what_each_needs(recording, capsys):
    (recording / "camera.json").unlink()
    message = refused(capsys, "fit", recording)
    assert str(recording) in message and "camera.json (missing)" in message


def test_a_camera_file_that_is_not_json_is_named(recording, capsys):
    (recording / "camera.json").write_text("fx = 525")
    message = refused(capsys, "fit", recording)
    assert "camera.json" in message and "not JSON" in message


@pytest.mark.parametrize(
    ("field", "value", "allowed"),
    [
        ("fx", 0, "above 0"),
        ("fy", -285.6, "above 0"),
        ("fx", "wide", "number"),
        ("width", 0, "positive"),
        ("depth_scale_m", 0, "above 0"),
        ("depth_scale_m", None, "0.001"),
        ("cx", None, "missing"),
        ("model", "fisheye", "pinhole"),
    ],
)
def test_a_bad_camera_value_is_named_with_what_is_allowed(recording, capsys, field, value, allowed):
    edit_camera(recording, **{field: value})
    message = refused(capsys, "fit", recording)
    assert "camera.json" in message and field in message and allowed in message
    if value is not None:
        assert repr(value) in message or repr(float(value)) in message


@pytest.mark.parametrize("stamps", [(0.0, 0.2, 0.1), (0.0, 0.1, 0.1)], ids=["backwards", "equal"])
def test_time_stamps_out_of_order_are_named_with_their_line(recording, capsys, stamps):
    write_index(recording, [(t, f"depth/{i:06d}.png") for i, t in enumerate(stamps)])
    message = refused(capsys, "fit", recording)
    assert "depth.txt, line 3" in message and "0.1" in message and "increase" in message


@pytest.mark.parametrize("text", ["", "# nothing\n", "zero depth/000000.png\n"])
def test_an_index_without_frames_is_named(recording, capsys, text):
    (recording / "depth.txt").write_text(text)
    assert "depth.txt" in refused(capsys, "fit", recording)


def test_an_empty_or_absent_folder_or_a_file_is_refused(recording, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    for path, problem in (
        (tmp_path / "empty", "is empty"),
        (tmp_path / "nowhere", "does not exist"),
        (recording / "camera.json", "is a file"),
    ):
        message = refused(capsys, "fit", path)
        assert str(path) in message and problem in message and "depth.txt" in message


def spoil(path, kind):
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if kind == "truncated":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif kind == "8-bit":
        cv2.imwrite(str(path), (image // 256).astype(np.uint8))
    elif kind == "of another size":
        cv2.imwrite(str(path), image[:100, :100])
    elif kind == "all zero":
        cv2.imwrite(str(path), np.zeros_like(image))
    elif kind == "missing":
        path.unlink()


BAD = {
    "truncated": "truncated",
    "8-bit": "16-bit",
    "of another size": "320x240",
    "all zero": "every pixel is 0",
    "missing": "cannot be read",
}


def test_single_bad_images_are_skipped_and_counted_whatever_is_wrong_with_them(recording, capsys):
    names = [f"depth/{i:06d}.png" for i in range(len(BAD) + 2)]
    for name, kind in zip(names, ["", *BAD, ""], strict=True):
        shutil.copy(DEMO / name, recording / name)
        spoil(recording / name, kind)
    write_index(recording, [(i / 30, name) for i, name in enumerate(names)])
    main(["fit", str(recording), *QUICK])
    summary = summary_of(recording / "kintrack")
    assert summary["status_counts"]["skipped"] == len(BAD)
    assert summary["status_counts"]["tracking"] == 2
    for number, (kind, skipped) in enumerate(zip(BAD, summary["skipped"], strict=True), start=1):
        assert skipped["frame"] == number
        assert names[number] in skipped["reason"] and BAD[kind] in skipped["reason"], kind
    assert f"{len(BAD)} skipped" in capsys.readouterr().out


@pytest.mark.parametrize("option", ["--output", "--video", "--html"])
def test_an_output_that_cannot_be_written_is_named(recording, tmp_path, capsys, option):
    (tmp_path / "file").write_text("")
    target = tmp_path / "file" / "inside" / "out"
    message = refused(capsys, "fit", recording, option, target, *QUICK)
    assert str(tmp_path / "file") in message


@pytest.mark.parametrize(
    ("option", "value", "bounds"),
    [
        ("--config.solver.rounds", "0", "1 to 100"),
        ("--config.association.gate-m", "-1", "0.01 to 1"),
        ("--config.judge.min-explained", "nan", "0 to 1"),
        ("--camera-pitch-deg", "120", "-90 to 90"),
        ("--depth-scale-m", "0", "above 0"),
        ("--format", "vhs", "folder, tum, azure"),
        ("--fps", "30", "azure"),
    ],
)
def test_a_bad_option_names_field_value_and_what_is_allowed(
    recording, capsys, option, value, bounds
):
    message = refused(capsys, "fit", recording, f"{option}={value}")
    field = option.rsplit(".", 1)[-1].strip("-").replace("-", "_").removeprefix("camera_")
    assert field.removesuffix("_deg") in message
    assert value in message and bounds in message


def test_a_urdf_without_a_needed_joint_is_named(recording, tmp_path, capsys, monkeypatch):
    shutil.copytree(ROOT / "model", tmp_path / "model")
    urdf = tmp_path / "model" / "human.urdf"
    urdf.write_text(urdf.read_text().replace('"l_shank"', '"l_stilt"'))
    for module in ("kintrack.body", "kintrack.skin"):
        monkeypatch.setattr(f"{module}.model_folder", lambda: tmp_path / "model")
    message = refused(capsys, "fit", recording, *QUICK)
    assert "human.urdf" in message and "l_shank" in message


def test_evaluating_or_viewing_what_is_not_there_is_refused(recording, tmp_path, capsys):
    assert "track.npz" in refused(capsys, "evaluate", tmp_path, DEMO)
    assert "summary.json" in refused(capsys, "view", recording)


@pytest.mark.parametrize(
    "arguments", [["fly"], [], ["fit"], ["fit", "x", "--config.solver.rounds", "many"]]
)
def test_what_cannot_be_parsed_exits_with_two_and_no_traceback(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err + captured.out


def test_help_lists_the_commands(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert all(name in text for name in COMMANDS)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_says_of_a_command_what_the_command_says_of_itself(name):
    assert COMMANDS[name] == inspect.getdoc(command(name))


@pytest.mark.parametrize(
    "words", [["--help"], ["fit", "--help"], ["calibrate", "--help"]], ids=" ".join
)
def test_help_waits_for_none_of_the_heavy_packages(words):
    program = (
        "import sys\n"
        "from kintrack.cli import main\n"
        "try:\n"
        f"    main({words})\n"
        "finally:\n"
        f"    sys.stderr.write(' '.join(sys.modules.keys() & {HEAVY}))\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0 and "usage: kintrack" in done.stdout
    assert not done.stderr


def test_interrupting_ends_with_130_and_a_valid_result(recording, capsys, monkeypatch):
    step, seen = Tracker.step, []

    def interrupted(self, frame):
        if len(seen) == 1:
            raise KeyboardInterrupt
        seen.append(frame)
        return step(self, frame)

    monkeypatch.setattr(Tracker, "step", interrupted)
    with pytest.raises(SystemExit) as ended:
        main(["fit", str(recording), *QUICK])
    assert ended.value.code == 130
    assert "written" in capsys.readouterr().err
    assert summary_of(recording / "kintrack")["frames"] == 1

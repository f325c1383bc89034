# SPDX-License-Identifier: Apache-2.0
import json

import pytest

from kintrack.bench import recordings
from kintrack.cli import main
from synthesis.dataset.recipes import takes_of

GEOMETRY = ["--methods", "geometry"]


@pytest.fixture(scope="module")
def benched(tmp_path_factory):
    """One short recording of the bench, clean and behind objects, tracked and scored."""
    folder = tmp_path_factory.mktemp("bench") / "out"
    with pytest.MonkeyPatch.context() as patch:
        one = [take for take in takes_of("bench", 0, None, 2) if take.part == "alone"][:1]
        patch.setattr(recordings, "takes_of", lambda *given: one)
        arguments = ["bench", "accuracy", "--output", str(folder), "--groups", "alone"]
        main([*arguments, *GEOMETRY, "--frames", "2", "--workers", "1"])
    return folder


def test_scores_and_pictures_are_written(benched):
    scores = json.loads((benched / "accuracy.json").read_text())["scores"]["geometry"]["alone"]
    assert set(scores) == {"clean", "30 cm", "45 cm", "60 cm"}
    for found in scores.values():
        assert found["frames"] == 2 and len(found["all"]["accuracy"]) == len(found["thresholds_m"])
        assert found["all"]["joints"] == found["visible"]["joints"] + found["hidden"]["joints"]
    assert all((benched / name).stat().st_size > 5_000 for name in ("accuracy.png", "joints.png"))


def test_a_third_is_hidden_by_an_object_that_no_training_set_has(benched):
    scores = json.loads((benched / "accuracy.json").read_text())["scores"]["geometry"]["alone"]
    for condition, found in scores.items():
        if condition != "clean":
            assert 0.25 < found["hidden_share"] < 0.42 and found["hidden"]["joints"] > 0
            assert {s["object"] for s in found["sequences"].values()} <= {"desk_chair", "lamp"}


def test_unknown_methods_and_groups_list_what_there_is(tmp_path, capsys):
    for option, says in (("--methods", "geometry_cold"), ("--groups", "alone, room, real")):
        with pytest.raises(SystemExit) as ended:
            main(["bench", "accuracy", "--output", str(tmp_path), option, "magic"])
        assert ended.value.code == 2
        assert says in " ".join(capsys.readouterr().err.split())


def test_a_folder_without_recordings_is_refused(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    for group in ("real", "scenes"):
        options = ["--groups", group, "--data", str(tmp_path / "empty"), *GEOMETRY]
        with pytest.raises(SystemExit) as ended:
            main(["bench", "accuracy", "--output", str(tmp_path / "out"), *options])
        assert ended.value.code == 2
        assert "no recordings there" in " ".join(capsys.readouterr().err.split())


def test_weights_that_are_none_are_named_before_any_work(tmp_path, capsys):
    (tmp_path / "bad.safetensors").write_bytes(b"no weights")
    options = ["--weights", f"mine={tmp_path / 'bad.safetensors'}", "--output"]
    with pytest.raises(SystemExit) as ended:
        main(["bench", "accuracy", *options, str(tmp_path / "out")])
    assert ended.value.code == 2
    assert "bad.safetensors" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()

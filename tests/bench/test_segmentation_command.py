# SPDX-License-Identifier: Apache-2.0
"""The bench of the networks."""

import importlib
import json
from pathlib import Path

import pytest

pytest.importorskip("openvino")
pytest.importorskip("embreex")

from kintrack.bench import running  # noqa: E402
from kintrack.bench.segmentation import inputs  # noqa: E402
from kintrack.bench.segmentation import run as bench_run  # noqa: E402
from kintrack.cli import main  # noqa: E402

from .small_bench import paper_set, record, weights_file, witnessed  # noqa: E402

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
SMALL = ["--frames", "2", "--agreement-frames", "2", "--timing-s", "0", "--workers", "1"]


def at_once(jobs, workers, on_progress):
    """Jobs without processes of their own, which are tested with the accuracy bench."""
    for job in jobs:
        job.run()
        on_progress(0)
    return {}


@pytest.fixture(scope="module")
def benched(tmp_path_factory):
    """Two untrained networks on one recording of two frames and on a real scene of one."""
    root = tmp_path_factory.mktemp("segmentation")
    dataset = paper_set(root / "set")
    data = root / "data"
    joints = [f"{s}_{joint}" for s in "lr" for joint in ("shoulder", "elbow", "wrist", "hip")]
    rows = [(0, name, 100 + 9 * n, 90, 1.0) for n, name in enumerate(joints)]
    witnessed(record(data / "sofa", 1, labelled=False), rows)
    files = [f"one={weights_file(root / 'one.safetensors', 0, {'data': ['boxes']})}",
             f"two={weights_file(root / 'two.safetensors', 1)}"]  # fmt: skip
    arguments = ["bench", "segmentation", "--weights", *files, "--output", str(root / "out"),
                 "--dataset", str(dataset), "--data", str(data), *SMALL]  # fmt: skip
    with pytest.MonkeyPatch.context() as patch, pytest.warns(UserWarning, match="not calibrated"):
        patch.setattr(running, "run_all", at_once)
        patch.setattr(inputs, "_people", lambda data, config: [])
        main(arguments)
    return root, arguments, json.loads((root / "out" / "segmentation.json").read_text())


def test_scores_pictures_and_targets_are_written(benched):
    root, _, content = benched
    for name in ("one", "two"):
        by_condition = content["labels"]["test"][name]["RGB-D"]
        assert by_condition["clean"]["frames"] == 2
        objects = [key for key in by_condition if key.endswith(" cm")]
        assert "30-60 cm" in objects and len(objects) > 1
        assert content["witness"]["sofa"][name]["depth only"]["joints"] == 8
        works = content["runtimes"][name]["works"]
        assert works["torch fp32"]["agreement"]["differing"] == 0.0
        assert works["openvino fp32"]["agreement"]["differing"] < 0.01
        assert "not calibrated" in content["runtimes"][name]["missing"]["openvino-int8"]
    assert {row["what"] for row in content["targets"]} > {"background IoU, the same"}
    for name in ("segmentation.png", "segmentation_real.png"):
        assert (root / "out" / name).stat().st_size > 20_000


def test_a_second_run_makes_and_judges_nothing_again(benched, monkeypatch):
    root, arguments, before = benched
    kept = {p: p.stat().st_mtime_ns for p in (root / "out").rglob("*")
            if p.is_file() and p.parent != root / "out"}  # fmt: skip
    monkeypatch.setattr(inputs, "_people", lambda data, config: [])
    untimed = {"missing": {}, "reference": None, "works": {}}
    monkeypatch.setattr(bench_run, "_runtimes", lambda *given: {"one": untimed, "two": untimed})
    with pytest.warns(UserWarning, match="not calibrated"):
        main(arguments)
    after = json.loads((root / "out" / "segmentation.json").read_text())
    assert after["labels"] == before["labels"] and after["witness"] == before["witness"]
    assert kept == {p: p.stat().st_mtime_ns for p in kept}


def test_docs_get_a_section_and_a_card_whose_handwritten_part_stays(benched, monkeypatch):
    root, _, content = benched
    monkeypatch.syspath_prepend(BENCHMARKS)
    docs = importlib.import_module("part_segmentation")
    assert "| two | torch fp32 |" in docs.section(content)
    path, weights = root / "model_card.md", root / "one.safetensors"
    docs.write_card(content, weights, path)
    text = path.read_text()
    assert text.startswith("# Model card") and "data: boxes" in text and "Known failures" in text
    path.write_text(text.replace("Not written yet.", "It takes coats for torsos."))
    (root / "curves.png").write_bytes(b"picture")
    docs.write_card(content, weights, path)
    assert "It takes coats for torsos." in path.read_text()
    assert path.read_text().count("## What it is") == 1
    assert "(model_card_curves.png)" in path.read_text()


@pytest.mark.parametrize(
    ("weights", "says"),
    [
        (["one"], "NAME=FILE"),
        (["one=none.safetensors"], "no weights file none.safetensors"),
    ],
)
def test_weights_that_cannot_be_used_are_named(tmp_path, capsys, monkeypatch, weights, says):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(["bench", "segmentation", "--weights", *weights])
    assert ended.value.code == 2
    assert says in " ".join(capsys.readouterr().err.split())


def test_a_dataset_without_a_test_part_and_data_without_people_are_refused(tmp_path, capsys):
    file = weights_file(tmp_path / "w.safetensors")
    common = ["bench", "segmentation", "--weights", f"w={file}", "--runtime", "openvino",
              "--output", str(tmp_path / "out"), *SMALL]  # fmt: skip
    for more, says in (
        (["--dataset", str(tmp_path)], "no dataset's manifest"),
        (["--dataset", str(paper_set(tmp_path / "other", part="train"))], "of a part `test`"),
        (["--dataset", str(paper_set(tmp_path / "set")), "--data", str(tmp_path)],
         "utd_mhad holds no recording"),
    ):  # fmt: skip
        with pytest.raises(SystemExit) as ended:
            main([*common, *more])
        assert ended.value.code == 2
        assert says in " ".join(capsys.readouterr().err.split())

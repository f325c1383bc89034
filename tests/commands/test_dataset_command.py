# SPDX-License-Identifier: Apache-2.0
import pytest

from kintrack.cli import main


def test_a_dataset_says_its_size_is_built_and_looked_at(tmp_path, capsys):
    out = tmp_path / "set"
    build = [
        "dataset",
        "build",
        str(out),
        "--recipe",
        "training",
        "--frames",
        "1",
        "--workers",
        "1",
    ]
    main(build)
    said = capsys.readouterr().out
    assert "1 recordings, 10 frames; 0 are there" in said and "GB to write" in said
    main(build)
    assert "1 are there; about 0.00 GB" in capsys.readouterr().out
    main(["dataset", "pictures", str(out), "-o", str(tmp_path / "sheet.png"), "--count", "2"])
    assert (tmp_path / "sheet.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    "options, says",
    [
        (["--recipe", "papre"], "paper, training, arms, sofas, bench"),
        (["--frames", "0"], "at least 1"),
        (["--mocap", "nowhere"], "nowhere"),
    ],
)
def test_what_cannot_be_built_is_refused(tmp_path, capsys, options, says):
    with pytest.raises(SystemExit) as ended:
        main(["dataset", "build", str(tmp_path / "set"), *options])
    assert ended.value.code == 2
    assert says in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "set").exists()

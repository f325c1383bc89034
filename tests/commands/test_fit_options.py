# SPDX-License-Identifier: Apache-2.0
"""Who labels the pixels, who it is, and what solves."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import kintrack
from kintrack.calibration.measures import LIMBS, Length
from kintrack.calibration.person import Person, write_person
from kintrack.cli import main
from kintrack.clothing import REGIONS
from kintrack.fit import load_person
from kintrack.result import Track

DEMO = Path(kintrack.__file__).parent / "demo"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Three frames of the recording that ships."""
    folder = tmp_path_factory.mktemp("demo") / "demo"
    shutil.copytree(DEMO, folder)
    lines = (folder / "depth.txt").read_text().splitlines()
    kept = [line for line in lines if not line.startswith("#")][:3]
    (folder / "depth.txt").write_text("\n".join(kept) + "\n")
    return folder


def fitted(recording, output, *options):
    main(["fit", str(recording), "--output", str(output), *options])
    summary = json.loads((output / "summary.json").read_text())
    return Track.load(output / "track.npz"), summary


@pytest.fixture(scope="module")
def by_network(recording, tmp_path_factory):
    return fitted(recording, tmp_path_factory.mktemp("network"))


def test_the_network_that_ships_labels_every_frame_unless_told_otherwise(by_network):
    track, summary = by_network
    assert (track.status == "tracking").all()
    assert summary["config"]["segmenter"].startswith("network, ")
    assert summary["config"]["labelled"]["start"]["headings"] == 12


def test_without_labels_the_geometry_is_alone(recording, tmp_path, by_network):
    track, summary = fitted(recording, tmp_path, "--labels", "none")
    assert (track.status == "tracking").all() and "segmenter" not in summary["config"]
    assert not np.array_equal(track.q, by_network[0].q)


def test_labels_of_the_recording_can_be_taken(recording, tmp_path):
    _, summary = fitted(recording, tmp_path, "--labels", "recording")
    assert summary["config"]["segmenter"] == "labels of the recording"


def test_weights_that_are_none_are_named_before_any_work(recording, tmp_path, capsys):
    (tmp_path / "w.safetensors").write_text("no")
    with pytest.raises(SystemExit) as ended:
        fitted(recording, tmp_path / "out", "--weights", str(tmp_path / "w.safetensors"))
    assert ended.value.code == 2 and "w.safetensors" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.fixture
def person(tmp_path):
    """Somebody tall in thin clothes, and her file."""
    shape = np.zeros(10)
    shape[0] = 0.7
    worn = dict.fromkeys((region.name for region in REGIONS), 0.01)
    person = Person(
        shape, np.eye(10), worn, Length(1.7, 0.01), dict.fromkeys(LIMBS, Length(0.3, 0.01)),
        (0, 1, 2), 0.2, 0.01,
    )  # fmt: skip
    write_person(person, tmp_path / "person.json")
    return shape, str(tmp_path / "person.json")


def test_a_person_is_tracked_and_shown_in_her_own_size_and_clothes(recording, tmp_path, person):
    shape, file = person
    _, summary = fitted(recording, tmp_path / "out", "--person", file)
    assert summary["person"]["shape"] == shape.tolist()
    assert summary["body"]["kind"] == "calibrated" and summary["body"]["used"] == "given"
    human, _ = load_person(tmp_path / "out")
    assert np.array_equal(human.shape, shape)
    bare = tmp_path / "out" / "summary.json"
    bare.write_text(json.dumps({**summary, "person": {"shape": shape.tolist()}}))
    thinner, _ = load_person(tmp_path / "out")
    assert np.abs(human.skin.points_link - thinner.skin.points_link).max() > 0.005


def test_the_body_is_chosen_and_the_choice_recorded(recording, tmp_path, by_network):
    assert by_network[1]["body"]["kind"] == "calibrated"
    said = by_network[1]["body"]["attempts"][0]["problems"]
    assert (
        said == ["tracked for 0.1 s; 1 s are needed"] and len(by_network[1]["person"]["shape"]) == 3
    )
    _, summary = fitted(recording, tmp_path, "--labels", "none", "--body", "template")
    assert summary["body"] == {"kind": "template", "used": "template", "attempts": []}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--height-m", "17.8"], "adults of 1.4 to 2.1 m are allowed"),
        (["--body", "template", "--height-m", "1.8"], "no use for a height of 1.8 m"),
        (["--body", "round"], "round"),
    ],
)
def test_a_body_that_cannot_be_is_refused_before_any_work(
    recording, tmp_path, capsys, options, message
):
    with pytest.raises(SystemExit) as ended:
        fitted(recording, tmp_path / "out", "--labels", "none", *options)
    assert ended.value.code == 2
    said = " ".join(capsys.readouterr().err.split())
    assert message in said
    assert not (tmp_path / "out").exists()


def test_the_template_has_no_use_for_a_person(recording, tmp_path, person, capsys):
    with pytest.raises(SystemExit) as ended:
        fitted(recording, tmp_path / "out", "--body", "template", "--person", person[1])
    assert ended.value.code == 2
    assert "'template' has no use for a person" in " ".join(capsys.readouterr().err.split())

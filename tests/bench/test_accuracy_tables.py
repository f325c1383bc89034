# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.bench.cases import CONDITIONS, GAPS, Case
from kintrack.bench.figure import draw_curves, draw_joints, draw_waits, in_words, write_pictures
from kintrack.bench.scores import Errors
from kintrack.bench.summary import content_of
from kintrack.bench.tables import all_grids
from kintrack.bench.targets import targets, targets_grid
from kintrack.joints import JOINT_NAMES

SHAPE = (4, len(JOINT_NAMES))


def errors(condition, error_m):
    return Errors(
        Case("room", "x", condition, None),
        np.full(SHAPE, error_m),
        np.broadcast_to(np.arange(SHAPE[1]) < 7, SHAPE),
        np.full(4, 0.3),
        np.full(4, "tracking"),
        np.full(SHAPE, 1.0),
        np.zeros(4, dtype=bool),
        range(1, 2) if condition in GAPS else None,
    )


@pytest.fixture
def content(monkeypatch):
    monkeypatch.setattr("kintrack.bench.summary.thing_of", lambda case: "lamp")
    wanted = [c for c in CONDITIONS if c != "scene"]
    warm = {"geometry": 0.3, "fast": 0.03, "unet": 0.05, "rgb": 0.15}
    scored = {name: [("room", errors(c, e)) for c in wanted] for name, e in warm.items()}
    scored["fast_cold"] = [("room", errors("30 cm", 0.03))]
    scene = {"frames": 9, "joints": 5, "pck": 0.95, "pck_posed": 1.0, "swapped_frames": 0,
             "locked_after": 3, "largest_step_m": 0.1,
             "status": {"initialising": 0.2, "tracking": 0.8, "lost": 0.0}}  # fmt: skip
    scenes = {"fast_cold": {"bonn_tablet": scene}, "geometry": {}}
    return content_of(0, scored, scenes, {"rgb": "no"})


def grid(content, start):
    return next(g for g in all_grids(content) if g.title.startswith(start))


def test_every_table_is_as_wide_as_its_header(content):
    grids = [targets_grid(content), *all_grids(content)]
    assert len(grids) == 6
    for one in grids:
        assert one.rows and {len(row) for row in one.rows} == {len(one.header)}, one.title


def test_methods_stand_beside_each_other_in_each_condition(content):
    rows = grid(content, "Synthetic people in rooms").rows
    assert [row[0] for row in rows if row[1] == "30 cm"] == [
        "geometry alone", "fast", "unet", "RGB regression", "fast, cold start"
    ]  # fmt: skip
    column = grid(content, "Synthetic people in rooms").header.index("all [cm]")
    assert [row[column] for row in rows if row[1] == "clean"] == ["30.0", "3.0", "5.0", "15.0"]


def test_starts_and_recoveries_count_frames(content):
    (start,) = grid(content, "Cold starts").rows
    assert start == ("fast, cold start", "30 cm", "1", "100.0%", "100.0%", "1")
    again = {row[0]: row for row in grid(content, "Recovery").rows if row[1] == "hidden"}
    assert again["fast"][2:5] == ("1", "100.0%", "100.0%")
    assert again["geometry alone"][3] == "0.0%" and again["geometry alone"][6] == "0"


def test_targets_are_those_of_the_first_network(content):
    found = {target.what: target for target in targets(content)}
    mean = found["object 30 cm before: mean error"]
    assert mean.measured == pytest.approx(3.0) and mean.passed
    assert not found["object 30 cm before: mean error of visible joints"].passed
    assert found["joints within 10 cm, 60 cm less 30 cm"].measured == 0.0
    assert not found["true joints within their 95 % ellipsoid, greatest of the distances"].passed
    assert found["bonn_tablet from a cold start, PCK@0.2"].passed
    assert found["sofa from a cold start, PCK@0.2"].passed is None


def test_without_a_network_there_are_no_targets(content):
    for name in ("fast", "fast_cold", "unet"):
        del content["scores"][name]
    assert targets(content) == [] and not targets_grid(content).rows


def test_curves_have_a_line_for_each_method_and_dashes_for_cold_starts(content):
    figure = draw_curves(content["scores"])
    lines = [line for axis in figure.axes for line in axis.lines]
    assert len(figure.axes) == 3 * 4 and len(lines) == 3 * (4 * 4 + 1)
    (legend,) = figure.legends
    said = [text.get_text() for text in legend.get_texts()]
    assert said == [in_words(name) for name in content["scores"]]
    assert sum(line.get_linestyle() == "--" for line in lines) == 3
    assert len({line.get_color() for line in lines}) == 4


def test_joints_are_those_of_the_first_network(content):
    (axis,) = draw_joints(content["scores"]).axes
    assert axis.get_title().startswith("fast:")
    assert {round(bar.get_height(), 6) for bar in axis.patches} == {3.0}


def test_waits_rise_where_the_person_is_found(content):
    start, again = draw_waits(content["scores"]).axes
    (line,) = start.lines
    assert line.get_label() == "fast (1)" and line.get_ydata()[:2].tolist() == [0.0, 100.0]
    found = {line.get_label(): line.get_ydata()[-1] for line in again.lines}
    assert found == {"geometry alone (2)": 0.0, "fast (2)": 100.0, "unet (2)": 100.0,
                     "RGB regression (2)": 100.0}  # fmt: skip


def test_the_effect_of_targets_is_told_in_millimetres(content):
    clean = content["scores"]["fast"]["room"]["clean"]
    off = clean | {"all": clean["all"] | {"mean_m": 0.0315}}
    content["scores"]["fast_no_targets"] = {"room": {"clean": off}}
    found = {target.what: target for target in targets(content)}
    effect = found["effect of the targets on the mean error while tracking, no object"]
    assert effect.measured == pytest.approx(1.5) and effect.unit == "mm" and effect.passed


def test_nothing_scored_is_nothing_drawn(tmp_path):
    assert write_pictures({"scores": {}}, tmp_path) == ()

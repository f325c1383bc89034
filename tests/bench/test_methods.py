# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import pytest

from kintrack.bench.cases import CONDITIONS, Case
from kintrack.bench.digest import code_of, result_digest
from kintrack.bench.methods import methods_of
from kintrack.errors import ConfigError

FILES = {"fast": Path("a"), "unet": Path("b")}


def case(group, condition):
    return Case(group, "x", condition, None)


def asked(group, condition, files=FILES):
    return {m.name for m in methods_of(files) if m.runs_on(case(group, condition))}


def test_every_labelled_method_also_starts_cold_behind_the_nearest_object():
    names = {m.name for m in methods_of(FILES)}
    assert names - asked("room", "30 cm") == {
        "fast_calibrated_cold", "true_labels_calibrated_cold"
    }  # fmt: skip
    assert {"fast_cold", "unet_cold", "true_labels_cold", "geometry_cold", "rgb"} < names


def test_targets_are_switched_off_for_the_first_network_only():
    assert {m.name for m in methods_of(FILES) if not m.targets} == {
        "fast_no_targets", "fast_no_targets_cold"
    }  # fmt: skip
    assert "fast_no_targets" in asked("room", "absent 2 s") & asked("room", "clean")
    assert "fast_no_targets" not in asked("room", "60 cm")


def test_hard_gates_are_compared_for_the_first_network_only():
    assert [m.name for m in methods_of(FILES) if not m.soft] == ["fast_hard_gates"]
    assert "fast_hard_gates" in asked("room", "30 cm") & asked("room", "clean")
    assert "fast_hard_gates" not in asked("scenes", "clean") | asked("room", "absent 2 s")


def test_full_scenes_are_started_cold_without_true_labels():
    cold = {"geometry_cold", "fast_cold", "fast_calibrated_cold", "unet_cold"}
    assert asked("scenes", "clean") == cold


def test_real_people_have_neither_labels_nor_colour_and_their_clean_fit_is_geometry():
    assert asked("real", "30 cm") == {"geometry", "fast"}
    assert asked("real", "clean") == {"geometry"}


def test_the_first_network_is_this_projects_own():
    assert [m.name for m in methods_of(FILES) if m.main] == [
        "fast", "fast_cold", "fast_calibrated", "fast_calibrated_cold"
    ]  # fmt: skip
    assert not [m for m in methods_of({}) if m.main]


def test_methods_are_chosen_by_name_and_wrong_names_list_the_right_ones():
    assert [m.name for m in methods_of(FILES, ["unet_cold", "rgb"])] == ["unet_cold", "rgb"]
    with pytest.raises(ConfigError, match="magic: allowed are geometry, geometry_cold.*rgb"):
        methods_of(FILES, ["magic"])
    with pytest.raises(ConfigError, match="that of another method"):
        methods_of({"rgb": Path("a")})


def test_a_kept_result_is_told_by_weights_start_and_recordings(tmp_path):
    for name in "ab":
        (tmp_path / name).write_text(name)
    a, b = tmp_path / "a", tmp_path / "b"
    known = {
        result_digest(False, a, [False], ["x", "y"]), result_digest(False, b, [False], ["x", "y"]),
        result_digest(False, a, [True], ["x", "y"]), result_digest(False, a, [False], ["x", "z"]),
        result_digest(False, None, [False], ["x"]), result_digest(True, None, [False], ["x"]),
    }  # fmt: skip
    assert len(known) == 6
    assert result_digest(False, a, [False], ["x", "y"]) in known


def test_words_do_not_count_as_code(tmp_path):
    text = '"""A."""\nx = 1\ndef f():\n    """B."""\n    return "C"\n'
    changed = [text.replace(letter, "Z") for letter in "ABC"] + [text + "# D\n"]
    path, codes = tmp_path / "x.py", []
    for one in (text, *changed):
        path.write_text(one)
        codes.append(code_of(path))
    assert [code == codes[0] for code in codes] == [True, True, True, False, True]


def test_conditions_name_their_distance_and_their_folder():
    distances = {c: case("room", c).distance_m for c in CONDITIONS}
    assert {c: d for c, d in distances.items() if d} == {"30 cm": 0.3, "45 cm": 0.45, "60 cm": 0.6}
    assert case("room", "absent 2 s").key == "room/absent_2_s/x"

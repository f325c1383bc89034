# SPDX-License-Identifier: Apache-2.0
"""The model's files: what is broken or missing is named."""

import shutil

import numpy as np
import pytest

from kintrack.body import load_body
from kintrack.errors import ModelError
from kintrack.human import load_human
from kintrack.rig import load_rig
from kintrack.skin import load_skin


@pytest.fixture
def copied_model(model_folder, tmp_path):
    shutil.copytree(model_folder, tmp_path / "model")
    return tmp_path / "model"


@pytest.mark.parametrize("frame", ["l_hand_center", "r_shank", "head"])
def test_a_urdf_without_a_needed_frame_names_file_and_frame(copied_model, frame):
    urdf = copied_model / "human.urdf"
    urdf.write_text(urdf.read_text().replace(f'"{frame}"', '"other"'))
    with pytest.raises(ModelError) as caught:
        load_body(copied_model)
    assert str(urdf) in str(caught.value) and frame in str(caught.value)


def test_a_missing_urdf_names_the_file(tmp_path):
    with pytest.raises(ModelError, match="human.urdf") as caught:
        load_body(tmp_path)
    assert str(tmp_path) in str(caught.value)


@pytest.mark.parametrize("text", ["", "not xml", "<robot name='x'><link name='a'/>"])
def test_a_broken_urdf_names_the_file(copied_model, text):
    (copied_model / "human.urdf").write_text(text)
    with pytest.raises(ModelError, match="human.urdf"):
        load_body(copied_model)


@pytest.mark.parametrize("name", ["rig.npz", "tracking.npz"])
@pytest.mark.parametrize("damage", ["missing", "empty", "truncated", "text"])
def test_a_broken_array_file_names_the_file(copied_model, name, damage):
    path = copied_model / "skin" / name
    whole = path.read_bytes()
    path.unlink()
    if damage != "missing":
        content = {"empty": b"", "truncated": whole[: len(whole) // 2], "text": b"hello"}
        path.write_bytes(content[damage])
    with pytest.raises(ModelError, match=name):
        load_human(copied_model)


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("rig.npz", "Ts_root_link_bind"),
        ("rig.npz", "extra_names"),
        ("tracking.npz", "weights"),
        ("tracking.npz", "shape_basis_m"),
    ],
)
def test_a_file_without_a_needed_array_names_file_and_array(copied_model, name, array):
    path = copied_model / "skin" / name
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files if key != array}
    np.savez(path, **arrays)
    with pytest.raises(ModelError, match=name) as caught:
        load_human(copied_model)
    assert array in str(caught.value)


@pytest.mark.parametrize(
    "shape", [np.zeros(50), np.array([np.nan]), np.array([np.inf, 0]), np.zeros((2, 2))]
)
def test_a_shape_that_the_model_does_not_have_is_refused(shape, model_folder):
    available = len(load_rig(model_folder).explained)
    for load in (load_body, load_skin):
        with pytest.raises(
            ModelError, match=f"(?s)shape = .*up to {available} finite coefficients"
        ):
            load(shape=shape)

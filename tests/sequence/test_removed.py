# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from kintrack.sequence.removed import background_removed


def image(**parts):
    depth = np.zeros((212, 256), np.float32)
    if "person" in parts:
        depth[30:190, 100:150] = 2.5
    if "cut_off" in parts:
        depth[30:, 90:170] = 2.0
    if "floor" in parts:
        depth[150:] = 3.0
    if "wall" in parts:
        depth[depth == 0] = 4.0
    return depth


@pytest.mark.parametrize("parts", [("person",), ("cut_off",), ()])
def test_a_person_alone_has_no_background(parts):
    assert background_removed(image(**dict.fromkeys(parts)))


@pytest.mark.parametrize("parts", [("person", "floor"), ("person", "wall"), ("cut_off", "floor")])
def test_a_floor_is_a_background_even_where_the_rest_is_too_far_away(parts):
    assert not background_removed(image(**dict.fromkeys(parts)))

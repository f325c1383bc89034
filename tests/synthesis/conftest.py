# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from synthesis.demo import SHAPE
from synthesis.people.person import Person, load_person


@pytest.fixture(scope="session")
def person() -> Person:
    return load_person(np.array(SHAPE))

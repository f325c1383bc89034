# SPDX-License-Identifier: Apache-2.0
import pytest

from synthesis.demo import PERSON
from synthesis.people.person import Person, load_person


@pytest.fixture(scope="session")
def person() -> Person:
    return load_person(PERSON)

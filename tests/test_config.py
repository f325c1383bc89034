# SPDX-License-Identifier: Apache-2.0
import ast
import dataclasses
import inspect
import json
import math
import re

import pytest

from kintrack import config as module
from kintrack.config import StartConfig, TrackerConfig
from kintrack.errors import ConfigError

SECTIONS = [type(getattr(TrackerConfig(), f.name)) for f in dataclasses.fields(TrackerConfig)]
FIELDS = [
    (section, field)
    for section in SECTIONS
    for field in dataclasses.fields(section)
    if not isinstance(field.default, str | bool)
]
NAMES = [f"{section.__name__}.{field.name}" for section, field in FIELDS]
every_field = pytest.mark.parametrize(("section", "field"), FIELDS, ids=NAMES)


def refusal(section, field, value):
    with pytest.raises(ConfigError) as caught:
        section(**{field.name: value})
    return str(caught.value)


def test_the_defaults_are_allowed():
    assert TrackerConfig() == TrackerConfig()


@every_field
@pytest.mark.parametrize("value", [-1e9, 1e9, math.nan, math.inf, -math.inf])
def test_a_value_out_of_bounds_names_field_value_and_bounds(section, field, value):
    message = refusal(section, field, value)
    assert f"{section.__name__}.{field.name} = {value!r}" in message
    low, high = re.search(r": (\S+) to (\S+) are allowed", message).groups()
    assert float(low) < float(high)


@every_field
def test_the_default_lies_within_the_bounds_that_the_message_gives(section, field):
    message = refusal(section, field, math.nan)
    low, high = map(float, re.search(r": (\S+) to (\S+) are allowed", message).groups())
    assert low <= getattr(section(), field.name) <= high


@every_field
def test_the_bounds_themselves_are_allowed(section, field):
    message = refusal(section, field, math.nan)
    bounds = map(float, re.search(r": (\S+) to (\S+) are allowed", message).groups())
    kind = type(getattr(section(), field.name))
    for bound in map(kind, bounds):
        try:
            assert getattr(section(**{field.name: bound}), field.name) == bound
        except ConfigError as error:  # another field may forbid it, and then says so
            assert f"{field.name} = {bound!r}: {bound:g} to" not in str(error)
            assert "must be below" in str(error)


def test_a_name_must_be_one_of_those_that_are_known():
    with pytest.raises(ConfigError, match="method = 'newton': gauss-newton, ipopt are possible"):
        module.SolverConfig(method="newton")


WHOLE = [(s, f) for s, f in FIELDS if isinstance(getattr(s(), f.name), int)]


@pytest.mark.parametrize(("section", "field"), WHOLE, ids=lambda x: getattr(x, "name", ""))
def test_a_count_must_be_a_whole_number(section, field):
    value = getattr(section(), field.name) + 0.5
    assert f"{field.name} = {value!r}" in refusal(section, field, value)


@every_field
def test_nothing_can_be_changed_afterwards(section, field):
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(section(), field.name, 1)


def test_the_sections_themselves_cannot_be_replaced_in_place():
    with pytest.raises(dataclasses.FrozenInstanceError):
        TrackerConfig().solver = None


def test_the_smallest_person_must_be_smaller_than_the_tallest():
    with pytest.raises(ConfigError, match=r"min_height_m = 1.9.*below.*max_height_m = 1.8"):
        StartConfig(min_height_m=1.9, max_height_m=1.8)


def test_every_field_has_a_docstring_and_a_unit_where_it_has_one():
    tree = ast.parse(inspect.getsource(module))
    for node in (n for n in tree.body if isinstance(n, ast.ClassDef)):
        for here, after in zip(node.body, [*node.body[1:], None], strict=True):
            if not isinstance(here, ast.AnnAssign):
                continue
            name = f"{node.name}.{here.target.id}"
            assert isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant), name
            for suffix, unit in (("_m", "[m]"), ("_rad", "[rad]"), ("_px", "[px]")):
                if name.endswith(suffix):
                    assert unit in after.value.value, name


def test_the_whole_configuration_is_plain_json():
    flat = json.loads(json.dumps(dataclasses.asdict(TrackerConfig()), allow_nan=False))
    assert set(flat) == {field.name for field in dataclasses.fields(TrackerConfig)}

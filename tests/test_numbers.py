"""Every number of a configuration has finite ends, and an error names the field, the value and what is accepted."""

import dataclasses
import math
import re
from collections.abc import Iterator
from typing import Any, get_args

import numpy as np
import pytest

from e2efly.config import ALGORITHMS, CameraConfig, EnvConfig, StageConfig, check_numbers, number
from e2efly.deploy.excitation import ExcitationOptions
from e2efly.deploy.settings import FlightSettings
from e2efly.numbers import Rule, rule_of
from e2efly.registry import load
from e2efly.tasks import TASKS

PARTS: tuple[Any, ...] = (
    *(EnvConfig(), CameraConfig(), FlightSettings(), ExcitationOptions(), StageConfig({})),
    *(algorithm() for algorithm in ALGORITHMS.values()),
    *(task() for task in TASKS.values()),
    *(load(task.route)() for task in TASKS.values() if task.route),
    TASKS["hover"].recipe("ppo"),
)
ELSEWHERE = {
    "randomize", "weights", "parameters", "changes", "command_range",  # names and numbers, or a range per mode
    "solids", "mission", "roll", "pitch", "throttle", "yaw",  # boxes, and the channels of a receiver
}  # fmt: skip
"""Fields that their own checks know."""


def fields(part: Any) -> Iterator[tuple[Any, dataclasses.Field[Any]]]:
    """Every field of a configuration and its parts, with the part that it is in."""
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            yield from fields(value)
        else:
            yield part, field


FIELDS = {f"{type(part).__name__}.{field.name}": (part, field) for whole in PARTS for part, field in fields(whole)}
RULES: dict[str, tuple[Any, str, Rule]] = {
    name: (part, field.name, rule)
    for name, (part, field) in FIELDS.items()
    if (rule := rule_of(type(part), field)) is not None
}


def test_every_field_of_numbers_has_a_rule_with_finite_ends_that_accepts_its_default() -> None:
    ruled = {name for name, (_, field) in FIELDS.items() if re.search(r"\b(int|float)\b", str(field.type))}
    assert {name for name in ruled - RULES.keys() if name.partition(".")[2] not in ELSEWHERE} == set()
    assert len(RULES) > 150
    for name, (part, _, rule) in RULES.items():
        assert -math.inf < rule.low < rule.high < math.inf, name
        assert np.isfinite(np.float32([rule.low, rule.high])).all()
        check_numbers("part", part)


@pytest.mark.parametrize("name", RULES)
def test_what_a_rule_does_not_accept_is_named(name: str) -> None:
    part, field, rule = RULES[name]
    default = getattr(part, field)
    count = (len(default) or 1) if isinstance(default, tuple) else 2 if rule.rising else 0

    def given(value: Any) -> Any:
        return (value,) * count if count else value

    def accepted(value: Any) -> bool:
        part_now = dataclasses.replace(part, **{field: value})
        try:
            check_numbers("part", part_now)
        except ValueError as error:
            low, high = (re.escape(f"{x:.0f}" if x % 1 == 0 else f"{x:g}") for x in (rule.low, rule.high))
            assert re.search(rf"^part\.{field} is .*; accepted: .*number.* {low} to {high}", str(error)), error
            assert repr(value)[:20] in str(error)
            return False
        return True

    assert accepted(given(rule.high))
    assert accepted(given(rule.low if rule.low % 1 == 0 or not isinstance(default, int) else math.ceil(rule.low)))
    for bad in (rule.low - 1, rule.high + 1, -1e300, 1e300, 10**400, math.nan, -math.inf, "1", True, [1.0]):
        assert not accepted(given(bad)), bad
    assert accepted(given(math.inf)) == rule.endless
    kinds = get_args(type(part).__dataclass_fields__[field].type)
    assert accepted(None) == (type(None) in kinds)
    if count and ... not in kinds:
        assert not accepted((rule.low,) * (count + 1)) and not accepted(rule.low)
    if rule.rising:
        assert not accepted((rule.high, rule.low))
    if isinstance(default, int):
        assert not accepted(rule.low + 0.5)


def test_a_field_that_overrides_another_keeps_its_rule() -> None:
    @dataclasses.dataclass(frozen=True)
    class Parent:
        length: float = number(1.0, above=0, high=3.0)

    @dataclasses.dataclass(frozen=True)
    class Child(Parent):
        length: float = 2.0

    with pytest.raises(ValueError, match=r"it\.length is 0.0; accepted: a number, 1e-09 to 3"):
        check_numbers("it", Child(0.0))

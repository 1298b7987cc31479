"""What a field of a configuration accepts: numbers between finite ends, words of a choice.

An error names the field, the value and what is accepted.
"""

import ast
import dataclasses
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

import numpy as np
import pytest

import e2efly
from e2efly.config import ALGORITHMS, CameraConfig, EnvConfig, StageConfig, check_fields, number
from e2efly.config.numbers import Rule, rule_of
from e2efly.config.reading import read
from e2efly.config.registry import load
from e2efly.flight.excitation import ExcitationOptions, StepsOptions
from e2efly.flight.pose.conditions import Checks
from e2efly.flight.settings import FlightSettings
from e2efly.tasks import TASKS

PARTS: tuple[Any, ...] = (
    *(EnvConfig(), CameraConfig(), FlightSettings(), Checks(), ExcitationOptions(), StepsOptions(), StageConfig({})),
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
SIGNED = {
    "camera_pitch", "camera_position", "centre", "circle_rate", "ground_height", "high", "log_std", "look_at", "low",
    "only", "origin", "origin_yaw", "pad", "phase", "pitch", "position", "rise", "slit", "slit_roll", "slit_yaw",
    "target", "thrower", "turn_rate",
}  # fmt: skip
"""Fields that may be below 0: positions, angles, rates with a sense."""
POSITIVE = {
    *("EnvConfig.control_rate", "HoverConfig.episode_s", "HoverConfig.radius", "TrainConfig.steps", "PPOConfig.envs"),
    *("Fence.speed", "Fence.tilt", "Fence.braking", "Fence.reaction", "StageConfig.success", "StageConfig.steps"),
    *("Checks.max_age", "Checks.jump_speed", "Checks.jump_count", "Checks.frozen_after", "Checks.rate_cutoff"),
}
"""Fields that may not be 0. Neither may those of `FlightSettings`, but for the height of the ground."""


def fields(part: Any) -> Iterator[tuple[Any, dataclasses.Field[Any]]]:
    """Every field of a configuration and its parts, with the part that it is in."""
    for field in dataclasses.fields(part):
        value = getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            yield from fields(value)
        else:
            yield part, field


def with_numbers(file: Path) -> Iterator[str]:
    """The classes of a file that have a field by `number`."""
    for kind in (node for node in ast.walk(ast.parse(file.read_text())) if isinstance(node, ast.ClassDef)):
        values = [entry.value for entry in kind.body if isinstance(entry, ast.AnnAssign)]
        if any(ast.unparse(value).startswith("number(") for value in values if value is not None):
            yield kind.name


FIELDS = {f"{type(part).__name__}.{field.name}": (part, field) for whole in PARTS for part, field in fields(whole)}
RULES: dict[str, tuple[Any, str, Rule]] = {
    name: (part, field.name, rule)
    for name, (part, field) in FIELDS.items()
    if (rule := rule_of(type(part), field)) is not None
}
CHOICES = {name: (part, field) for name, (part, field) in FIELDS.items() if get_origin(field.type) is Literal}


def test_every_class_with_such_fields_is_here() -> None:
    known = {kind.__name__ for part, _ in FIELDS.values() for kind in type(part).__mro__}
    written = {name for file in Path(e2efly.__file__).parent.rglob("*.py") for name in with_numbers(file)}
    assert len(written) > 20
    assert written <= known


def test_every_field_of_numbers_has_a_rule_with_finite_ends_that_accepts_its_default() -> None:
    ruled = {name for name, (_, field) in FIELDS.items() if re.search(r"\b(int|float)\b", str(field.type))}
    assert {name for name in ruled - RULES.keys() if name.partition(".")[2] not in ELSEWHERE} == set()
    assert len(RULES) > 150
    assert {name.partition(".")[2] for name, (_, _, rule) in RULES.items() if rule.low < 0} == SIGNED
    flight = {name for name in RULES if name.startswith("FlightSettings.")} - {"FlightSettings.ground_height"}
    assert [name for name in POSITIVE | flight if RULES[name][2].low <= 0] == []
    shares = ("StageConfig.success", "EnvConfig.latency_spread")
    assert [RULES[name][2].high for name in shares] == [1.0, 1.0]
    for name, (part, _, rule) in RULES.items():
        assert -math.inf < rule.low < rule.high < math.inf, name
        assert np.isfinite(np.float32([rule.low, rule.high])).all()
        check_fields("part", part)


@pytest.mark.parametrize("name", RULES)
def test_what_a_rule_does_not_accept_is_named(name: str) -> None:
    part, field, rule = RULES[name]
    default = getattr(part, field)
    count = (len(default) or 1) if isinstance(default, tuple) else 2 if rule.rising else 0

    def given(value: Any) -> Any:
        return (value,) * count if count else value

    def accepted(value: Any) -> bool:
        try:
            check_fields("part", dataclasses.replace(part, **{field: value}))
        except ValueError as error:
            low, high = (re.escape(f"{x:.0f}" if x % 1 == 0 else f"{x:g}") for x in (rule.low, rule.high))
            assert re.search(rf"^(part|checks)\.{field} is .*; accepted: .*number.* {low} to {high}", str(error)), error
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


@pytest.mark.parametrize("name", CHOICES)
def test_a_word_that_is_no_choice_is_named_with_the_choices(name: str) -> None:
    part, field = CHOICES[name]
    words = get_args(field.type)
    for word in words:
        check_fields("part", dataclasses.replace(part, **{field.name: word}))
        assert read(field.type, word, "file") == word
    for bad in (f"{words[0]}x", "", words[0].upper(), None, 1, True, [words[0]]):
        said = rf"{{}} is {re.escape(repr(bad))}; accepted: {', '.join(map(repr, words))}$"
        with pytest.raises(ValueError, match="^" + said.format(rf"(part|checks)\.{field.name}")):
            check_fields("part", dataclasses.replace(part, **{field.name: bad}))
        with pytest.raises(ValueError, match="^" + said.format("file")):
            read(field.type, bad, "file")


def test_a_field_that_overrides_another_keeps_its_rule() -> None:
    @dataclasses.dataclass(frozen=True)
    class Parent:
        length: float = number(1.0, above=0, high=3.0)

    @dataclasses.dataclass(frozen=True)
    class Child(Parent):
        length: float = 2.0

    with pytest.raises(ValueError, match=r"it\.length is 0.0; accepted: a number, 1e-09 to 3"):
        check_fields("it", Child(0.0))

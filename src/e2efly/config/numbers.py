"""Fields of configurations that carry their own rules. Imports no JAX."""

import dataclasses
import math
import numbers
from dataclasses import dataclass
from typing import Any, Literal, cast, get_args, get_origin

from e2efly.config.tables import LARGEST, shown

RULE, SHAPE, ADDED = "rule", "sets_shapes", "added"
"""Keys of a field's metadata."""
SMALLEST = 1e-9
"""By how much a number must be larger than the end that its rule excludes. Products of such numbers are not 0 in
float32."""
SPEED, BODY_RATE, ANGLE = 100.0, 100.0, math.pi
"""Largest speed, m/s, rate of turning, rad/s, and angle, rad, of what a configuration asks for."""
LATEST = 1.0
"""Longest delay with which an environment trains, s. No vehicle flies with an older state, or so long after a
command."""
MOST = 2**31 - 1
"""The largest whole number, unless a rule says otherwise."""


@dataclass(frozen=True)
class Rule:
    """The accepted values of a number, or of each of several numbers. Both ends are finite, and accepted."""

    low: float = 0.0
    """Smallest accepted value."""
    high: float = LARGEST
    """Largest accepted value."""
    rising: bool = False
    """Whether there are two numbers, the smaller one first."""
    endless: bool = False
    """Whether infinity is accepted, too."""

    def accepts(self, value: float) -> bool:
        """Whether a number is accepted. NaN is not."""
        return self.low <= value <= self.high or (self.endless and value == math.inf)


def number(
    default: Any,
    *,
    low: float = 0.0,
    above: float | None = None,
    high: float = math.inf,
    rising: bool = False,
    endless: bool = False,
    added: bool = False,
    sets_shapes: bool = False,
) -> Any:
    """A field of one or several numbers, with its default and its rule.

    Every number has finite ends. Where they are not given, they are 0 and `LARGEST`, or `MOST` for whole numbers.

    Args:
        default: default of the field.
        low: smallest accepted value. -inf for positions, angles and rates: as far down as `high` is by default.
        above: the value must be larger than this.
        high: largest accepted value.
        rising: whether there are two numbers, the smaller one first.
        endless: whether infinity is accepted, too.
        added: as for `shape`.
        sets_shapes: whether it determines which program is compiled, as a field made by `shape`.
    """
    whole = _is_whole(default)
    largest = MOST if whole else LARGEST
    least = low if above is None else above + (1 if whole else SMALLEST)
    rule = Rule(max(least, -largest), high if high < math.inf else largest, rising, endless)
    return dataclasses.field(default=default, metadata={RULE: rule, ADDED: added, SHAPE: sets_shapes})


def shape(default: Any, *, added: bool = False) -> Any:
    """A field, with its default, that determines which program is compiled.

    `added`: an older version did not have the field, and did what the default does. A fingerprint of a configuration
    (`e2efly.runs.inputs.fingerprint`) leaves it out while it has its default.
    """
    return dataclasses.field(default=default, metadata={SHAPE: True, ADDED: added})


def check_fields(prefix: str, part: Any) -> None:
    """Check every number and every choice of a configuration, and of its parts, by the rules of their fields.

    The rule of a choice is its type, a `Literal`.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for field in dataclasses.fields(part):
        name, value = f"{prefix}.{field.name}" if prefix else field.name, getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            check_fields(name, value)
        elif (rule := rule_of(type(part), field)) is not None and not _fits(field, rule, value):
            raise ValueError(f"{name} is {shown(value)}; accepted: {_accepted(field, rule)}")
        elif get_origin(field.type) is Literal and value not in (words := get_args(field.type)):
            raise ValueError(f"{name} is {shown(value)}; accepted: {', '.join(map(repr, words))}")


def rule_of(kind: type, field: dataclasses.Field[Any]) -> Rule | None:
    """The rule of a field: its own, that of the field which it overrides, or else that of `number` without options.

    None: it is no field of numbers.
    """
    for parent in kind.__mro__:
        above = getattr(parent, "__dataclass_fields__", {}).get(field.name)
        if above is not None and RULE in above.metadata:
            return above.metadata[RULE]
    default = field.default
    given = default if isinstance(default, tuple) and default else (default,)
    return number(default).metadata[RULE] if all(map(_is_number, given)) else None


def _fits(field: dataclasses.Field[Any], rule: Rule, value: Any) -> bool:
    """Whether a value is accepted."""
    if value is None:
        return _optional(field)
    count, whole = _count(field, rule), _whole(field)
    if isinstance(value, tuple) != (count is not None) or (count and len(value) != count):
        return False
    given = value if isinstance(value, tuple) else (value,)
    if not all(_is_number(x) and rule.accepts(x) and (not whole or x % 1 == 0) for x in given):
        return False
    return not rule.rising or list(given) == sorted(given)


def _accepted(field: dataclasses.Field[Any], rule: Rule) -> str:
    """What is accepted, in words."""
    count, whole = _count(field, rule), _whole(field)
    kind = f"{'whole ' * whole}number"
    low, high = (f"{x:.0f}" if whole else f"{x:g}" for x in (rule.low, rule.high))
    ends = f"{low} to {high}{', or inf' * rule.endless}{', or none' * _optional(field)}"
    return f"a {kind}, {ends}" if count is None else f"{count or ''} {'rising ' * rule.rising}{kind}s, {ends}".lstrip()


def _optional(field: dataclasses.Field[Any]) -> bool:
    return field.default is None or type(None) in get_args(cast(Any, field.type))


def _count(field: dataclasses.Field[Any], rule: Rule) -> int | None:
    """How many numbers a field has. None: one, and no tuple. 0: any number of them."""
    if not isinstance(field.default, tuple):
        return 2 if rule.rising else None
    return 0 if ... in get_args(cast(Any, field.type)) else len(field.default)


def _whole(field: dataclasses.Field[Any]) -> bool:
    """Whether a field has whole numbers."""
    return _is_whole(field.default) or (not field.default and int in get_args(cast(Any, field.type)))


def _is_whole(default: Any) -> bool:
    return isinstance(default[0] if isinstance(default, tuple) and default else default, int)


def _is_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)

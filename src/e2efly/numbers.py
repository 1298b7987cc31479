"""Fields of configurations that carry their own rules. Imports no JAX."""

import dataclasses
import math
import numbers
from dataclasses import dataclass
from typing import Any, cast, get_args

RULE, SHAPE = "rule", "sets_shapes"
"""Keys of a field's metadata."""


@dataclass(frozen=True)
class Rule:
    """The accepted values of a number, or of each of several numbers."""

    low: float = 0.0
    """Smallest accepted value."""
    above: float | None = None
    """If given, the value must also be larger than this."""
    high: float = math.inf
    """Largest accepted value."""
    rising: bool = False
    """Whether there are two numbers, the smaller one first."""
    endless: bool = False
    """Whether infinity is accepted, too."""

    @property
    def _between(self) -> str:
        most = f"{self.high:g}"
        return f"{self.low:g} to {most}" if self.above is None else f"above {self.above:g}, at most {most}"

    def problem(self, value: Any) -> str | None:
        """What is accepted in place of a value. None: the value is accepted."""
        numbers = value if isinstance(value, tuple) else (value,)
        if not numbers or any(isinstance(x, bool) or not isinstance(x, int | float) for x in numbers):
            return None
        if math.isfinite(self.high):
            least = self.low if self.above is None else self.above
            within = all(least <= x <= self.high and x != self.above for x in numbers)  # also false for NaN
            return None if within else self._between
        if not all(map(math.isfinite, numbers)) and not (self.endless and value == math.inf):
            return "finite numbers"
        if self.above is not None and min(numbers) <= self.above:
            return f"more than {self.above:g}"
        if min(numbers) < self.low:
            return f"{self.low:g} or more"
        if self.rising and list(numbers) != sorted(numbers):
            return "two rising numbers"
        return None


NOT_NEGATIVE = Rule()
"""The rule of fields that give no other rule."""


def number(
    default: Any,
    *,
    low: float = 0.0,
    above: float | None = None,
    high: float = math.inf,
    rising: bool = False,
    endless: bool = False,
) -> Any:
    """A field of one or several numbers, with its default and its rule.

    Without a rule, numbers of at least 0 are accepted.

    Args:
        default: default of the field.
        low: smallest accepted value; -inf for positions, angles and rates.
        above: the value must be larger than this.
        high: largest accepted value.
        rising: whether there are two numbers, the smaller one first.
        endless: whether infinity is accepted, too.
    """
    return dataclasses.field(default=default, metadata={RULE: Rule(low, above, high, rising, endless)})


def shape(default: Any) -> Any:
    """A field, with its default, that determines which program is compiled."""
    return dataclasses.field(default=default, metadata={SHAPE: True})


def check_numbers(prefix: str, part: Any) -> None:
    """Check every number of a configuration, and of its parts, by the rules of their fields.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for field in dataclasses.fields(part):
        name, value = f"{prefix}.{field.name}", getattr(part, field.name)
        if dataclasses.is_dataclass(value):
            check_numbers(name, value)
        elif accepted := _kind_problem(field, value):
            raise ValueError(f"{name} is {value!r}; accepted: {accepted}")
        elif accepted := field.metadata.get(RULE, NOT_NEGATIVE).problem(value):
            raise ValueError(f"{name} is {value}; accepted: {accepted}")


def _kind_problem(field: dataclasses.Field[Any], value: Any) -> str | None:
    """What is accepted in place of a value that is not a number although the default is one.

    None: it has the same kind.
    """
    default = field.default
    if value is None and type(None) in get_args(cast(Any, field.type)):
        return None
    if isinstance(default, tuple) and default and all(map(_is_number, default)):
        good = isinstance(value, tuple) and len(value) == len(default) and all(map(_is_number, value))
        return None if good else f"{len(default)} numbers"
    whole = isinstance(default, int)
    if not _is_number(default) or (_is_number(value) and (not whole or value % 1 == 0)):  # type: ignore[operator]
        return None
    return "a whole number" if isinstance(default, int) else "a number"


def _is_number(value: Any) -> bool:
    return isinstance(value, numbers.Real) and not isinstance(value, bool)

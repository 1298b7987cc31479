"""The strict reading of a contract's JSON: every value is checked, and errors name what is wrong."""

import dataclasses
from collections.abc import Collection
from typing import Any

from e2efly.config.names import nearest
from e2efly.config.numbers import LATEST
from e2efly.config.tables import shown

LARGEST = 1e6
"""Largest magnitude of a number, in any unit."""
LONGEST = 2000
"""Largest length of a text."""


def table(value: Any, where: str, kind: type) -> dict[str, Any]:
    """A JSON object that has the fields of the dataclass `kind` and no others."""
    known = [field.name for field in dataclasses.fields(kind)]
    if not isinstance(value, dict):
        raise refusal(where or "contract", value, f"an object with {', '.join(known)}")
    prefix = f"{where}." if where else ""
    for key in value:
        if key not in known:
            guess = nearest(key, known)
            hint = f"; did you mean {guess!r}?" if guess else ""
            raise ValueError(f"contract: unknown key {shown(prefix + key)}{hint} (accepted: {', '.join(known)})")
    if missing := [key for key in known if key not in value]:
        raise ValueError(
            f"contract: missing key {', '.join(repr(prefix + key) for key in missing)}; accepted: all of "
            f"{', '.join(known)}; export the policy again with this e2efly"
        )
    return value


def text(value: Any, where: str) -> str:
    """A text that can be shown and stored: not empty, not longer than `LONGEST`, without control characters."""
    if not isinstance(value, str) or not value.strip() or not value.isprintable() or len(value) > LONGEST:
        raise refusal(where, value, f"a text of 1 to {LONGEST} printable characters")
    return value


def one_of(value: Any, where: str, known: Collection[str]) -> str:
    """One of the known words."""
    if text(value, where) not in known:
        raise refusal(where, value, " or ".join(map(repr, known)))
    return value


def number(value: Any, where: str) -> float:
    """A finite number of a physically plausible size."""
    if type(value) in (int, float) and abs(value) <= LARGEST:  # false for NaN; not bool, which is an int to Python
        return float(value)
    raise refusal(where, value, f"a finite number, at most {LARGEST:g} in size")


def whole(value: Any, where: str, least: int) -> int:
    """A whole number from `least` to `LARGEST`."""
    if type(value) is not int or not least <= value <= LARGEST:
        raise refusal(where, value, f"a whole number, {least} or more, at most {LARGEST:g}")
    return value


def entries(value: Any, where: str, count: int | None) -> list[Any]:
    """A non-empty list, with `count` entries if that is given."""
    if not isinstance(value, list) or not value or (count is not None and len(value) != count):
        raise refusal(where, value, "a list that is not empty" if count is None else f"a list of {count} numbers")
    return value


def numbers(value: Any, where: str, count: int) -> tuple[float, ...]:
    """The given number of finite numbers."""
    return tuple(number(entry, f"{where}[{i}]") for i, entry in enumerate(entries(value, where, count)))


def seconds_range(value: Any, where: str) -> tuple[float, ...]:
    """Smallest and largest time, s."""
    low, high = numbers(value, where, 2)
    if not 0 <= low <= high <= LATEST:
        raise refusal(where, value, f"two rising numbers of seconds in [0, {LATEST:g}]")
    return low, high


def refusal(where: str, value: Any, accepted: str) -> ValueError:
    """The error that names the place, the value and what is accepted."""
    return ValueError(f"contract: {where} is {shown(value)}; accepted: {accepted}")

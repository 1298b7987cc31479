"""Read TOML files that users write. Errors name the place, the value and what is accepted."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

LARGEST = 1e4
"""Largest absolute value of a number in a course or a scene, in any unit. Up to it, float32 resolves about a
millimetre."""
_SHOWN = 200
"""Largest number of characters of a value in an error text."""


def read_table(path: Path) -> dict[str, Any]:
    """Read a whole TOML file.

    Raises:
        ValueError: naming the file, and what is wrong with it.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:  # not text, not TOML, too many digits, or nested too deep
        raise ValueError(f"{path}: not a TOML file: {error}") from None
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; accepted: the path of a .toml file") from None


def number(where: str, value: Any, what: str = "") -> float:
    """Check for a finite number.

    Args:
        where: file and key, for the error text.
        value: the value as read.
        what: text that follows the word "number" in the error text, such as ` of metres`.

    Raises:
        ValueError: naming all three.
    """
    if not _finite(value):
        raise ValueError(f"{where} is {shown(value)}; accepted: a finite number{what}, at most {LARGEST:g} in size")
    return float(value)


def numbers(where: str, value: Any, count: int, what: str = "") -> np.ndarray:
    """Check for a list of `count` finite numbers, (count,) float64. Arguments and errors are as for `number`."""
    if not isinstance(value, list) or len(value) != count or not all(map(_finite, value)):
        raise ValueError(
            f"{where} is {shown(value)}; accepted: {count} finite numbers{what}, at most {LARGEST:g} in size"
        )
    return np.asarray(value, np.float64)


def text(where: str, value: Any) -> str:
    """Check for a text. Arguments and errors are as for `number`."""
    if not isinstance(value, str):
        raise ValueError(f"{where} is {shown(value)}; accepted: a text")
    return value


def shown(value: Any) -> str:
    """A value as shown in an error text, shortened if it is long."""
    try:
        said = repr(value)
    except (ValueError, RecursionError):  # Python does not print integers with thousands of digits
        return "a number too large to be shown"
    return said if len(said) <= _SHOWN else f"{said[:_SHOWN]}..."


def _finite(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= LARGEST  # false for NaN

"""TOML files that people write, read with errors that name the place, the value and what is accepted."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

LARGEST = 1e4
"""Largest size of a number in a course or a scene, in whatever unit: there float32 has a millimetre of a metre left."""
_SHOWN = 200
"""Characters of a value in an error."""


def read_table(path: Path) -> dict[str, Any]:
    """All of a TOML file.

    Raises:
        ValueError: naming the file, and what is wrong with it.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:  # no text, no TOML, too many digits, or nested too deep
        raise ValueError(f"{path}: not a TOML file: {error}") from None
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; accepted: the path of a .toml file") from None


def number(where: str, value: Any, what: str = "") -> float:
    """A finite number.

    Args:
        where: file and key, for the error.
        value: as read.
        what: follows the word number in the error: ` of metres`.

    Raises:
        ValueError: naming all three.
    """
    if not _finite(value):
        raise ValueError(f"{where} is {shown(value)}; accepted: a finite number{what}, at most {LARGEST:g} in size")
    return float(value)


def numbers(where: str, value: Any, count: int, what: str = "") -> np.ndarray:
    """A list of so many finite numbers, (count,) float64; arguments and errors as of `number`."""
    if not isinstance(value, list) or len(value) != count or not all(map(_finite, value)):
        raise ValueError(
            f"{where} is {shown(value)}; accepted: {count} finite numbers{what}, at most {LARGEST:g} in size"
        )
    return np.asarray(value, np.float64)


def text(where: str, value: Any) -> str:
    """A text; arguments and errors as of `number`."""
    if not isinstance(value, str):
        raise ValueError(f"{where} is {shown(value)}; accepted: a text")
    return value


def shown(value: Any) -> str:
    """A value for an error, cut where it is long."""
    try:
        said = repr(value)
    except (ValueError, RecursionError):  # Python writes no whole number of thousands of digits
        return "a number too large to be shown"
    return said if len(said) <= _SHOWN else f"{said[:_SHOWN]}..."


def _finite(value: Any) -> bool:
    return type(value) in (int, float) and abs(value) <= LARGEST  # false for NaN

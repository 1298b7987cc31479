"""TOML files that people write, read with errors that name the place, the value and what is accepted."""

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np


def read_table(path: Path) -> dict[str, Any]:
    """All of a TOML file.

    Raises:
        ValueError: naming the file, and what is wrong with it.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
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
        raise ValueError(f"{where} is {value!r}; accepted: a finite number{what}")
    return float(value)


def numbers(where: str, value: Any, count: int, what: str = "") -> np.ndarray:
    """A list of so many finite numbers, (count,) float64; arguments and errors as of `number`."""
    if not isinstance(value, list) or len(value) != count or not all(map(_finite, value)):
        raise ValueError(f"{where} is {value!r}; accepted: {count} finite numbers{what}")
    return np.asarray(value, np.float64)


def _finite(value: Any) -> bool:
    return type(value) in (int, float) and math.isfinite(value)

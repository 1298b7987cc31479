"""Changes of nested options, by dotted names: `disturbance.gust`, `cameras.0.fov`. Imports no JAX."""

import dataclasses
from collections.abc import Mapping
from typing import Any, TypeVar

from e2efly.config.names import unknown
from e2efly.config.reading import read

T = TypeVar("T")


def changed(options: T, changes: Mapping[str, Any], where: str) -> T:
    """Options with some of their values changed.

    Args:
        options: a dataclass. Its fields may be dataclasses, or tuples of dataclasses.
        changes: the new values, by dotted name.
        where: the name of the options in error messages.

    Raises:
        ValueError: naming the field, its value and what is accepted. For an unknown name, the message gives the nearest
            name.
    """
    for name, value in changes.items():
        options = _with(options, name.split("."), value, where)
    return options


def differing(a: Any, b: Any, prefix: str = "") -> dict[str, tuple[Any, Any]]:
    """The differences between two values of the same options: both values, by dotted name."""
    if dataclasses.is_dataclass(a) and type(a) is type(b):
        pairs = [(f.name, getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a)]
    elif isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b) and any(map(dataclasses.is_dataclass, a)):
        pairs = [(str(i), x, y) for i, (x, y) in enumerate(zip(a, b, strict=True))]
    else:
        return {} if a == b else {prefix: (a, b)}
    found: dict[str, tuple[Any, Any]] = {}
    for name, x, y in pairs:
        found |= differing(x, y, f"{prefix}.{name}" if prefix else name)
    return found


def _with(options: Any, path: list[str], value: Any, where: str) -> Any:
    name, *rest = path
    if isinstance(options, tuple):
        parts = {str(i): part for i, part in enumerate(options)}
        if name not in parts or not rest:
            raise ValueError(unknown(f"number of {where}", name, parts))
        return tuple(_with(x, rest, value, f"{where}.{i}") if i == name else x for i, x in parts.items())
    kinds = {f.name: f.type for f in dataclasses.fields(options)} if hasattr(options, "__dataclass_fields__") else {}
    if name not in kinds:
        raise ValueError(unknown(f"option of {where}", name, kinds))
    there = f"{where}.{name}"
    if rest:
        new = _with(getattr(options, name), rest, value, there)
    elif dataclasses.is_dataclass(value) or (isinstance(value, tuple) and any(map(dataclasses.is_dataclass, value))):
        new = value
    else:
        new = read(kinds[name], _as_read(value), there)
    return dataclasses.replace(options, **{name: new})


def _as_read(value: Any) -> Any:
    """A value in the form that JSON gives it."""
    return [_as_read(x) for x in value] if isinstance(value, tuple) else value

"""Configurations from JSON, with errors that name the field, its value and what is accepted."""

import dataclasses
import reprlib
import types
from collections.abc import Mapping
from typing import Any, Literal, Union, get_args, get_origin

_LARGEST = 10**300
"""Whole numbers below this value can also be represented as floating-point numbers."""
_WORDS: dict[Any, str] = {
    int: "a whole number", float: "a number", bool: "true or false", str: "a text", type(None): "null"
}  # fmt: skip


def read(kind: Any, value: Any, where: str, kinds: Mapping[str, Any] | None = None) -> Any:
    """A value of a configuration field, from the JSON form that `dataclasses.asdict` and `json` gave it.

    Args:
        kind: the type: a number, a text, a choice, a tuple, a dictionary or a dataclass of those.
        value: the value, as read from JSON.
        where: the file and the field, for error messages.
        kinds: precise types for dataclass fields whose own annotation is too general.

    Raises:
        ValueError: naming the field, its value and what is accepted. Also for unknown keys, and for missing keys
            without a default, naming them.
    """
    if dataclasses.is_dataclass(kind):
        return _read_fields(kind, value, where, kinds or {})
    arguments, origin = get_args(kind), get_origin(kind)
    if origin in (Union, types.UnionType):
        chosen = next((k for k in arguments if _could_be(k, value)), None)
        if chosen is not None:
            return read(chosen, value, where)
    elif origin is tuple and isinstance(value, list):
        several = arguments[-1] is Ellipsis
        if several or len(arguments) == len(value):
            each = arguments[:1] * len(value) if several else arguments
            return tuple(read(k, x, f"{where}[{i}]") for i, (k, x) in enumerate(zip(each, value, strict=True)))
    elif origin is dict and isinstance(value, dict):
        return {key: read(arguments[1], x, f"{where}.{key}") for key, x in value.items()}
    elif _could_be(kind, value):
        return value
    raise ValueError(f"{where} is {reprlib.repr(value)}; accepted: {_described(kind)}")


def _read_fields(kind: Any, value: Any, where: str, kinds: Mapping[str, Any]) -> Any:
    fields = {field.name: field for field in dataclasses.fields(kind)}
    if not isinstance(value, dict):
        raise ValueError(f"{where} is {reprlib.repr(value)}; accepted: {_described(kind)}")
    # what an older version did not know is as it was then: off, its field's default
    missing = dataclasses.MISSING
    needed = {name for name, f in fields.items() if f.default is f.default_factory is missing}
    if odd := sorted((value.keys() - fields.keys()) | (needed - value.keys())):
        raise ValueError(f"{where}: unknown or missing key: {odd}; accepted: {', '.join(sorted(fields))}")
    return kind(**{k: read(kinds.get(k, fields[k].type), x, f"{where}: {k}") for k, x in value.items()})


def _could_be(kind: Any, value: Any) -> bool:
    """Whether a value can be of a type, as far as JSON distinguishes types at the top level."""
    if get_origin(kind) is Literal:
        return isinstance(value, str) and value in get_args(kind)
    if kind in (int, float) and isinstance(value, int):
        return not isinstance(value, bool) and abs(value) < _LARGEST
    return isinstance(value, {tuple: list, dict: dict}.get(get_origin(kind), kind))  # pyright: ignore


def _described(kind: Any) -> str:
    """A type in words."""
    arguments, origin = get_args(kind), get_origin(kind)
    if dataclasses.is_dataclass(kind):
        return f"an object with {', '.join(sorted(field.name for field in dataclasses.fields(kind)))}"
    if origin in (Union, types.UnionType):
        return " or ".join(map(_described, arguments))
    if origin is Literal:
        return ", ".join(map(repr, arguments))
    if origin is tuple and arguments[-1] is Ellipsis:
        return f"a list, of {_described(arguments[0])} each"
    if origin is tuple:
        return f"a list of {len(arguments)}: {', '.join(map(_described, arguments))}"
    return f"an object, with {_described(arguments[1])} each" if origin is dict else _WORDS[kind]

"""The pose sources by name. A source registers itself; one of the user's own is a reference to its file."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from e2efly.deploy.pose.source import PoseSource
from e2efly.registry import Registry, check_methods

METHODS = ("refused", "problem", "read", "close", "describe")
"""What a pose source must have."""


@dataclass(frozen=True)
class Kind:
    """A kind of pose source."""

    open: Callable[[str], PoseSource]
    """Opens one, given the text behind its name; raises ValueError with what is accepted."""
    form: str
    """How it is written."""


SOURCES: Registry[Kind] = Registry("pose source", source=lambda kind: kind.open)
"""The kinds of pose sources."""

F = TypeVar("F", bound=Callable[[str], PoseSource])


class MalformedError(ValueError):
    """The text behind the name of a source is not as its form says."""


def register(name: str, form: str) -> Callable[[F], F]:
    """Register a function or a class that opens a pose source, given the text behind its name.

    Args:
        name: by which `e2efly fly --pose NAME:...` finds it.
        form: how the whole is written, for people.

    Raises:
        ValueError: for a name that is taken.
    """

    def registered(opener: F) -> F:
        SOURCES.add(name, Kind(opener, form))
        return opener

    return registered


def opened(kind: Kind, text: str, where: str) -> PoseSource:
    """A source of a kind.

    Raises:
        ValueError: naming the text and what is accepted; naming the file of a source that lacks a method.
    """
    try:
        source = kind.open(where)
    except MalformedError:
        raise ValueError(f"pose source is {text!r}; accepted: {kind.form}") from None
    check_methods(source, METHODS)
    return source


def part_of(text: str) -> str:
    """A part of a source's text that must not be empty.

    Raises:
        MalformedError: when it is empty.
    """
    if not text.strip():
        raise MalformedError(text)
    return text


def port_of(text: str) -> int:
    """A port.

    Raises:
        MalformedError: when it is none.
    """
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 65535):
        raise MalformedError(text)
    return int(text)

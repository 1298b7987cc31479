"""The pose sources by name. A source registers itself. A user's own source is given as a reference to its file."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

from e2efly.config.registry import Registry, check_methods, load, load_installed, referenced
from e2efly.flight.pose.pose_source import PoseSource

METHODS = ("refused", "problem", "read", "close", "describe")
"""What a pose source must have."""


@dataclass(frozen=True)
class SourceKind:
    """A kind of source, of poses or of images."""

    open: Callable[..., Any]
    """Opens a source, given the text after its name, and for images the camera of the policy's contract. Raises
    ValueError that says what is accepted."""
    form: str
    """How the text for the source is written."""


SOURCES: Registry[SourceKind] = Registry("pose source", source=lambda kind: kind.open)
"""The kinds of pose sources."""

F = TypeVar("F", bound=Callable[[str], PoseSource])


class MalformedError(ValueError):
    """The text after the name of a source does not have the form that is required."""


def register(name: str, form: str) -> Callable[[F], F]:
    """Register a function or a class that opens a pose source, given the text after its name. `name` stands in `e2efly
    fly --pose NAME:...`. `form` is how the whole text is written, for people.

    Raises:
        ValueError: if the name is taken.
    """
    return SOURCES.adding(name, lambda opener: SourceKind(opener, form))


def selected(sources: Registry[SourceKind], text: str) -> tuple[SourceKind, str] | None:
    """The kind of source that a text names, by a registered name, also of an installed package, or by a reference, and
    the text after that name. None: it names none.

    Raises:
        ValueError: when the file or the module of a reference cannot be loaded, naming it.
    """
    name, _, where = text.partition(":")
    if name not in sources and name.isidentifier():
        load_installed()
    if name in sources:
        return sources[name], where
    if (found := referenced(text)) is None:
        return None
    own = load(found[0])
    known = next((kind for kind in sources.values() if kind.open is own), SourceKind(own, f"{found[0]}[:...]"))
    return known, found[1]


def opened(kind: SourceKind, text: str, where: str) -> PoseSource:
    """Open a source of a kind.

    Raises:
        ValueError: naming the text and what is accepted, or naming the file of a source that lacks a method.
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
        MalformedError: if it is empty.
    """
    if not text.strip():
        raise MalformedError(text)
    return text


def port_of(text: str) -> int:
    """A port number.

    Raises:
        MalformedError: if the text is not a port number.
    """
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 65535):
        raise MalformedError(text)
    return int(text)

"""The image sources by name. A source registers itself; one of the user's own is a reference to its file."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from e2efly.deploy.policy.images import Image
from e2efly.deploy.sight.source import ImageSource
from e2efly.registry import Registry, check_methods

METHODS = ("problem", "read", "close", "describe")
"""What an image source must have."""

Opener = Callable[[str, Image], ImageSource]
"""Opens a source, given the text behind its name and the camera of the policy's contract to which it cuts and resamples
its images; raises ValueError with what is accepted."""


@dataclass(frozen=True)
class Kind:
    """A kind of image source."""

    open: Opener
    """Opens one."""
    form: str
    """How it is written."""


SOURCES: Registry[Kind] = Registry("image source", source=lambda kind: kind.open)
"""The kinds of image sources."""

F = TypeVar("F", bound=Opener)


def register(name: str, form: str) -> Callable[[F], F]:
    """Register a function or a class that opens an image source, given the text behind its name and the camera.

    Args:
        name: by which `e2efly fly --image IMAGE=NAME:...` finds it.
        form: how the whole is written, for people.

    Raises:
        ValueError: for a name that is taken.
    """

    def registered(opener: F) -> F:
        SOURCES.add(name, Kind(opener, form))
        return opener

    return registered


def opened(kind: Kind, where: str, image: Image) -> ImageSource:
    """A source of a kind.

    Raises:
        ValueError: naming the text and what is accepted; naming the file of a source that lacks a method.
    """
    source = kind.open(where, image)
    check_methods(source, METHODS)
    return source

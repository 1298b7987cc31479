"""The image sources by name. A source registers itself. A user's own source is given as a reference to its file."""

from collections.abc import Callable
from typing import TypeVar

from e2efly.config.registry import Registry
from e2efly.flight.pose.registry import SourceKind
from e2efly.flight.sight.image_source import ImageSource
from e2efly.policy.images import Image

METHODS = ("problem", "read", "close", "describe")
"""What an image source must have."""

Opener = Callable[[str, Image], ImageSource]
"""Opens a source, given the text after its name and the camera of the policy's contract, to which the source crops and
resamples its images. Raises ValueError that says what is accepted."""


SOURCES: Registry[SourceKind] = Registry("image source", source=lambda kind: kind.open)
"""The kinds of image sources."""

F = TypeVar("F", bound=Opener)


def register(name: str, form: str) -> Callable[[F], F]:
    """Register a function or a class that opens an image source, given the text after its name and the camera. `name`
    stands in `e2efly fly --image IMAGE=NAME:...`. `form` is how the whole text is written, for people.

    Raises:
        ValueError: if the name is taken.
    """
    return SOURCES.adding(name, lambda opener: SourceKind(opener, form))

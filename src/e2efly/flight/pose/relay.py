"""A source that runs in its own process and passes lines on: `scripts/pose_relay.py`."""

import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from e2efly.flight.child import Child, first_opened, text_of
from e2efly.flight.pose.json_source import parse_pose
from e2efly.flight.pose.pose_source import Inbox

T = TypeVar("T")


class RelaySource(Generic[T]):
    """Messages of a relay. Reading them needs no thread, and needs none of the relay's packages in this process."""

    def __init__(
        self,
        name: str,
        python: str,
        *arguments: str,
        parse: Callable[[bytes, float], Any] = parse_pose,
        what: str = "pose",
    ) -> None:
        """Start the relay and wait until it is ready. `arguments` are the relay's kind, and what it needs to know.
        `parse` takes a message and its time of arrival, s. `what` is the name of the messages in error messages.

        Raises:
            ValueError: with what the relay reports about its failure, or because it does not answer in time.
        """
        self._inbox: Inbox[T] = Inbox(_timed(parse))
        self._name = name
        try:
            self._child = Child(python, "pose_relay.py", *arguments)
        except ValueError as error:
            raise ValueError(f"{what} source {name}: {error}") from None

    @property
    def refused(self) -> int:
        """Messages that were malformed, of another type or too many."""
        return self._inbox.refused

    @property
    def problem(self) -> str | None:
        """Why the relay has ended, or otherwise the last problem with a message."""
        ended = self._child.ended
        return f"{self._name}: {ended}" if ended else self._inbox.problem

    def read(self, now: float) -> list[T]:
        """The messages since the last call. `received` is the time at which the relay received them."""
        for line in self._child.lines():
            kind, _, rest = line.partition(b" ")
            if kind == b"message":
                self._inbox.put(rest, now)
            else:
                self._inbox.refuse(f"{self._name}: {text_of(rest)}")
        return self._inbox.take()

    def close(self) -> None:
        """End the relay. This takes up to 2 s."""
        self._child.close()

    def describe(self) -> str:
        """What it listens to, and which package of which interpreter it uses."""
        return f"{self._name} ({self._child.detail})"


def _timed(parse: Callable[[bytes, float], Any]) -> Callable[[bytes, float], Any]:
    """A parser for `RECEIVED JSON`. The monotonic clock is the same in all processes of a machine."""

    def parsed(message: bytes, now: float) -> Any:
        received, _, content = message.partition(b" ")
        waited = time.monotonic() - float(received)
        return parse(content, now - max(waited, 0.0))

    return parsed


def open_relay(
    name: str,
    pythons: list[str],
    advice: str,
    *arguments: str,
    parse: Callable[[bytes, float], Any] = parse_pose,
    what: str = "pose",
) -> RelaySource[Any]:
    """Start a relay with the first interpreter that has the required package.

    Raises:
        ValueError: with what each interpreter reports, and the advice.
    """

    def opened(python: str) -> RelaySource[Any]:
        return RelaySource(name, python, *arguments, parse=parse, what=what)

    return first_opened(pythons, advice, opened, always=True)

"""A pose source that runs in a process of its own and passes lines on: `process/pose_relay.py`."""

import time

from e2efly.deploy.child import Child, first_opened, text_of
from e2efly.deploy.odometry import Sample
from e2efly.deploy.pose.json_source import parse_pose
from e2efly.deploy.pose.source import Inbox


class RelaySource:
    """Poses of a relay."""

    def __init__(self, name: str, python: str, *arguments: str) -> None:
        """Start the relay and wait until it is ready.

        Args:
            name: what to call the source.
            python: the interpreter that has the package of the peer.
            arguments: of the relay: its kind, and what it needs to know.

        Raises:
            ValueError: what the relay says of its failure, or that it does not answer in time.
        """
        self._inbox, self._name = Inbox(_parse), name
        try:
            self._child = Child(python, "pose_relay.py", *arguments)
        except ValueError as error:
            raise ValueError(f"pose source {name}: {error}") from None

    @property
    def refused(self) -> int:
        """Messages that were malformed, of another type or too many."""
        return self._inbox.refused

    @property
    def problem(self) -> str | None:
        """Why the relay has ended, or else what was wrong with a message last."""
        ended = self._child.ended
        return f"{self._name}: {ended}" if ended else self._inbox.problem

    def read(self, now: float) -> list[Sample]:
        """Poses since the last call; `received` is when the relay took them."""
        for line in self._child.lines():
            kind, _, rest = line.partition(b" ")
            if kind == b"pose":
                self._inbox.put(rest, now)
            else:
                self._inbox.refuse(f"{self._name}: {text_of(rest)}")
        return self._inbox.take()

    def close(self) -> None:
        """End the relay; takes up to 2 s."""
        self._child.close()

    def describe(self) -> str:
        """What it listens to, and by which package of which interpreter."""
        return f"{self._name} ({self._child.detail})"


def _parse(message: bytes, now: float) -> Sample:
    """`RECEIVED JSON`; the monotonic clock is the same one in all processes of a machine."""
    received, _, content = message.partition(b" ")
    waited = time.monotonic() - float(received)
    return parse_pose(content, now - max(waited, 0.0))


def open_relay(name: str, pythons: list[str], advice: str, *arguments: str) -> RelaySource:
    """Start a relay by the first interpreter that has its package.

    Raises:
        ValueError: with what each interpreter says, and the advice.
    """
    return first_opened(pythons, advice, lambda python: RelaySource(name, python, *arguments), always=True)

"""Where poses come from: one small interface."""

from collections import deque
from collections.abc import Callable, Iterable
from typing import Generic, Protocol, TypeVar

from e2efly.deploy.odometry import Sample

T = TypeVar("T")
LARGEST_BATCH = 16
"""Most messages that one `read` parses: of a flood the newest, so that the control loop stays in time."""


class PoseSource(Protocol):
    """Delivers samples as they come. Nothing here blocks or raises once it is open."""

    @property
    def refused(self) -> int:
        """Messages that were malformed or too many."""
        ...

    @property
    def problem(self) -> str | None:
        """What was wrong last; None: nothing so far."""
        ...

    def read(self, now: float) -> list[Sample]:
        """What arrived since the last call, oldest first.

        Args:
            now: this machine's monotonic clock, s; what `Sample.received` is counted on.
        """
        ...

    def close(self) -> None:
        """Let go of everything; may be called twice."""
        ...

    def describe(self) -> str:
        """What this is, for people and logs."""
        ...


class PlantSource:
    """A plant in the same process, as a pose source."""

    def __init__(self, state: Callable[[float], Iterable[Sample]], name: str = "plant") -> None:
        """Wrap a plant.

        Args:
            state: takes the local time, s, and gives the samples since its last call, oldest first.
            name: what to call it.
        """
        self.refused = 0
        self.problem: str | None = None
        self._state, self._name = state, name

    def read(self, now: float) -> list[Sample]:
        """What the plant has produced since the last call; an exception of it is counted and kept as the problem."""
        try:
            return list(self._state(now))
        except Exception as error:  # a plant that fails is a source that falls silent, never a crash of the loop
            self.refused, self.problem = self.refused + 1, f"{self._name}: {type(error).__name__}: {error}"
            return []

    def close(self) -> None:
        """Nothing to let go of."""

    def describe(self) -> str:
        """Its name."""
        return self._name


class Inbox(Generic[T]):
    """Messages as they came, parsed when read: the part that all sources of bytes share."""

    def __init__(self, parse: Callable[..., T]) -> None:
        """Start empty.

        Args:
            parse: takes a message, its time of arrival, s, and, where `put` was told it, who sent it; raises ValueError
                for a malformed message.
        """
        self.refused = 0
        self.problem: str | None = None
        self._parse = parse
        self._messages: deque[tuple[bytes, float, tuple[str, ...]]] = deque(maxlen=LARGEST_BATCH)
        self._come = 0

    def put(self, message: bytes, received: float, *sender: str) -> None:
        """Keep a message; of too many the oldest go."""
        self._come += 1
        self._messages.append((message, received, sender))

    def extend(self, messages: list[bytes], received: float, dropped: int) -> None:
        """Keep messages that were read together, before which others were dropped; of too many the oldest go."""
        self._come += len(messages) + dropped
        self._messages.extend((message, received, ()) for message in messages)

    def refuse(self, problem: str, count: int = 1) -> None:
        """Count messages that are no samples."""
        self.refused, self.problem = self.refused + count, problem

    def take(self) -> list[T]:
        """What all messages say, oldest first."""
        if dropped := self._come - len(self._messages):
            self.refuse(f"more than {LARGEST_BATCH} messages at once; the oldest were dropped", dropped)
        self._come, samples = 0, []
        while self._messages:
            message, received, sender = self._messages.popleft()
            try:
                samples.append(self._parse(message, received, *sender))
            except ValueError as error:
                self.refuse(str(error))
        return samples

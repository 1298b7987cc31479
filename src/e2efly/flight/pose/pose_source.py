"""Where poses come from: one small interface."""

from collections import deque
from collections.abc import Callable, Iterable
from typing import Generic, Protocol, TypeVar, runtime_checkable

import numpy as np

from e2efly.policy.odometry import Sample

T = TypeVar("T")
LARGEST_BATCH = 16
"""The largest number of messages that one `read` parses. If more arrive, the newest are parsed, so that the control
loop stays on time."""


class PoseSource(Protocol):
    """Delivers samples as they arrive. Nothing here blocks or raises once the source is open.

    A source of another vehicle's poses that does not see it everywhere has an attribute `range_m`: up to how far, m.
    """

    @property
    def refused(self) -> int:
        """Messages that were malformed or too many."""
        ...

    @property
    def problem(self) -> str | None:
        """The last problem. None: no problem so far."""
        ...

    def read(self, now: float) -> list[Sample]:
        """The samples that arrived since the last call, oldest first. `now` is on this machine's monotonic clock, s,
        the clock of `Sample.received`.
        """
        ...

    def close(self) -> None:
        """Release all resources. May be called twice."""
        ...

    def describe(self) -> str:
        """A description of the source, for people and logs."""
        ...


@runtime_checkable
class AidedSource(PoseSource, Protocol):
    """A source that carries its poses on by the IMU of the flight controller.

    One whose place drifts away, because nothing corrects it in flight, has an attribute `drifts` that is true.
    """

    def feel(
        self, time: float, gyroscope: np.ndarray, force: np.ndarray, *, standing: bool,
        attitude: tuple[float, np.ndarray] | None = None,
    ) -> None:  # fmt: skip
        """A sample of the IMU.

        Args:
            time: when it was taken, s.
            gyroscope: (3,) body rate, rad/s.
            force: (3,) specific force, body, m/s^2.
            standing: the vehicle is on the ground with its motors stopped. It may be carried.
            attitude: the flight controller's own, and when it was true: s, and (4,) unit quaternion wxyz. Its heading
                has an origin of its own. None: not known.
        """
        ...


def drifts(source: object) -> bool:
    """Whether the place that a source tells drifts away in flight; see `AidedSource`."""
    return bool(getattr(source, "drifts", False))


class PlantSource:
    """A plant in the same process, as a pose source."""

    def __init__(self, state: Callable[[float], Iterable[Sample]], name: str = "plant") -> None:
        """Wrap a plant. `state` takes the local time, s, and returns the samples since its last call, oldest first."""
        self.refused = 0
        self.problem: str | None = None
        self._state, self._name = state, name

    def read(self, now: float) -> list[Sample]:
        """The samples that the plant has produced since the last call. If it raises an exception, this is counted and
        kept as the problem.
        """
        try:
            return list(self._state(now))
        except Exception as error:  # a plant that fails is a silent source; it must not crash the loop
            self.refused, self.problem = self.refused + 1, f"{self._name}: {type(error).__name__}: {error}"
            return []

    def close(self) -> None:
        """Does nothing: there are no resources to release."""

    def describe(self) -> str:
        """Its name."""
        return self._name


class Inbox(Generic[T]):
    """Messages as they arrived, parsed when they are read. All sources of bytes share this class."""

    def __init__(self, parse: Callable[..., T]) -> None:
        """Start empty. `parse` takes a message, its time of arrival, s, and the sender, if `put` was given one. It
        raises ValueError for a malformed message.
        """
        self.refused = 0
        self.problem: str | None = None
        self._parse = parse
        self._messages: deque[tuple[bytes, float, tuple[str, ...]]] = deque(maxlen=LARGEST_BATCH)
        self._come = 0

    def put(self, message: bytes, received: float, *sender: str) -> None:
        """Keep a message. If there are too many, the oldest are dropped."""
        self._come += 1
        self._messages.append((message, received, sender))

    def extend(self, messages: list[bytes], received: float, dropped: int) -> None:
        """Keep messages that were read together. `dropped` is the number of messages dropped before them. If there are
        too many, the oldest are dropped.
        """
        self._come += len(messages) + dropped
        self._messages.extend((message, received, ()) for message in messages)

    def refuse(self, problem: str, count: int = 1) -> None:
        """Count messages that are not samples."""
        self.refused, self.problem = self.refused + count, problem

    def take(self) -> list[T]:
        """The parsed content of all messages, oldest first."""
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

"""Parts that misbehave on demand: a link, poses, images, a policy's network. Between bridge and real firmware."""

import dataclasses
import errno
import os
import time
from collections import deque
from collections.abc import Callable
from operator import attrgetter
from typing import Any

import numpy as np

from e2efly.flight.betaflight.codec import REPLY, Decoder, MspFrame, encode
from e2efly.flight.betaflight.messages import SET_RAW_RC
from e2efly.flight.link import StreamLink
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.sight import image_source as sight
from e2efly.policy.odometry import Sample

GARBAGE = 40
"""Longest burst of random bytes, bytes."""
THROTTLE = slice(9, 11)
"""Where the throttle stands in a message of stick channels, in the order AETR."""


class Plug:
    """Opens a link's port, as long as nobody pulls it."""

    def __init__(self, opener: Callable[[], Any]) -> None:
        self.pulled = False
        """The device has gone: what is open fails, and there is nothing to open."""
        self._opener = opener

    def __call__(self) -> "_Port":
        self.check(errno.ENOENT)
        return _Port(self, self._opener())

    def check(self, number: int) -> None:
        """Fail while it is pulled."""
        if self.pulled:
            raise OSError(number, os.strerror(number))


class _Port:
    """A port that can be asked for nothing but its end once the plug is pulled."""

    def __init__(self, plug: Plug, inner: Any) -> None:
        self._plug, self._inner = plug, inner
        self.close = inner.close

    def __getattr__(self, name: str) -> Any:
        self._plug.check(errno.EIO)
        return getattr(self._inner, name)


def inner(name: str, of: str = "_inner") -> Any:
    """An attribute that is the inner part's."""
    return property(attrgetter(f"{of}.{name}"))


class FaultyLink:
    """A `Link` around another; each attribute below is a fault, and all may be changed at any time."""

    def __init__(self, inner: StreamLink, random: np.random.Generator) -> None:
        self.silent = False
        """The wires are cut: bytes vanish both ways and nothing tells so."""
        self.garbage = 0.0
        """Share of frames, both ways, that come behind a burst of random bytes."""
        self.spoilt = 0.0
        """Share of the controller's frames that arrive as nothing but random bytes."""
        self.halved = 0.0
        """Share of the controller's frames of which only the first half arrives."""
        self.delay = 0.0
        """By how much frames come late, each way, s."""
        self.other: Callable[[bytes], bytes] = lambda data: b""
        """What another program sends after each frame."""
        self.rewrites: dict[int, Callable[[bytes], bytes]] = {}
        """By code: what the payloads of its replies are turned into."""
        self.throttle = 0
        """The newest throttle that was sent, us."""
        self._inner, self._random = inner, random
        self._plug = inner.opener = Plug(inner.opener)
        self._decoder = Decoder()
        self._out: deque[tuple[float, bytes]] = deque()
        self._back: deque[tuple[float, bytes]] = deque()
        self._now = 0.0

    @property
    def gone(self) -> bool:
        """The port has disappeared, as a plug that is pulled."""
        return self._plug.pulled

    @gone.setter
    def gone(self, gone: bool) -> None:
        self._plug.pulled = gone

    def heal(self) -> None:
        self.gone = self.silent = False
        self.garbage = self.spoilt = self.halved = self.delay = 0.0
        self.rewrites.clear()
        self.other = lambda data: b""

    alive, reason, connections, close = map(inner, ("alive", "reason", "connections", "close"))

    def poll(self, now: float) -> None:
        """Poll the inner link, and let go of what was held back."""
        self._now = now
        self._inner.poll(now)
        while self._out and self._out[0][0] <= now:
            self._inner.send(self._out.popleft()[1])

    def send(self, data: bytes) -> None:
        if sticks(data):
            self.throttle = int.from_bytes(data[THROTTLE], "little")
        if not self.silent:
            self._out.append((self._now + self.delay, self._burst(self.garbage) + data + self.other(data)))
            self.poll(self._now)

    def receive(self) -> bytes:
        """The controller's frames, after their treatment."""
        frames = self._decoder.feed(self._inner.receive())
        if not self.silent:
            self._back += [(self._now + self.delay, self._treated(frame)) for frame in frames]
        arrived = bytearray()
        while self._back and self._back[0][0] <= self._now:
            arrived += self._back.popleft()[1]
        return bytes(arrived)

    def _treated(self, frame: MspFrame) -> bytes:
        rewrite = self.rewrites.get(frame.code)
        if rewrite is not None and frame.direction == REPLY:
            frame = MspFrame(frame.code, rewrite(frame.payload), frame.direction, frame.version, frame.flags)
        data = encode(frame)
        if self._random.random() < self.spoilt:
            return self._random.bytes(len(data))
        if self._random.random() < self.halved:
            return data[: len(data) // 2]
        return self._burst(self.garbage) + data

    def _burst(self, share: float) -> bytes:
        return self._random.bytes(int(self._random.integers(1, GARBAGE))) if self._random.random() < share else b""


def sticks(data: bytes) -> bool:
    """Whether a message, or the first of some, is of stick channels."""
    return data[:3] == b"$M<" and data[4] == SET_RAW_RC


class FaultyPoses:
    """A `PoseSource` around another: `alter` turns each sample into another, or into none."""

    def __init__(self, inner: PoseSource) -> None:
        self.alter: Callable[[Sample], Sample | None] | None = None
        self.newest: Sample | None = None
        """The last one that was let through as it was."""
        self.delay = 0.0
        """By how much samples come late, s; their stamps stay."""
        self._inner = inner
        self._held: deque[tuple[float, Sample]] = deque()

    refused, problem, close, describe = map(inner, ("refused", "problem", "close", "describe"))

    def read(self, now: float) -> list[Sample]:
        """What the inner source has, late and altered."""
        self._held += [(now + self.delay, sample) for sample in self._inner.read(now)]
        samples = []
        while self._held and self._held[0][0] <= now:
            due, sample = self._held.popleft()
            samples.append(dataclasses.replace(sample, received=max(sample.received, due)))
        if self.alter is None:
            self.newest = samples[-1] if samples else self.newest
            return samples
        return [altered for sample in samples if self.alter and (altered := self.alter(sample)) is not None]


class FaultyImages:
    """An `ImageSource` around another: `alter` turns each image into another, or into none."""

    def __init__(self, inner: sight.ImageSource) -> None:
        self.alter: Callable[[sight.Frame], sight.Frame | None] = lambda frame: frame
        self.delay = 0.0
        """By how much images come late, s."""
        self.stamped = True
        """Whether the source says when a late image was taken; otherwise its delay is unknown to it."""
        self._inner = inner
        self._held: deque[tuple[float, sight.Frame]] = deque()

    problem, close, describe = map(inner, ("problem", "close", "describe"))

    def read(self, now: float) -> list[sight.Frame]:
        """What the inner source has, late and altered."""
        shift = 0.0 if self.stamped else self.delay
        self._held += [
            (now + self.delay, dataclasses.replace(frame, time=frame.time + shift)) for frame in self._inner.read(now)
        ]
        frames = []
        while self._held and self._held[0][0] <= now:
            frames.append(self._held.popleft()[1])
        return [altered for frame in frames if (altered := self.alter(frame)) is not None]


class FaultyNetwork:
    """An ONNX Runtime session around another."""

    def __init__(self, inner: Any) -> None:
        self.fault = ""
        """nan, raise or late; empty: none."""
        self.late = 0.0
        """How long it takes when it is late, s of real time."""
        self._inner = inner

    def run(self, outputs: list[str], inputs: dict[str, np.ndarray]) -> list[Any]:
        """What the inner session says, or what the fault makes of it."""
        if self.fault == "raise":
            raise RuntimeError("the network broke")
        answer = self._inner.run(outputs, inputs)
        if self.fault == "late":
            time.sleep(self.late)
        return [np.full_like(a, np.nan) for a in answer] if self.fault == "nan" else answer

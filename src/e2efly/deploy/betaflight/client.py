"""Requests and replies over a link, without ever blocking the control loop.

`poll` reads what has come and sends what is due. Telemetry is asked for on a schedule, but only so much at a time that
the controller and a slow line keep up: sticks always go first.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from e2efly.deploy.betaflight import messages, settings
from e2efly.deploy.betaflight.codec import ERROR, REQUEST, Decoder, Frame, encode
from e2efly.deploy.betaflight.link import MOST, Link
from e2efly.deploy.clock import MONOTONIC, Clock

MESSAGES: dict[int, Any] = {
    kind.CODE: kind
    for kind in (
        messages.ApiVersion, messages.FcVariant, messages.FcVersion, messages.BuildInfo, messages.Name,
        messages.StatusEx, messages.RawImu, messages.Motor, messages.MotorTelemetry, messages.Rc,
        messages.AttitudeReply, messages.Analog, messages.BatteryState, messages.Debug, settings.ModeRanges,
        settings.FeatureConfig, settings.BoardAlignment,
        settings.MixerConfig, settings.RxConfig, settings.RxMap, settings.FailsafeConfig, settings.RxFailConfig,
        settings.AdvancedConfig, settings.PidAdvanced, settings.RcTuning, settings.BoxIds, settings.RcDeadband,
        settings.MotorConfig,
    )
}  # fmt: skip
"""The messages that are understood, by code."""
SCHEDULE = {
    messages.StatusEx.CODE: 30.0, messages.Rc.CODE: 50.0, messages.AttitudeReply.CODE: 50.0, messages.RawImu.CODE: 50.0,
    messages.Motor.CODE: 10.0, messages.BatteryState.CODE: 2.0,
}  # fmt: skip
"""How often each message is asked for in flight, Hz. Together with the stick frames they must be well below what the
controller answers, one message at each turn of its serial task: where that is 350 a second, frames soon queue up."""
TIMEOUT = 0.3
"""How long a reply may take, s, before the request counts as lost and may be sent again ..."""
SHORTEST_TIMEOUT, PATIENCE = 0.08, 4.0
"""... but, once replies have come, no longer than so many times what the slowest of them took, nor shorter than this:
on a line that loses frames the controller must not seem lost for the sake of one."""
FORGOTTEN = 1.0
"""After so long, s, no answer is expected any more: earlier, a late one would be taken for that to a later request."""
MAX_IN_FLIGHT = 256
"""Bytes of scheduled replies that may be awaited at a time."""
MAX_BACKLOG = 6
"""With more stick frames without answer, for longer than the link takes, the controller is behind, or answers were
lost: it is asked for one message at a time, whose answer tells which."""
_UNKNOWN_REPLY = 64
"""Bytes that a reply of unknown length is taken to have."""
_OVERHEAD = 6
_STARTS = (b"$M>", b"$X>")
"""Beginnings of replies. Inside a payload they tell of half a frame run together with the next one, whose checksum, of
8 bits, happens to fit: it does once in 256."""


class Reply(NamedTuple):
    """The last reply of the controller to a code."""

    message: Any
    """The parsed message, an instance of `MESSAGES[code]`. For other codes, the payload itself."""
    time: float
    """When it came, s on the monotonic clock."""
    latency: float
    """How long after its request, s. Of two requests, the first of which was given up, the first: where its answer was
    lost, the next answer to a stick frame has told so already."""


@dataclass
class Client:
    """The controller at the other end of a link."""

    link: Link
    """The link; the client polls it."""
    schedule: dict[int, float] = field(default_factory=dict)
    """How often to ask for each code, Hz; see `SCHEDULE`."""
    latest: dict[int, Reply] = field(default_factory=dict)
    """The latest reply to each code, on this connection."""
    errors: dict[int, str] = field(default_factory=dict)
    """What was wrong with the last answer to each code, where something was."""
    requests: int = 0
    """Requests sent, so far; stick frames not counted."""
    replies: int = 0
    """Replies taken in, so far; those to stick frames not counted."""
    timeouts: int = 0
    """Requests that got no answer in time, so far."""
    backlog: int = 0
    """Stick frames whose answers are awaited: the controller has not got to them yet, or the answers are lost."""
    latency: float = 0.0
    """How long the newest answer took, s; those to stick frames not counted. The controller answers in order, so that
    stick frames reach it as late."""
    quickest: float = math.inf
    """How long the newest reply took, s, not counting replies to stick frames. The controller answers in order, so
    stick frames reach it with the same delay."""
    heard: float = -math.inf
    """When the newest reply came, s on the monotonic clock; those to stick frames not counted."""
    run_together: int = 0
    """Replies thrown away because another begins inside, so far."""
    decoder: Decoder = field(default_factory=Decoder)
    """Counts bad checksums and skipped bytes."""
    _asked: dict[int, float] = field(default_factory=dict)
    _awaited: deque[tuple[int, float]] = field(default_factory=deque)
    _due: dict[int, float] = field(default_factory=dict)
    _sizes: dict[int, int] = field(default_factory=dict)
    _connection: int = 0

    def poll(self, now: float) -> None:
        """Read what has come and ask for what is due. `now` is in s on the monotonic clock. Never raises."""
        self.link.poll(now)
        if self.link.connections != self._connection:
            self._forget()
        for frame in self.decoder.feed(self.link.receive()[-MOST:]):
            self._take(frame, now)
        self._expire(now)
        if self.link.alive:
            self._ask_due(now)

    def request(self, code: int, now: float, payload: bytes = b"") -> bool:
        """Ask for a code, unless an answer to it is still awaited or the link is not alive; whether it was sent."""
        if code in self._asked or not self.link.alive:
            return False
        self._asked[code] = now
        self.requests += 1
        self._awaited.append((code, now))
        self.link.send(encode(Frame(code, payload, version=1 if code < 255 else 2)))
        return True

    def set_raw_rc(self, frame: Frame, now: float) -> bool:
        """Send a stick frame of `messages.set_raw_rc` and await nothing; whether the link is alive."""
        if not self.link.alive:
            return False
        self.backlog += 1
        self._awaited.append((messages.SET_RAW_RC, now))
        self.link.send(encode(frame))
        return self.link.alive

    def message(self, code: int, now: float, max_age: float) -> Any:
        """The latest message of a code, or None where there is none or it is older than `max_age`, s."""
        reply = self.latest.get(code)
        return reply.message if reply is not None and now - reply.time <= max_age else None

    def _take(self, frame: Frame, now: float) -> None:
        if frame.direction == REQUEST:
            return  # an echo, as of a line whose two wires touch
        if any(start in frame.payload for start in _STARTS):
            self.run_together += 1
            return
        asked = self._strike_off(frame.code, now)
        if frame.code == messages.SET_RAW_RC:
            return
        self.replies += 1
        self.latency = now - asked
        self.quickest = min(self.quickest, self.latency)
        self._sizes[frame.code] = len(frame.payload) + _OVERHEAD
        if frame.direction == ERROR:
            self.errors[frame.code] = "the controller does not know or refuses it"
            return
        kind = MESSAGES.get(frame.code)
        try:
            message = frame.payload if kind is None else kind.parse(frame.payload)
        except ValueError as error:
            self.errors[frame.code] = str(error)
            return
        self.errors.pop(frame.code, None)
        self.heard, self.latest[frame.code] = now, Reply(message, now, now - asked)

    def _strike_off(self, code: int, now: float) -> float:
        """A code is answered. The controller answers in order: the answers to what was sent before it are lost.

        Returns:
            When it was asked for, s; `now` where it was not.
        """
        if all(awaited != code for awaited, _ in self._awaited):
            return now
        while True:
            earlier, asked = self._awaited.popleft()
            self.backlog -= earlier == messages.SET_RAW_RC
            given_up = earlier != messages.SET_RAW_RC and self._asked.get(earlier) != asked
            if not given_up:
                self._asked.pop(earlier, None)
            if earlier == code:
                return asked
            self.timeouts += not given_up

    @property
    def _timeout(self) -> float:
        slowest = max((reply.latency for reply in self.latest.values()), default=TIMEOUT)
        return min(max(PATIENCE * slowest, SHORTEST_TIMEOUT), TIMEOUT)

    def _expire(self, now: float) -> None:
        timeout = self._timeout
        late = [code for code, asked in self._asked.items() if now - asked > timeout]
        for code in late:
            del self._asked[code]
        self.timeouts += len(late)
        while self._awaited and now - self._awaited[0][1] > FORGOTTEN:
            code, _ = self._awaited.popleft()
            if code == messages.SET_RAW_RC:
                self.backlog, self.timeouts = self.backlog - 1, self.timeouts + 1
                late.append(code)
        if late and self.decoder.pending:  # what is held back may be no frame at all
            for frame in self.decoder.flush():
                self._take(frame, now)

    def _ask_due(self, now: float) -> None:
        behind = self._unanswered(now) > MAX_BACKLOG
        in_flight = sum(self._sizes.get(code, _UNKNOWN_REPLY) for code in self._asked)
        free = (code for code in self.schedule if code not in self._asked)
        overdue = {code: (now - self._due.setdefault(code, now)) * self.schedule[code] for code in free}
        for code in sorted((code for code in overdue if overdue[code] >= 0), key=overdue.__getitem__, reverse=True):
            size = self._sizes.get(code, _UNKNOWN_REPLY)
            if in_flight and (behind or in_flight + size > MAX_IN_FLIGHT):
                return
            self.request(code, now)
            in_flight += size
            period = 1 / self.schedule[code]
            self._due[code] = max(self._due[code] + period, now + 0.5 * period)

    def _unanswered(self, now: float) -> int:
        """Stick frames that wait for longer than the link takes: on a slow radio some are always under way."""
        longest = 0.0 if math.isinf(self.quickest) else self.quickest
        return sum(code == messages.SET_RAW_RC and now - asked >= longest for code, asked in self._awaited)

    def _forget(self) -> None:
        """A new connection: nothing of the old one is awaited or believed."""
        self._connection = self.link.connections
        self._asked.clear()
        self._awaited.clear()
        self._due.clear()
        self.latest.clear()
        self.errors.clear()
        self.backlog, self.latency, self.quickest = 0, 0.0, math.inf
        self.decoder = Decoder(bad_checksums=self.decoder.bad_checksums, skipped=self.decoder.skipped)


def ask(client: Client, code: int, timeout_s: float = 1.0, payload: bytes = b"", clock: Clock = MONOTONIC) -> Any:
    """Ask and wait: for set-up, not for flight. Asks again when an answer is lost.

    Returns:
        The message, an instance of `MESSAGES[code]`, or the payload for other codes.

    Raises:
        TimeoutError: when no answer comes, with the reason of the link.
        ValueError: when the controller refuses the code or its answer cannot be read.
    """
    start = now = clock.now()
    client.poll(now)
    client.errors.pop(code, None)
    client.latest.pop(code, None)
    while now - start <= timeout_s:
        client.request(code, now, payload)
        client.poll(now)
        if code in client.latest:
            return client.latest[code].message
        if code in client.errors:
            raise ValueError(f"MSP {_name(code)}: {client.errors[code]}")
        clock.sleep(0.001)
        now = clock.now()
    reason = client.link.reason or "the link is open, but nothing that is MSP answers"
    raise TimeoutError(f"MSP {_name(code)}: no answer within {timeout_s:g} s ({reason})")


def tell(client: Client, frame: Frame, timeout_s: float = 1.0) -> None:
    """Send a frame that sets something, and wait until the controller has taken it; see `ask`."""
    ask(client, frame.code, timeout_s, frame.payload)


def _name(code: int) -> str:
    return f"{MESSAGES[code].__name__} ({code})" if code in MESSAGES else str(code)

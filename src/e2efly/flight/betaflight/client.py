"""Requests and replies over a link. The control loop is never blocked.

`poll` reads what has come and sends what is due. Telemetry is requested on a schedule, but never so much at a time that
the controller or a slow line falls behind. Stick frames always have priority.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from e2efly.flight.autopilot import HOLE, arrived
from e2efly.flight.betaflight import messages, mode_slots, settings_messages
from e2efly.flight.betaflight.codec import ERROR, REQUEST, Decoder, MspFrame, encode
from e2efly.flight.clock import MONOTONIC, Clock
from e2efly.flight.link import MOST, Link

MESSAGES: dict[int, Any] = {
    kind.CODE: kind
    for kind in (
        messages.ApiVersion, messages.FcVariant, messages.FcVersion, messages.BuildInfo, messages.Name,
        messages.StatusEx, messages.RawImu, messages.Motor, messages.MotorTelemetry, messages.Rc,
        messages.AttitudeReply, messages.BatteryState, mode_slots.ModeRanges,
        mode_slots.ModeLogic, settings_messages.FeatureConfig, settings_messages.BoardAlignment,
        settings_messages.MixerConfig, settings_messages.RxConfig, settings_messages.RxMap,
        settings_messages.FailsafeConfig, settings_messages.RxFailConfig,
        settings_messages.PidAdvanced, settings_messages.RcTuning, mode_slots.BoxIds, settings_messages.RcDeadband,
        settings_messages.MotorConfig, settings_messages.PidGains, settings_messages.AdvancedConfig,
    )
}  # fmt: skip
"""The messages that can be parsed, by code."""
SCHEDULE = {
    messages.StatusEx.CODE: 30.0, messages.Rc.CODE: 50.0, messages.AttitudeReply.CODE: 50.0, messages.RawImu.CODE: 50.0,
    messages.Motor.CODE: 10.0, messages.BatteryState.CODE: 2.0,
}  # fmt: skip
"""How often each message is requested in flight, Hz. Together with the stick frames, the number of messages must be
well below what the controller answers, which is one message per run of its serial task. If it runs 350 times per
second, frames soon queue up."""
TIMEOUT = 0.3
"""How long a reply may take, s, before the request counts as lost and may be sent again ..."""
SHORTEST_TIMEOUT, PATIENCE = 0.08, 4.0
"""... Once replies have come, the limit is `PATIENCE` times the time that the slowest of them took, but at least
`SHORTEST_TIMEOUT`, s, and at most `TIMEOUT`. On a line that loses frames, one lost frame must not make the controller
seem lost."""
FORGOTTEN = 1.0
"""After this time, s, a reply is not expected any more. If this were shorter, a late reply would be taken for the reply
to a later request."""
MAX_IN_FLIGHT = 256
"""The largest number of bytes of scheduled replies that may be awaited at a time."""
MAX_BACKLOG, PROBE_S = 6, 0.05
"""If more stick frames than this have waited for their replies for longer than the link takes, the controller is
behind, or replies were lost. Unless `lossy` shows the latter, messages are requested at least `PROBE_S` apart, s."""
LOSSY_S, LOSSY_TIMEOUT = 0.3, 0.03
"""A line that has carried bytes that are no frame within the first value, s, loses replies. The limit is then
`PATIENCE` times the quickest reply's time, but at least the second value, s."""
TOLD_S = 0.03
"""An acknowledgement that takes longer than twice the newest reply's time plus this, s, may be for a later frame."""
CROWDED_S, CROWDED = 1.0, 3.0
"""If replies that nobody here asked for have come within the first value, s, another program asks on this link. The
controller must have time for the sticks, so messages are then requested less often, by the second value."""
_UNKNOWN_REPLY = 64
"""The assumed size of a reply whose size is not known yet, bytes."""
_OVERHEAD = 6
_STARTS = (b"$M>", b"$X>")
"""Beginnings of replies. If one is found inside a payload, half a frame was joined with the next frame, and the
checksum fitted by chance. With its 8 bits, this happens once in 256 cases."""


class Reply(NamedTuple):
    """The last reply of the controller to a code."""

    message: Any
    """The parsed message, an instance of `MESSAGES[code]`. For other codes, the payload itself."""
    time: float
    """When it came, s on the monotonic clock."""
    latency: float
    """The time from the request to the reply, s. If the first of two requests was given up, the time counts from the
    first one. If its reply had really been lost, the next reply to a stick frame would already have shown it."""


@dataclass
class Client:
    """The controller at the other end of a link."""

    link: Link
    """The link. The client polls it."""
    schedule: dict[int, float] = field(default_factory=dict)
    """How often to request each code, Hz; see `SCHEDULE`."""
    latest: dict[int, Reply] = field(default_factory=dict)
    """The latest reply to each code, on this connection."""
    errors: dict[int, str] = field(default_factory=dict)
    """What was wrong with the last reply to each code, if something was."""
    requests: int = 0
    """Number of requests sent so far, without stick frames."""
    replies: int = 0
    """Number of replies received so far, without those to stick frames."""
    timeouts: int = 0
    """Number of requests so far that got no reply in time."""
    backlog: int = 0
    """Number of stick frames whose replies are awaited. Either the controller has not processed them yet, or the
    replies are lost."""
    latency: float = 0.0
    """How long the newest reply took, s, not counting replies to stick frames. The controller answers in order, so
    stick frames reach it with the same delay."""
    quickest: float = math.inf
    """How long the quickest reply on this connection took, s, not counting replies to stick frames."""
    heard: float = -math.inf
    """When the newest reply came, s on the monotonic clock, not counting replies to stick frames."""
    acknowledged: deque[float] = field(default_factory=lambda: deque(maxlen=512))
    """When the stick frames were sent whose arrival the controller has acknowledged, s, oldest first."""
    run_together: int = 0
    """Number of replies so far that were dropped because another reply begins inside them."""
    decoder: Decoder = field(default_factory=Decoder)
    """The decoder of the frames. It counts bad checksums and skipped bytes."""
    _asked: dict[int, float] = field(default_factory=dict)
    _awaited: deque[tuple[int, float]] = field(default_factory=deque)
    _lost: deque[tuple[int, float]] = field(default_factory=deque)
    _due: dict[int, float] = field(default_factory=dict)
    _sizes: dict[int, int] = field(default_factory=dict)
    _connection: int = 0
    _spoilt: float = -math.inf
    _foreign: float = -math.inf
    _steered: float = -math.inf
    _last_asked: float = -math.inf

    def poll(self, now: float) -> None:
        """Read what has come and request what is due. `now` is in s on the monotonic clock. Never raises."""
        self.link.poll(now)
        if self.link.connections != self._connection:
            self._forget()
        spoilt = self.decoder.skipped + self.decoder.bad_checksums
        for frame in self.decoder.feed(self.link.receive()[-MOST:]):
            self._take(frame, now)
        if self.decoder.skipped + self.decoder.bad_checksums > spoilt:
            self._spoilt = now
        self._expire(now)
        if self.link.alive:
            self._ask_due(now)

    def request(self, code: int, now: float, payload: bytes = b"") -> bool:
        """Request a code, unless its reply is still awaited or the link is not alive. Returns whether it was sent."""
        if code in self._asked or not self.link.alive:
            return False
        self._asked[code] = now
        self.requests += 1
        self._awaited.append((code, now))
        self.link.send(encode(MspFrame(code, payload, version=1 if code < 255 else 2)))
        return True

    def set_raw_rc(self, frame: MspFrame, now: float) -> bool:
        """Send a stick frame of `messages.set_raw_rc`, without waiting. Returns whether the link is alive."""
        if not self.link.alive:
            return False
        self.backlog += 1
        self._awaited.append((messages.SET_RAW_RC, now))
        self.link.send(encode(frame))
        return self.link.alive

    def message(self, code: int, now: float, max_age: float) -> Any:
        """The latest message of a code. None: there is none, or it is older than `max_age`, s."""
        reply = self.latest.get(code)
        return reply.message if reply is not None and now - reply.time <= max_age else None

    def delivered(self, start: float, end: float, hole: float = HOLE) -> bool:
        """Whether the stick frames sent from `start` to `end`, s, are known to have arrived, `hole` s at most apart."""
        return arrived(self.acknowledged, start, end, hole)

    def lossy(self, now: float) -> bool:
        """Whether the line loses replies, so that `latency` may be counted from a request whose reply was lost."""
        return now - self._spoilt < LOSSY_S

    def crowded(self, now: float) -> bool:
        """Whether another program asks on this link."""
        return now - self._foreign < CROWDED_S

    def steered(self, now: float) -> bool:
        """Whether another program sends sticks on this link."""
        return now - self._steered < CROWDED_S

    def _take(self, frame: MspFrame, now: float) -> None:
        if frame.direction == REQUEST:
            return  # an echo, for example from a line whose two wires touch
        if any(start in frame.payload for start in _STARTS):
            self.run_together += 1
            return
        asked = self._strike_off(frame.code, now)
        if frame.code == messages.SET_RAW_RC:
            if now - asked <= 2 * self.latency + TOLD_S:
                self.acknowledged.append(asked)
            return
        self.replies += 1
        self.latency = now - asked
        self.quickest = min(self.quickest, self.latency or math.inf)
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
        """Remove the request of a reply from the awaited ones. The controller answers in order, so the replies to
        earlier requests are lost. It is the first request of this code, or on a lossy line the latest that fits. There,
        a request that counted as lost may be answered yet: that is no other program's answer.
        """
        fitting = [k for k, (awaited, _) in enumerate(self._awaited) if awaited == code]
        if not fitting:
            if now - self._spoilt < FORGOTTEN and (late := [entry for entry in self._lost if entry[0] == code]):
                self._lost.remove(late[-1])  # the last one: replies to earlier ones were lost indeed
                return late[-1][1]
            self._foreign = now
            self._steered = now if code == messages.SET_RAW_RC else self._steered
            return now
        chosen = fitting[0]
        if self.lossy(now):
            chosen = next((k for k in reversed(fitting) if now - self._awaited[k][1] >= self.quickest), chosen)
        asked = now
        for k in range(chosen + 1):
            earlier, asked = self._awaited.popleft()
            self.backlog -= earlier == messages.SET_RAW_RC
            given_up = earlier != messages.SET_RAW_RC and self._asked.get(earlier) != asked
            if not given_up:
                self._asked.pop(earlier, None)
            self.timeouts += k < chosen and not given_up
            if k < chosen:
                self._lost.append((earlier, asked))
        return asked

    def _timeout(self, now: float) -> float:
        if self.lossy(now):
            return min(max(PATIENCE * self.quickest, LOSSY_TIMEOUT), TIMEOUT)
        slowest = max((reply.latency for reply in self.latest.values()), default=TIMEOUT)
        return min(max(PATIENCE * slowest, SHORTEST_TIMEOUT), TIMEOUT)

    def _expire(self, now: float) -> None:
        timeout = self._timeout(now)
        late = [code for code, asked in self._asked.items() if now - asked > timeout]
        for code in late:
            del self._asked[code]
        self.timeouts += len(late)
        while self._awaited and now - self._awaited[0][1] > FORGOTTEN:
            code, _ = self._awaited.popleft()
            if code == messages.SET_RAW_RC:
                self.backlog, self.timeouts = self.backlog - 1, self.timeouts + 1
                late.append(code)
        while self._lost and now - self._lost[0][1] > FORGOTTEN:
            self._lost.popleft()
        if late and self.decoder.pending:  # the bytes held back may not be a frame at all
            for frame in self.decoder.flush():
                self._take(frame, now)

    def _ask_due(self, now: float) -> None:
        behind = not self.lossy(now) and self._unanswered(now) > MAX_BACKLOG
        in_flight = sum(self._sizes.get(code, _UNKNOWN_REPLY) for code in self._asked)
        free = (code for code in self.schedule if code not in self._asked)
        overdue = {code: (now - self._due.setdefault(code, now)) * self.schedule[code] for code in free}
        for code in sorted((code for code in overdue if overdue[code] >= 0), key=overdue.__getitem__, reverse=True):
            size = self._sizes.get(code, _UNKNOWN_REPLY)
            if in_flight and (now - self._last_asked < PROBE_S if behind else in_flight + size > MAX_IN_FLIGHT):
                return
            self.request(code, now)
            self._last_asked = now
            in_flight += size
            period = (CROWDED if self.crowded(now) else 1.0) / self.schedule[code]
            self._due[code] = max(self._due[code] + period, now + 0.5 * period)

    def _unanswered(self, now: float) -> int:
        """The number of stick frames that have waited for longer than the link takes.

        Younger ones do not count, because on a slow radio some are always under way.
        """
        longest = 0.0 if math.isinf(self.quickest) else self.quickest
        return sum(code == messages.SET_RAW_RC and now - asked >= longest for code, asked in self._awaited)

    def _forget(self) -> None:
        """Start with a new connection: nothing from the old one is awaited or used any more."""
        self._connection = self.link.connections
        self._asked.clear()
        self._awaited.clear()
        self._lost.clear()
        self._due.clear()
        self.latest.clear()
        self.errors.clear()
        self.acknowledged.clear()
        self.backlog, self.latency, self.quickest = 0, 0.0, math.inf
        self.decoder = Decoder(bad_checksums=self.decoder.bad_checksums, skipped=self.decoder.skipped)


def ask(client: Client, code: int, timeout_s: float = 1.0, payload: bytes = b"", clock: Clock = MONOTONIC) -> Any:
    """Request a message and wait for it. This is for set-up, not for flight. A lost request is repeated.

    Returns:
        The message, an instance of `MESSAGES[code]`. For other codes, the payload.

    Raises:
        TimeoutError: no reply came. The message contains the reason that the link gives.
        ValueError: the controller refuses the code, or its reply cannot be parsed.
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


def _name(code: int) -> str:
    return f"{MESSAGES[code].__name__} ({code})" if code in MESSAGES else str(code)

"""The client: requests that time out, a schedule that never floods, and identification of a recorded controller."""

import socket
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from e2efly.flight.betaflight import messages, mode_slots
from e2efly.flight.betaflight.allowed_modes import ARM, OVERRIDE
from e2efly.flight.betaflight.client import (
    CROWDED,
    CROWDED_S,
    FORGOTTEN,
    LOSSY_S,
    MAX_BACKLOG,
    MAX_IN_FLIGHT,
    PROBE_S,
    SCHEDULE,
    TIMEOUT,
    Client,
    ask,
)  # fmt: skip
from e2efly.flight.betaflight.codec import ERROR, REPLY, Decoder, MspFrame, encode
from e2efly.flight.betaflight.controller import identify
from e2efly.flight.link import MOST, open_link
from tests.flight.msp_golden import REPLIES, payload

STICKS = messages.set_raw_rc([1500] * 8)


class Wire:
    """A link whose other end the test holds."""

    def __init__(self) -> None:
        self.alive, self.reason, self.connections, self.inbox = True, "", 1, b""
        self.decoder, self.sent = Decoder(), []

    def poll(self, now: float) -> None: ...

    def close(self) -> None: ...

    def send(self, data: bytes) -> None:
        self.sent += self.decoder.feed(data)

    def receive(self) -> bytes:
        data, self.inbox = self.inbox, b""
        return data

    def answer(self, limit: int | None = None) -> None:
        """Answer the oldest requests as the recorded firmware did."""
        count = len(self.sent) if limit is None else limit
        for frame in self.sent[:count]:
            data = payload(REPLIES[1][frame.code]) if frame.code in REPLIES[1] else b""
            self.inbox += encode(MspFrame(frame.code, data, REPLY, frame.version))
        del self.sent[:count]


def begun(schedule: dict[int, float] | None = None, polled: bool = True) -> tuple[Wire, Client]:
    """A client of a wire that is connected."""
    wire = Wire()
    client = Client(wire, schedule or {})
    if polled:
        client.poll(0.0)
    return wire, client


def test_a_reply_is_kept_with_its_time_and_latency() -> None:
    wire, client = begun()
    assert client.request(108, 1.0)
    assert not client.request(108, 1.1)  # one at a time
    assert len(wire.sent) == 1
    wire.answer()
    client.poll(1.2)
    assert client.latest[108].message == messages.AttitudeReply(0.0, 0.0, 0.0)
    assert (client.latest[108].time, client.latest[108].latency) == (1.2, pytest.approx(0.2))
    assert client.message(108, 1.3, 0.2) is not None
    assert client.message(108, 1.5, 0.2) is None
    assert client.request(108, 1.3)


def test_half_a_reply_that_runs_together_with_the_next_is_not_believed_though_its_checksum_fits() -> None:
    wire, client = begun()
    first, second = encode(MspFrame(105, bytes(range(32)), REPLY)), encode(MspFrame(108, bytes(6), REPLY))
    cut = first[:20] + second + second
    body = cut[3 : 3 + 2 + 32]
    check = 0
    for byte in body:
        check ^= byte
    wire.inbox = cut[: 3 + 2 + 32] + bytes([check]) + second
    client.poll(0.1)
    assert client.run_together == 1
    assert set(client.latest) == {108}


@pytest.mark.parametrize(
    "junk", [bytes(100_000), b"$M>\xfe\x01" * 20_000, encode(MspFrame(254, bytes(8), REPLY)) * 6000]
)
def test_of_a_flood_the_newest_bytes_are_read_and_the_answer_at_its_end_is_found(
    junk: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    wire, fed = Wire(), []
    client = Client(wire)
    client.poll(0.0)
    client.request(108, 1.0)
    feed = client.decoder.feed
    monkeypatch.setattr(client.decoder, "feed", lambda data: fed.append(len(data)) or feed(data))
    wire.inbox = junk
    wire.answer()
    client.poll(1.01)
    assert client.message(108, 1.01, 0.1) == messages.AttitudeReply(0.0, 0.0, 0.0)
    assert fed == [MOST]
    assert client.link.inbox == b""  # nothing old waits: what comes next is read at once


def test_a_request_without_answer_is_given_up_and_can_be_asked_again() -> None:
    _, client = begun()
    client.request(108, 0.0)
    client.poll(TIMEOUT)
    assert client.timeouts == 0
    client.poll(TIMEOUT + 0.01)
    assert client.timeouts == 1
    assert client.request(108, TIMEOUT + 0.02)


def test_a_false_start_holds_back_no_good_reply_and_is_forgotten_after_the_time_out() -> None:
    wire, client = begun()
    client.request(108, 0.0)
    client.request(105, 0.0)
    wire.answer(1)
    wire.inbox = b"$M>\xff\x01\xff\x03" + wire.inbox + b"$M>\xff\x01\xff\x03"
    client.poll(0.01)
    assert 108 in client.latest and client.decoder.pending
    client.poll(TIMEOUT + 0.01)
    assert client.decoder.pending == 0


def test_refused_and_unreadable_answers_are_said() -> None:
    wire, client = begun()
    wire.inbox = (
        encode(MspFrame(108, b"", ERROR)) + encode(MspFrame(150, b"\0", REPLY)) + encode(MspFrame(7, b"x", REPLY))
    )
    client.poll(0.1)
    assert "does not know or refuses" in client.errors[108]
    assert "STATUS_EX" in client.errors[150]
    assert client.latest[7].message == b"x"
    assert set(client.latest) == {7}
    wire.inbox = REPLIES[1][108]
    client.poll(0.2)
    assert 108 not in client.errors


def run(client: Client, wire: Wire, seconds: float, each: Callable[[], None], rate: float = 500.0) -> dict[int, int]:
    """Poll for a while; how often each code was asked for."""
    counts: dict[int, int] = {}
    for i in range(int(seconds * rate)):
        before = len(wire.sent)
        client.poll(i / rate)
        for frame in wire.sent[before:]:
            counts[frame.code] = counts.get(frame.code, 0) + 1
        each()
    return counts


def test_schedule_never_floods_a_controller_that_does_not_answer() -> None:
    wire, client = begun(SCHEDULE, polled=False)
    run(client, wire, TIMEOUT * 0.9, lambda: None)
    assert 0 < len(wire.sent) <= MAX_IN_FLIGHT // 64


def test_schedule_shares_a_slow_controller_fairly() -> None:
    wire, ticks = Wire(), iter(range(10**9))
    client = Client(wire, SCHEDULE)
    counts = run(client, wire, 20.0, lambda: wire.answer(1) if next(ticks) % 10 == 0 else None)  # 50 answers a second
    assert sum(counts.values()) == pytest.approx(1000, rel=0.05)
    for code in (105, 108, 102, 104):
        assert 0.15 < counts[code] / 1000 < 0.3
    assert counts[150] > 50 and counts[130] > 4


def test_a_message_longer_than_the_limit_is_asked_for_all_the_same() -> None:
    wire = Wire()
    client = Client(wire, {116: 10.0})

    def answer() -> None:
        for frame in wire.sent:
            wire.inbox += encode(MspFrame(frame.code, bytes(500), REPLY))
        wire.sent.clear()

    assert run(client, wire, 1.0, answer)[116] >= 9


def test_sticks_go_first_and_their_replies_are_eaten() -> None:
    wire, client = begun(SCHEDULE)
    wire.answer()
    client.poll(0.001)
    for i in range(MAX_BACKLOG + 1):
        assert client.set_raw_rc(STICKS, 0.002 + i * 1e-3)
    assert client.backlog == MAX_BACKLOG + 1
    wire.sent.clear()
    client.poll(0.001 + PROBE_S - 1e-3)
    assert wire.sent == []  # telemetry waits for a controller that is behind
    client.poll(0.001 + PROBE_S + 1e-3)
    client.poll(0.001 + PROBE_S + 2e-3)
    assert len(wire.sent) == 1  # but for one message, now and then
    wire.sent.clear()
    wire.inbox = encode(MspFrame(200, b"", REPLY)) * (MAX_BACKLOG + 1)
    client.poll(0.08)
    assert client.backlog == 0
    assert wire.sent
    assert 200 not in client.latest


ACKNOWLEDGED = encode(MspFrame(messages.SET_RAW_RC, b"", REPLY))
NOISE = b"$M>\x02\x6cab\x00"
"""A frame whose checksum is wrong."""


def asked_and_told(told: dict[int, float], latency: float = 0.01, frames: int = 40) -> Client:
    """A client after stick frames at 50 Hz, from 0 s on.

    Args:
        told: how late, s, the acknowledgement of a frame comes, by the frame's number. The others are never told.
        latency: of the reply to another request, s, before them.
        frames: how many.
    """
    wire = Wire()
    client = Client(wire)
    client.poll(-1.0)
    client.request(108, -1.0)
    wire.answer()
    client.poll(-1.0 + latency)
    events = sorted([(k * 0.02, False) for k in range(frames)] + [(k * 0.02 + late, True) for k, late in told.items()])
    for time, tells in events:
        wire.inbox += ACKNOWLEDGED if tells else b""
        client.poll(time)
        if not tells:
            client.set_raw_rc(STICKS, time)
    return client


def test_stick_frames_that_the_controller_acknowledged_are_known_to_have_arrived() -> None:
    client = asked_and_told(dict.fromkeys(range(40), 0.012))
    assert list(client.acknowledged) == pytest.approx([k * 0.02 for k in range(40)])
    assert client.delivered(0.1, 0.7) and client.delivered(0.0, 0.75)
    assert client.delivered(0.3, 0.3)
    assert not client.delivered(0.3, 1.5)  # nothing was sent, or nothing told, at the end of it
    assert not Client(Wire()).delivered(0.0, 1.0)


def test_a_hole_in_the_acknowledgements_is_no_delivery() -> None:
    """Frames that were sent and not told: 10 to 24, then all are told again."""
    silent = asked_and_told(dict.fromkeys(range(10), 0.012), frames=25)
    wire = silent.link
    assert isinstance(wire, Wire)
    assert silent.delivered(0.0, 0.18) and not silent.delivered(0.0, 0.48)
    for k in range(60, 90):  # after the client has forgotten those that were never answered
        silent.poll(0.02 * k)
        silent.set_raw_rc(STICKS, 0.02 * k + 0.8)
        wire.inbox += ACKNOWLEDGED
        silent.poll(0.02 * k + 0.81)
    assert not silent.delivered(0.0, 2.5) and not silent.delivered(0.1, 0.6)
    assert silent.delivered(2.2, 2.5)
    assert silent.delivered(0.0, 0.18)
    assert silent.delivered(0.1, 0.6, 2.5)  # a hole that is allowed


def test_an_acknowledgement_that_comes_too_late_may_be_another_frames() -> None:
    assert list(asked_and_told({0: 0.04}, frames=2).acknowledged) == [0.0]
    assert list(asked_and_told({0: 0.06}, frames=2).acknowledged) == []
    assert list(asked_and_told({0: 0.06}, latency=0.02, frames=2).acknowledged) == [0.0]  # a slow link


def test_a_line_that_spoils_bytes_is_lossy_for_a_while_and_asks_again_soon() -> None:
    wire, client = acquainted()
    assert not client.lossy(0.01)
    client.poll(0.06)
    wire.sent.clear()
    wire.inbox = NOISE
    client.poll(0.07)
    client.poll(0.08)
    assert client.lossy(0.08) and client.lossy(0.07 + LOSSY_S - 0.01) and not client.lossy(0.07 + LOSSY_S + 0.01)
    client.poll(0.06 + 0.05)
    client.poll(0.06 + 0.06)
    assert [frame.code for frame in wire.sent] == [108]


def test_on_a_lossy_line_an_acknowledgement_is_that_of_the_newest_frame_that_fits() -> None:
    for spoilt, frame in ((False, 0.1), (True, 0.12)):
        wire, client = acquainted()
        client.poll(0.02)
        client.set_raw_rc(STICKS, 0.1)  # its reply is lost
        client.set_raw_rc(STICKS, 0.12)
        client.set_raw_rc(STICKS, 0.139)  # too young: no reply is that quick
        wire.inbox = NOISE if spoilt else b""
        client.poll(0.135)
        wire.inbox = ACKNOWLEDGED
        client.poll(0.14)
        assert list(client.acknowledged) == [frame]
        assert client.backlog == (1 if spoilt else 2)


def test_where_another_program_asks_it_is_seen_and_less_is_asked() -> None:
    def asked(foreign: bool) -> Counter[int]:
        wire = Wire()
        client = Client(wire, SCHEDULE)

        def each() -> None:
            wire.answer()
            wire.inbox += encode(MspFrame(messages.Name.CODE, b"x", REPLY)) if foreign else b""

        counts = Counter(run(client, wire, 4.0, each))
        assert client.crowded(4.0) is foreign
        assert not client.crowded(4.0 + CROWDED_S + 0.01)
        return counts

    alone, crowded = asked(foreign=False), asked(foreign=True)
    for code, rate in SCHEDULE.items():
        assert crowded[code] == pytest.approx(4 * rate / CROWDED, rel=0.1, abs=2)
        assert alone[code] == pytest.approx(4 * rate, rel=0.05, abs=1)


@pytest.mark.parametrize(("code", "steered"), [(messages.SET_RAW_RC, True), (messages.Name.CODE, False)])
def test_sticks_of_another_program_are_told_from_its_questions(code: int, steered: bool) -> None:
    wire, client = begun()
    wire.inbox += encode(MspFrame(code, b"", REPLY))
    client.poll(0.1)
    assert client.crowded(0.2)
    assert client.steered(0.2) is steered
    assert not client.steered(0.1 + CROWDED_S + 0.01)


@pytest.mark.parametrize(("spoilt", "foreign"), [(True, False), (False, True)])
def test_on_a_lossy_line_a_late_reply_to_an_earlier_question_is_no_other_programs(spoilt: bool, foreign: bool) -> None:
    """Of two questions the newer was taken for the answered one, and then the other answer comes."""
    wire, client = acquainted()
    client.poll(0.02)
    client.set_raw_rc(STICKS, 0.1)
    client.set_raw_rc(STICKS, 0.12)
    wire.inbox = NOISE if spoilt else b""
    client.poll(0.135)
    wire.inbox = ACKNOWLEDGED
    client.poll(0.14)
    wire.inbox = ACKNOWLEDGED if spoilt else 2 * ACKNOWLEDGED
    client.poll(0.145)
    assert client.steered(0.15) is foreign and client.crowded(0.15) is foreign
    assert client.backlog == 0
    wire.inbox = ACKNOWLEDGED  # there was no third question
    client.poll(0.15)
    assert client.steered(0.16)


def test_a_slow_radio_is_no_controller_that_is_behind() -> None:
    wire, client = begun(SCHEDULE, polled=False)
    delay, under_way, counts = 0.08, deque[tuple[float, bytes]](), Counter[int]()
    client.poll(0.0)
    for tick in range(1, 5000):  # 5 s, with stick frames at 100 Hz: eight of them are always under way
        now = tick * 1e-3
        if tick % 10 == 0:
            client.set_raw_rc(STICKS, now)
        wire.answer()
        if wire.inbox:
            under_way.append((now + delay, wire.receive()))
        while under_way and under_way[0][0] <= now:
            wire.inbox += under_way.popleft()[1]
        before = {code: reply.time for code, reply in client.latest.items()}
        client.poll(now)
        counts.update(code for code, reply in client.latest.items() if reply.time != before.get(code))
    for code in (messages.StatusEx.CODE, messages.Rc.CODE, messages.AttitudeReply.CODE, messages.RawImu.CODE):
        assert counts[code] > 5 * 10  # asked for again when its answer is there: at most 12 a second


def acquainted() -> tuple[Wire, Client]:
    """A client that asks for one code, at 20 Hz, and whose first answer took 10 ms."""
    wire, client = begun({108: 20.0})
    wire.answer()
    client.poll(0.01)
    return wire, client


def test_where_answers_are_quick_a_lost_one_is_asked_for_again_soon() -> None:
    """On a line that loses frames: before the link counts as lost."""
    wire, client = acquainted()
    client.poll(0.06)
    assert len(wire.sent) == 1  # its answer is lost
    wire.sent.clear()
    client.poll(0.06 + 0.07)
    assert not wire.sent
    client.poll(0.06 + 0.09)
    assert [frame.code for frame in wire.sent] == [108]
    assert client.timeouts == 1


def test_latency_is_of_the_request_that_was_answered_though_it_had_been_given_up() -> None:
    """A line that turns slow: the answer comes after the request was sent again."""
    wire, client = acquainted()
    assert client.latency == pytest.approx(0.01)
    client.poll(0.06)
    client.poll(0.16)
    assert len(wire.sent) == 2
    wire.answer(1)
    client.poll(0.18)
    assert client.latency == pytest.approx(0.12)
    assert not client.request(108, 0.18)  # the second is still awaited
    wire.answer()
    client.poll(0.2)
    assert client.latency == pytest.approx(0.04)


def test_lost_answers_are_no_latency() -> None:
    """The answer to a later stick frame tells that the one to the request before it is lost."""
    wire, client = acquainted()
    client.set_raw_rc(STICKS, 0.05)
    client.poll(0.06)
    client.set_raw_rc(STICKS, 0.07)
    del wire.sent[1]
    wire.answer()
    client.poll(0.08)
    assert (client.backlog, client.timeouts) == (0, 1)
    client.poll(0.11)
    wire.answer()
    client.poll(0.12)
    assert client.latency == pytest.approx(0.01)


def fly(client: Client, wire: Wire, rate: float, start: float, end: float) -> None:
    """Stick frames at 125 Hz to a controller that answers at a rate, in its own time."""
    credit = 0.0
    for tick in range(round(125 * start), round(125 * end)):
        credit = min(credit + rate / 125, len(wire.sent))
        wire.answer(int(credit))
        credit -= int(credit)
        client.poll(tick / 125)
        client.set_raw_rc(STICKS, tick / 125)


def test_a_busy_controller_that_paused_catches_up_and_is_not_flooded() -> None:
    """It answers 350 a second, little more than is asked of it, and not at all for a while."""
    wire, client = begun(SCHEDULE, polled=False)
    fly(client, wire, 350.0, 0.0, 2.0)
    assert client.latency < 0.03 and len(wire.sent) < 9
    fly(client, wire, 0.0, 2.0, 2.5)
    fly(client, wire, 350.0, 2.5, 4.5)
    assert client.latency < 0.03 and len(wire.sent) < 9


def test_a_controller_that_falls_behind_is_found_out() -> None:
    wire, client = begun(SCHEDULE, polled=False)
    fly(client, wire, 350.0, 0.0, 1.0)
    fly(client, wire, 110.0, 1.0, 2.5)
    assert client.latency > 0.125


def test_lost_answers_to_sticks_do_not_stop_telemetry_for_good() -> None:
    wire, client = begun(SCHEDULE)
    for _ in range(9):
        client.set_raw_rc(STICKS, 0.0)
    client.poll(FORGOTTEN + 0.1)
    assert client.backlog == 0
    assert client.timeouts >= 9


def test_a_new_connection_starts_anew() -> None:
    wire, client = begun()
    client.request(108, 0.0)
    wire.answer()
    client.poll(0.1)
    client.request(105, 0.1)
    client.set_raw_rc(STICKS, 0.1)
    wire.inbox = b"$M>\x40"
    client.poll(0.2)
    wire.connections += 1
    client.poll(0.3)
    assert client.latest == {} and client.backlog == 0 and client.decoder.pending == 0
    assert client.request(105, 0.3)


def test_a_dead_link_sends_nothing_and_says_so() -> None:
    wire = Wire()
    wire.alive = False
    client = Client(wire, SCHEDULE)
    client.poll(0.0)
    assert not client.request(108, 0.0)
    assert not client.set_raw_rc(STICKS, 0.0)
    assert wire.sent == []


def test_an_echo_of_requests_is_no_reply() -> None:
    wire, client = begun()
    client.request(10, 0.0)
    wire.inbox = encode(MspFrame(10))
    client.poll(0.1)
    assert client.latest == {}


def recorded(code: int) -> bytes:
    return REPLIES[1].get(code, encode(MspFrame(code, b"", ERROR)))


@contextmanager
def controller(reply: Callable[[int], bytes]) -> Iterator[Client]:
    """A client connected by TCP to a peer that answers as `reply` says, one connection after the other."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(60.0)  # a client may first start processes of its own, on a busy machine

        def serve() -> None:
            while True:
                try:
                    peer = listener.accept()[0]
                    with peer:
                        decoder = Decoder()
                        while data := peer.recv(4096):
                            for frame in decoder.feed(data):
                                answer = reply(frame.code)
                                if answer == b"drop":
                                    raise ConnectionError
                                peer.sendall(answer)
                except ConnectionError:
                    continue
                except OSError:
                    return

        thread = threading.Thread(target=serve)
        thread.start()
        link = open_link(f"tcp:127.0.0.1:{listener.getsockname()[1]}")
        try:
            yield Client(link)
        finally:
            link.close()
            listener.shutdown(socket.SHUT_RDWR)
            thread.join()


def test_identify_the_recorded_controller() -> None:
    with controller(recorded) as client:
        info = identify(client, 10.0)
    assert (info.variant, info.api, info.version, info.craft) == ("BTFL", (1, 47), (4, 6, 0), "golden one")
    assert info.rates.rates_type == "ACTUAL"
    assert info.throttle.min_check == info.rx.min_check == 1040
    assert info.rx_map.letters == "TAER1234"
    assert info.slots(ARM) == (mode_slots.ModeRange(0, 0, 1700, 2100),)
    assert info.slots(OVERRIDE) == ()
    assert info.failsafe.delay == pytest.approx(1.2)


@pytest.mark.parametrize(
    ("code", "data", "words"),
    [
        (2, b"INAV", "the firmware is 'INAV'; accepted: 'BTFL'"),
        (1, b"\0\1\x2b", r"Betaflight 4\.6\.0, MSP 1\.43; accepted: 4\.3 \(MSP 1\.44\), "),
        (64, b"\0\0\0\0\0\0\0\0", "RX_MAP"),
        (111, b"\0", "RC_TUNING"),
    ],
)
def test_what_is_not_known_is_refused(code: int, data: bytes, words: str) -> None:
    strange = encode(MspFrame(code, data, REPLY))
    with (
        controller(lambda asked: strange if asked == code else recorded(asked)) as client,
        pytest.raises(ValueError, match=words),
    ):
        identify(client, 10.0)


def test_identify_over_a_line_that_garbles_halves_and_drops() -> None:
    seen: dict[int, int] = {}

    def reply(code: int) -> bytes:
        seen[code] = seen.get(code, 0) + 1
        whole = recorded(code)
        if seen[code] > 1:
            return whole
        if code == 44:
            return b"drop"
        return {0: b"\xff$M>$X" + whole, 1: whole[:-2], 2: whole}[code % 3]

    with controller(reply) as client:
        assert identify(client, 20.0).craft == "golden one"
        assert client.link.connections == 2


def test_ask_says_why_there_is_no_answer() -> None:
    with controller(lambda code: b"") as client, pytest.raises(TimeoutError, match=r"Name \(10\).*nothing that is MSP"):
        ask(client, 10, 0.2)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        target = f"tcp:127.0.0.1:{listener.getsockname()[1]}"
    with pytest.raises(TimeoutError, match="refused"):
        ask(Client(open_link(target)), 10, 0.2)
    with controller(recorded) as client, pytest.raises(ValueError, match="MSP 99: the controller does not know"):
        ask(client, 99, 10.0)

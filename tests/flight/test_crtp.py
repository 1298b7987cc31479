"""CRTP: packets, links and words."""

import math
import os
import sys
import time
from collections.abc import Callable
from typing import Any

import pytest

from e2efly.flight.autopilots import check_link
from e2efly.flight.crazyflie.contents import entry
from e2efly.flight.crazyflie.crtp import LOGS, PARAMETERS, CrtpPacket, PacketReader, arming, external_pose, setpoint
from e2efly.flight.crazyflie.crtp_link import RadioPort, open_crtp
from e2efly.flight.crazyflie.words import TypedWish, Words
from e2efly.flight.pilot.flight_state import Mission


def test_packets_are_those_of_the_firmware() -> None:
    """Worked out by hand from the packed structures of the firmware's sources."""
    assert setpoint((0.0, 0.0, 0.0), 0).encode().hex() == "7c0b" + "00" * 14 + "01"
    turning = setpoint((3.141592653589793, -1.5707963267948966, 1.0471975511965976), 0x1234).encode()
    assert turning.hex() == "7c0b" + "00003443" + "0000b442" + "00007042" + "3412" + "01"  # 180, +90, 60 deg/s
    pose = external_pose((1.0, -2.0, 0.5), (1.0, 0.0, 0.0, 0.0)).encode()
    assert pose.hex() == "6d08" + "0000803f" + "000000c0" + "0000003f" + "00000000" * 3 + "0000803f"
    assert arming(True, 12).encode().hex() == "9d0101" and arming(False, 11).encode().hex() == "dc0100"
    with pytest.raises(ValueError, match="31 bytes; accepted: 30 at most"):
        CrtpPacket(2, 0, bytes(31)).encode()


def test_a_stream_of_packets_may_come_in_any_pieces() -> None:
    sent = [CrtpPacket(13, 1, b"\1abc"), CrtpPacket(5, 2), CrtpPacket(15, 0, bytes(30))]
    stream = b"\1\xff".join(packet.framed() for packet in sent)  # between them one that carries nothing
    for size in (1, 3, len(stream)):
        reader = PacketReader()
        pieces = (stream[i : i + size] for i in range(0, len(stream), size))
        assert [packet for piece in pieces for packet in reader.feed(piece)] == sent


def test_tables_name_parameters_and_logs() -> None:
    log = entry(LOGS, b"\2\x2a\1\x07stateEstimate\0qx\0")
    assert log is not None and (log.name, log.id, log.format, log.size) == ("stateEstimate.qx", 298, "f", 4)
    parameter = entry(PARAMETERS, b"\2\5\0\x48stabilizer\0stop\0")  # 0x40: it may only be read
    assert parameter is not None and parameter.value(b"\7") == 7.0
    newer = entry(LOGS, b"\2\0\0\x0ea\0b\0")  # a type that is not known does not keep the table from coming
    assert newer is not None and newer.name == "a.b" and math.isnan(newer.value(b"\1"))
    assert entry(LOGS, b"\2") is None


@pytest.mark.parametrize(
    "text",
    ["radio://0/126/2M", "radio://0/80/3M", "radio://0/80/2M/E7", "crazyflie:udp:localhost", "crazyflie:tcp:a:1",
     "crazyflie:udp:127.0.0.1:99999"],
)  # fmt: skip
def test_texts_that_name_no_link_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"accepted: radio://0/80/2M/E7E7E7E7E7 .* or crazyflie:udp:HOST:PORT"):
        check_link(text)
    for good in ("radio://0/80/2M/E7E7E7E7E7", "crazyflie:radio://1/2/250K", "crazyflie:udp:127.0.0.1:19850"):
        check_link(good)


class Radio:
    """A Crazyradio in whose air a Crazyflie answers each packet, or not."""

    def __init__(self, answer: Callable[[bytes], bytes | None]) -> None:
        self.answer, self.set, self.sent = answer, dict[int, tuple[int, bytes]](), list[bytes]()
        self._told = b""

    def ctrl_transfer(self, kind: int, request: int, value: int, index: int, data: bytes, timeout: int) -> None:
        assert (kind, index) == (0x40, 0) and timeout > 0
        self.set[request] = value, bytes(data)

    def write(self, endpoint: int, data: bytes, timeout: int) -> None:
        assert endpoint == 1 and timeout > 0
        self.sent.append(bytes(data))
        answer = self.answer(bytes(data))
        self._told = b"\0" if answer is None else b"\1" + answer
        time.sleep(0.0005)

    def read(self, endpoint: int, size: int, timeout: int) -> bytes:
        assert (endpoint, size) == (0x81, 64) and timeout > 0
        return self._told


def until(holds: Callable[[], Any]) -> bool:
    end = time.monotonic() + 5.0
    while not holds() and time.monotonic() < end:
        time.sleep(0.002)
    return bool(holds())


def test_a_radio_sends_each_packet_and_fetches_answers() -> None:
    refused = [b"\x9c\2"]  # not acknowledged the first time

    def answer(data: bytes) -> bytes | None:
        if data in refused:
            refused.remove(data)
            return None
        return data if data != b"\xff" else b""

    radio = Radio(answer)
    port = RadioPort(radio, 80, 2, bytes.fromhex("E7E7E7E701"))
    assert radio.set[1] == (80, b"") and radio.set[2] == (0, b"\xe7\xe7\xe7\xe7\x01") and radio.set[3] == (2, b"")
    assert until(port.connected)
    assert port.write(b"\2\x9c\1\2\x9c\2") == 6
    come = bytearray()
    assert until(lambda: come.extend(port.read()) or len(come) >= 6)
    assert come == b"\2\x9c\1\2\x9c\2" and radio.sent.count(b"\x9c\2") == 2
    port.close()


def test_a_radio_tells_when_nobody_answers_and_when_it_is_pulled_out() -> None:
    deaf = RadioPort(Radio(lambda data: None), 80, 2, bytes(5))
    assert not deaf.connected()
    with pytest.raises(ConnectionError, match="does not answer: is it on, with this channel, rate and address"):
        deaf.read()
    deaf.close()

    def gone(data: bytes) -> bytes:
        raise OSError("no such device")

    pulled = RadioPort(Radio(gone), 80, 2, bytes(5))
    assert until(lambda: pulled._error)
    with pytest.raises(ConnectionError, match="Crazyradio: no such device"):
        pulled.read()
    pulled.close()


def test_a_missing_package_is_named_with_its_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "usb.core", None)
    with pytest.raises(ValueError, match=r"accepted: pip install 'e2efly\[crazyflie\]'"):
        open_crtp("radio://0/80/2M").poll(0.0)


def test_the_pilot_types_words_and_any_other_line_lands() -> None:
    reads, writes = os.pipe()
    words = Words(reads)
    assert words() == TypedWish()
    for typed, wish in (
        (b"arm\n", TypedWish(True)), (b"hov", TypedWish(True)), (b"er\n", TypedWish(True, Mission.HOVER)),
        (b"Policy\n", TypedWish(True, Mission.POLICY)), (b"\n", TypedWish(True)),
        (b"hover\n", TypedWish(True, Mission.HOVER)),
        (b"hoover\n", TypedWish(True)), (b"hover\noff\n", TypedWish()), (b"hover\n", TypedWish(False, Mission.HOVER)),
    ):  # fmt: skip
        os.write(writes, typed)
        assert words() == wish, typed
    os.close(writes)
    assert words() is None and words() is None  # the terminal is gone for good
    os.close(reads)

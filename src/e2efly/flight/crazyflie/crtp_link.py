"""Links that carry CRTP packets: a Crazyradio (USB), and UDP with one packet in each datagram (simulators).

A Crazyradio sends one packet at a time, and what the Crazyflie has to say comes back in its acknowledgement. So a
thread sends all the time: what there is to send, or else a packet that carries nothing. Packets that get lost are sent
again by the radio itself, three times. Requests and registers as in Bitcraze's documentation of the Crazyradio's USB
protocol (https://www.bitcraze.io/documentation/repository/crazyradio-firmware/master/functional-areas/usb_radio_protocol/).
"""

import re
import socket
import threading
import time
from collections import deque
from contextlib import suppress
from importlib import import_module
from typing import Any

from e2efly.flight.crazyflie.crtp import whole
from e2efly.flight.link import StreamLink

ACCEPTED = "radio://0/80/2M/E7E7E7E7E7 (radio, channel 0 to 125, 250K, 1M or 2M, address) or crazyflie:udp:HOST:PORT"
CRAZYFLIE, RADIO = "crazyflie:", "radio://"
"""Begin the text of a link to a Crazyflie."""
VENDOR, PRODUCT = 0x1915, 0x7777
"""USB identity of a Crazyradio."""
CHANNEL, ADDRESS, RATE, POWER, RETRY_DELAY, RETRIES, ACKNOWLEDGED = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x10
"""Its requests ..."""
OUT, INTO, REQUEST, USB_MS = 0x01, 0x81, 0x40, 1000
"""... its endpoints, the type of a request, and the longest time that one may take, ms."""
FULL_POWER, RETRY_BYTES, TIMES = 3, 0x80 | 32, 3
"""0 dBm; an acknowledgement of up to 32 bytes is waited for; a packet is sent again this often."""
RATES = {"250K": 0, "1M": 1, "2M": 2}
ASKS = b"\xff"
"""A packet that carries nothing: it only fetches an answer."""
WAITING = 64
"""Most packets that wait to be sent."""
DEAF_S = 1.0
"""Without an acknowledgement for this time, the Crazyflie counts as gone, s."""


def open_crtp(target: str) -> StreamLink:
    """A link from its text. It connects when it is first polled, and carries framed packets.

    Raises:
        ValueError: the text is not valid. The message names it and what is accepted.
    """
    text = target.removeprefix(CRAZYFLIE)
    if found := re.fullmatch(r"radio://(\d)/(\d{1,3})/(250K|1M|2M)(?:/([0-9A-Fa-f]{10}))?", text):
        number, channel, address = int(found[1]), int(found[2]), bytes.fromhex(found[4] or "E7E7E7E7E7")
        if channel <= 125:
            rate = RATES[found[3]]
            return StreamLink(target, lambda: RadioPort(crazyradio(number), channel, rate, address))
    if (found := re.fullmatch(r"udp:(.+):(\d{1,5})", text)) and 0 < int(found[2]) < 65536:
        try:
            family, _, _, _, peer = socket.getaddrinfo(found[1].strip("[]"), int(found[2]), type=socket.SOCK_DGRAM)[0]
        except (OSError, UnicodeError) as error:
            raise ValueError(f"link {target!r}: no such address ({error}); accepted: {ACCEPTED}") from None
        return StreamLink(target, lambda: _DatagramPort(family, peer))
    raise ValueError(f"link {target!r}; accepted: {ACCEPTED}")


def crazyradio(number: int) -> Any:
    """The Crazyradio with this number, in the order in which the system has them: a device of PyUSB.

    Raises:
        ValueError: PyUSB is missing.
        OSError: there is no such radio, or it may not be used.
    """
    try:
        core = import_module("usb.core")  # only where a radio is used
    except ImportError as error:
        raise ValueError(f"a Crazyradio needs PyUSB ({error}); accepted: pip install 'e2efly[crazyflie]'") from None
    try:
        radios = list(core.find(find_all=True, idVendor=VENDOR, idProduct=PRODUCT) or ())
    except core.NoBackendError as error:
        raise OSError(f"PyUSB finds no libusb ({error}); install libusb-1.0") from None
    if number >= len(radios):
        raise OSError(f"no Crazyradio {number}: the system has {len(radios)}")
    radios[number].set_configuration()
    return radios[number]


class RadioPort:
    """A Crazyradio, tuned to one Crazyflie."""

    def __init__(self, device: Any, channel: int, rate: int, address: bytes) -> None:
        """Tune a radio, and begin to send.

        Args:
            device: a device of PyUSB.
            channel: 0 to 125: 2400 MHz and this many MHz.
            rate: a value of `RATES`.
            address: 5 bytes.

        Raises:
            OSError: the radio does not obey.
        """
        self._device = device
        for request, value, data in (
            (RATE, rate, b""), (CHANNEL, channel, b""), (ADDRESS, 0, address), (POWER, FULL_POWER, b""),
            (RETRIES, TIMES, b""), (RETRY_DELAY, RETRY_BYTES, b""), (ACKNOWLEDGED, 1, b""),
        ):  # fmt: skip
            device.ctrl_transfer(REQUEST, request, value, 0, data, USB_MS)
        self._out: deque[bytes] = deque()
        self._come: deque[bytes] = deque()
        self._answered, self._ended, self._error = -float("inf"), False, ""
        self._thread = threading.Thread(target=self._run, daemon=True, name="crazyradio")
        self._thread.start()

    def connected(self) -> bool:
        """Whether the Crazyflie has acknowledged a packet."""
        if self._error:
            raise ConnectionError(self._error)
        return self._answered > 0

    def read(self) -> bytes:
        """The framed packets that have come."""
        if self._error:
            raise ConnectionError(self._error)
        if time.monotonic() - self._answered > DEAF_S:
            raise ConnectionError("the Crazyflie does not answer: is it on, with this channel, rate and address?")
        data = bytearray()
        with suppress(IndexError):
            while True:
                raw = self._come.popleft()
                data += bytes([len(raw)]) + raw
        return bytes(data)

    def write(self, data: bytes) -> int:
        """Queue framed packets. Returns how many bytes were taken."""
        rest = bytearray(data)
        if len(self._out) < WAITING:
            self._out.extend(whole(rest))
        return len(data) - len(rest)

    def close(self) -> None:
        """End the thread, and let the radio go."""
        self._ended = True
        if self._thread is not threading.current_thread():
            self._thread.join(2 * USB_MS / 1000)
        with suppress(ImportError):
            import_module("usb.util").dispose_resources(self._device)

    def _run(self) -> None:
        kept: bytes | None = None  # not acknowledged yet: it is sent once more
        try:
            while not self._ended:
                packet = kept or (self._out.popleft() if self._out else ASKS)
                self._device.write(OUT, packet, USB_MS)
                answer = bytes(self._device.read(INTO, 64, USB_MS))
                if answer and answer[0] & 1:
                    kept, self._answered = None, time.monotonic()
                    if len(answer) > 1:
                        self._come.append(answer[1:])
                else:
                    kept = None if kept or packet is ASKS else packet
        except Exception as error:  # any: the thread must say why it ends
            self._error = f"Crazyradio: {error}"


class _DatagramPort:
    """UDP to one address."""

    def __init__(self, family: int, peer: Any) -> None:
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.connect(peer)
            self._socket.send(ASKS)  # a simulator learns this address by it
        except OSError:
            self._socket.close()
            raise

    def connected(self) -> bool:
        return True

    def read(self) -> bytes:
        data = bytearray()
        with suppress(BlockingIOError):
            while len(data) < 1 << 16:
                raw = self._socket.recv(256)[:255]
                data += bytes([len(raw)]) + raw
        return bytes(data)

    def write(self, data: bytes) -> int:
        rest, taken = bytearray(data), 0
        with suppress(BlockingIOError):
            for raw in whole(rest):
                self._socket.send(raw)
                taken += 1 + len(raw)
        return taken

    def close(self) -> None:
        self._socket.close()

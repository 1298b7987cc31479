"""Encodes and decodes MSP frames: version 1 with jumbo payloads, and version 2 ("native", `$X`). Pure, no transport.

Layouts, little endian, after the `$`:
- version 1: `M`, direction, length u8, code u8, payload, XOR of everything from the length on. A length of 255 marks a
  jumbo frame, whose real length, u16, follows the code.
- version 2: `X`, direction, flags u8, code u16, length u16, payload, CRC-8/DVB-S2 of everything from the flags on.
"""

import struct
from dataclasses import dataclass, field
from enum import Enum, auto
from itertools import accumulate
from operator import xor

REQUEST, REPLY, ERROR = "<", ">", "!"
"""Directions: to the controller, from it, and from it when it does not know or refuses the code."""
MAX_PAYLOAD = 1024
"""The default of the longest payload that a decoder waits for, bytes."""
_JUMBO = 255
_SHORTEST = 6
_DIRECTIONS = {ord(mark): mark for mark in (REQUEST, REPLY, ERROR)}
_START, _V1, _V2 = b"$MX"


def _crc_of(byte: int) -> int:
    for _ in range(8):
        byte = (byte << 1) ^ 0x1D5 if byte & 0x80 else byte << 1
    return byte


_CRC = bytes(_crc_of(byte) for byte in range(256))
"""CRC-8/DVB-S2 (polynomial 0xD5, from 0, not reflected) of one byte."""
_PERIOD = 93
"""The number of zero bytes after which every CRC state repeats."""
_SHIFTS = tuple(accumulate(range(_PERIOD - 1), lambda table, _: table.translate(_CRC), initial=bytes(range(256))))
"""`_SHIFTS[n][c]`: the CRC state c after n zero bytes. It gives the CRC of any section from two running CRCs."""


def _crc_step(state: int, byte: int) -> int:
    return _CRC[state ^ byte]


@dataclass(frozen=True)
class MspFrame:
    """One MSP message."""

    code: int
    """The code of the message: 0 to 254 in version 1, 0 to 65535 in version 2."""
    payload: bytes = b""
    """The content of the message."""
    direction: str = REQUEST
    """`REQUEST`, `REPLY` or `ERROR`."""
    version: int = 1
    """1 or 2."""
    flags: int = 0
    """Flags byte of version 2. 0 in version 1."""


def encode(frame: MspFrame) -> bytes:
    """The bytes of a frame.

    Raises:
        ValueError: the version cannot carry a value. The message names the field.
    """
    if frame.version not in (1, 2):
        raise ValueError(f"MSP frame: version is {frame.version!r}; accepted: 1 or 2")
    if frame.direction not in _DIRECTIONS.values():
        raise ValueError(f"MSP frame: direction is {frame.direction!r}; accepted: '<', '>' or '!'")
    codes, flags = ((254, 0), (65535, 255))[frame.version - 1]
    for name, value, most in (("code", frame.code, codes), ("flags", frame.flags, flags)):
        if not 0 <= value <= most:
            raise ValueError(f"MSP frame: {name} is {value!r}; accepted: 0 to {most} in version {frame.version}")
    size = len(frame.payload)
    if size > 65535:
        raise ValueError(f"MSP frame: payload has {size} bytes; accepted: up to 65535")
    mark = frame.direction.encode()
    if frame.version == 2:
        body = struct.pack("<BHH", frame.flags, frame.code, size) + frame.payload
        return b"$X" + mark + body + bytes([list(accumulate(body, _crc_step, initial=0))[-1]])
    jumbo = struct.pack("<H", size) if size >= _JUMBO else b""
    body = bytes([min(size, _JUMBO), frame.code]) + jumbo + frame.payload
    return b"$M" + mark + body + bytes([list(accumulate(body, xor))[-1]])


class _Not(Enum):
    """Why no frame begins at a position: it is not ONE, it is not COMPLETE, or it is not INTACT."""

    ONE = auto()
    COMPLETE = auto()
    INTACT = auto()


@dataclass
class Decoder:
    """Finds the frames in a stream of bytes, whatever else is in it.

    If a start of a frame turns out to be false, only its first byte is skipped, and the search continues at the next
    byte. So garbage, a flipped bit or a corrupt length does not hide a good frame that follows. Half a frame does not
    delay the frames after it either: a complete frame is returned even if it lies inside an incomplete one. Every start
    is checked in constant time, because running checksums of the stream are kept. Never raises.
    """

    max_payload: int = MAX_PAYLOAD
    """The longest payload that is accepted, bytes."""
    bad_checksums: int = 0
    """Number of frames with a wrong checksum so far."""
    skipped: int = 0
    """Number of bytes so far that were not part of a good frame."""
    _bytes: bytearray = field(default_factory=bytearray, repr=False)
    _xor: list[int] = field(default_factory=lambda: [0], repr=False)
    _crc: list[int] = field(default_factory=lambda: [0], repr=False)

    @property
    def pending(self) -> int:
        """Number of bytes held back as the beginning of a frame, at most `max_payload` and a header."""
        return len(self._bytes)

    def feed(self, data: bytes) -> list[MspFrame]:
        """The frames that these bytes complete, in order."""
        self._bytes += data
        self._xor += list(accumulate(data, xor, initial=self._xor[-1]))[1:]
        self._crc += list(accumulate(data, _crc_step, initial=self._crc[-1]))[1:]
        return self._scan(waiting=True)

    def flush(self) -> list[MspFrame]:
        """Give up the incomplete frame, for example after a silence of the line. Returns the good frames inside it."""
        return self._scan(waiting=False)

    def _scan(self, waiting: bool) -> list[MspFrame]:
        frames: list[MspFrame] = []
        at, end = 0, len(self._bytes)
        while True:
            start = self._bytes.find(_START, at)
            start = end if start < 0 else start
            self.skipped += start - at
            at = start
            if at == end:
                break
            found = self._judge(at)
            if isinstance(found, tuple):
                frame, at = found
                frames.append(frame)
            elif found is _Not.COMPLETE and waiting:
                inner = self._whole_after(at)
                if inner is None:
                    break
                self.skipped += inner - at
                at = inner
            else:
                self.bad_checksums += found is _Not.INTACT
                self.skipped += 1
                at += 1
        del self._bytes[:at], self._xor[:at], self._crc[:at]
        return frames

    def _whole_after(self, at: int) -> int | None:
        """Where the next complete frame begins after the start of an incomplete one. None: there is none."""
        while (at := self._bytes.find(_START, at + 1)) > 0:
            if isinstance(self._judge(at), tuple):
                return at
        return None

    def _judge(self, at: int) -> tuple[MspFrame, int] | _Not:
        """The frame that starts here and where it ends, or why no frame starts here."""
        data, size = self._bytes, len(self._bytes) - at
        if (size > 1 and data[at + 1] not in (_V1, _V2)) or (size > 2 and data[at + 2] not in _DIRECTIONS):
            return _Not.ONE
        if size < _SHORTEST:
            return _Not.COMPLETE
        body, version, flags = at + 3, 1, 0
        if data[at + 1] == _V2:
            if size < 9:
                return _Not.COMPLETE
            version = 2
            flags, code, length = struct.unpack_from("<BHH", data, body)
            start = body + 5
        else:
            length, code = data[body], data[body + 1]
            start = body + 2
            if length == _JUMBO:
                if size < _SHORTEST + 2:
                    return _Not.COMPLETE
                (length,) = struct.unpack_from("<H", data, start)
                start += 2
        if length > self.max_payload:
            return _Not.ONE
        end = start + length
        if end >= len(data):
            return _Not.COMPLETE
        if version == 1:
            checksum = self._xor[end] ^ self._xor[body]
        else:
            checksum = self._crc[end] ^ _SHIFTS[(end - body) % _PERIOD][self._crc[body]]
        if checksum != data[end]:
            return _Not.INTACT
        return MspFrame(code, bytes(data[start:end]), _DIRECTIONS[data[at + 2]], version, flags), end + 1

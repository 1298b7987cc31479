"""MAVLink 2 frames against pymavlink, both ways, and what is no frame."""

import random
import struct
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from e2efly.flight.mavlink.wire import LAYOUTS, FrameReader, MessageLayout, checksum, encode

RNG = random.Random(0)


def drawn(layout: MessageLayout) -> dict[str, Any]:
    """Values of every field, some of them zero at the end."""
    values: dict[str, Any] = {}
    for name, kind in layout.fields:
        if kind.endswith("s"):
            values[name] = bytes(RNG.randrange(1, 128) for _ in range(int(kind[:-1])))
            continue
        count = int(kind[:-1] or 1)
        some = [_number(kind[-1]) for _ in range(count)]
        values[name] = tuple(some) if count > 1 else some[0]
    return values


def _number(kind: str) -> float:
    if kind == "f":
        return struct.unpack("<f", struct.pack("<f", RNG.uniform(-10, 10)))[0]
    bits = 8 * struct.calcsize("<" + kind)
    return RNG.randrange(1 << (bits - (kind.islower())))


def theirs(layout: MessageLayout) -> Any:
    return mav.mavlink_map[layout.id]


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.name)
def test_pymavlink_reads_what_is_written_and_the_other_way_round(layout: MessageLayout) -> None:
    values = drawn(layout)
    frame = encode(layout.name, values, sequence=300, system=7, component=191)
    reader = mav.MAVLink(None)
    read = reader.parse_buffer(frame)
    assert read is not None and len(read) == 1 and read[0].get_type() == layout.name
    assert (read[0].get_srcSystem(), read[0].get_srcComponent(), read[0].get_seq()) == (7, 191, 300 & 0xFF)
    back = bytes(read[0].pack(mav.MAVLink(None, srcSystem=7, srcComponent=191)))
    told = list(FrameReader().feed(back))
    assert len(told) == 1 and told[0].name == layout.name
    assert told[0].fields == values


def test_golden_bytes_of_a_set_point() -> None:
    """By hand from the definition: 100 ms, level, rates (0.5, -0.25, 0), half the thrust, rates and thrust only."""
    payload = struct.pack("<I4f3ff3B", 100, 1, 0, 0, 0, 0.5, -0.25, 0.0, 0.5, 1, 1, 128)
    head = bytes([len(payload), 0, 0, 5, 1, 191, 82, 0, 0])
    frame = b"\xfd" + head + payload + struct.pack("<H", checksum(head + payload + bytes([49])))
    assert checksum(b"123456789") == 0x6F91  # the check value of CRC-16/MCRF4XX
    values = {
        "time_boot_ms": 100, "q": (1.0, 0.0, 0.0, 0.0), "body_roll_rate": 0.5, "body_pitch_rate": -0.25, "thrust": 0.5,
        "target_system": 1, "target_component": 1, "type_mask": 128,
    }  # fmt: skip
    assert encode("SET_ATTITUDE_TARGET", values, sequence=5, system=1, component=191) == frame


def test_frames_come_out_of_noise_in_any_pieces() -> None:
    frames = [encode(layout.name, drawn(layout), sequence=i, system=1, component=1) for i, layout in enumerate(LAYOUTS)]
    stream = b"".join(bytes(RNG.choice(range(0xFC)) for _ in range(RNG.randrange(20))) + frame for frame in frames)
    whole, pieces = FrameReader(), FrameReader()
    expected = [layout.name for layout in LAYOUTS]
    assert [message.name for message in whole.feed(stream)] == expected
    cut = sorted(RNG.sample(range(len(stream)), 60))
    parts = [stream[a:b] for a, b in zip([0, *cut], [*cut, len(stream)], strict=True)]
    assert [message.name for part in parts for message in pieces.feed(part)] == expected
    assert whole.skipped == pieces.skipped == len(stream) - sum(map(len, frames))


def test_a_damaged_frame_is_not_read_and_takes_no_other_with_it() -> None:
    good = encode("HEARTBEAT", {"custom_mode": 20, "autopilot": 3}, sequence=0, system=1, component=1)
    for at in range(1, len(good)):
        damaged = bytearray(good)
        damaged[at] ^= 0x10
        told = list(FrameReader().feed(bytes(damaged) + good * 30))
        assert 29 - 23 <= len(told) <= 30  # a wrong length hides at most the bytes it names
        assert all(message.fields["custom_mode"] == 20 for message in told)


def test_frames_of_other_messages_signed_ones_and_those_of_version_1() -> None:
    beat = encode("HEARTBEAT", {"autopilot": 12}, sequence=0, system=1, component=1)
    other = bytes(mav.MAVLink_vfr_hud_message(1, 2, 3, 4, 5, 6).pack(mav.MAVLink(None, srcSystem=1)))
    signed = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    signed.signing.secret_key, signed.signing.sign_outgoing = bytes(32), True
    signature = bytes(mav.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(signed))
    reader = FrameReader()
    assert [m.name for m in reader.feed(other + beat + signature + beat)] == ["HEARTBEAT"] * 3
    assert reader.skipped == reader.old == 0
    old = mav.MAVLink(None, srcSystem=1)
    assert not list(reader.feed(bytes(mav.MAVLink_heartbeat_message(2, 12, 0, 0, 4, 3).pack(old, force_mavlink1=True))))
    assert reader.old >= 1

"""MSP frames: bytes of the real firmware, round trips, and streams full of everything else."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from e2efly.flight.betaflight.codec import ERROR, MAX_PAYLOAD, REPLY, REQUEST, Decoder, MspFrame, encode
from tests.flight.msp_golden import REPLIES, UNKNOWN

frames = st.one_of(
    st.builds(MspFrame, st.integers(0, 254), st.binary(max_size=600), st.sampled_from([REQUEST, REPLY, ERROR])),
    st.builds(
        MspFrame, st.integers(0, 65535), st.binary(max_size=600), st.sampled_from([REQUEST, REPLY, ERROR]),
        st.just(2), st.integers(0, 255),
    ),
)  # fmt: skip
calm = st.binary(max_size=40).map(lambda data: data.replace(b"$", b"#"))


@pytest.mark.parametrize("version", [1, 2])
def test_every_reply_of_the_real_firmware_is_one_frame_and_encodes_to_the_same_bytes(version: int) -> None:
    assert len(REPLIES[version]) > 20
    for code, data in REPLIES[version].items():
        decoder = Decoder()
        (frame,) = decoder.feed(data)
        assert (frame.code, frame.direction, frame.version) == (code, REPLY, version)
        assert encode(frame) == data
        assert (decoder.pending, decoder.skipped, decoder.bad_checksums) == (0, 0, 0)


def test_refusal_of_the_real_firmware() -> None:
    assert Decoder().feed(UNKNOWN) == [MspFrame(199, b"", ERROR)]


def test_published_example_of_version_2() -> None:
    # MSP2 command 100 without payload, flags 0: CRC 0x8f (inav wiki, "MSP V2")
    assert encode(MspFrame(100, version=2)) == bytes.fromhex("24583c00640000008f")


@given(frames)
def test_round_trip(frame: MspFrame) -> None:
    assert Decoder().feed(encode(frame)) == [frame]


@pytest.mark.parametrize("size", [0, 254, 255, 256, MAX_PAYLOAD])
def test_round_trip_at_the_edges_of_the_length(size: int) -> None:
    for version in (1, 2):
        frame = MspFrame(7, bytes(size), REPLY, version)
        assert Decoder().feed(encode(frame)) == [frame]
    assert Decoder().feed(encode(MspFrame(7, bytes(MAX_PAYLOAD + 1)))) == []


@given(st.lists(st.tuples(calm, frames), max_size=6), calm, st.integers(1, 50))
def test_frames_among_garbage_in_pieces_of_any_size(
    parts: list[tuple[bytes, MspFrame]], tail: bytes, step: int
) -> None:
    stream = b"".join(garbage + encode(frame) for garbage, frame in parts) + tail
    decoder, found = Decoder(), []
    for i in range(0, len(stream), step):
        found += decoder.feed(stream[i : i + step])
    assert found == [frame for _, frame in parts]
    assert decoder.skipped == sum(len(garbage) for garbage, _ in parts) + len(tail)


@given(st.binary(max_size=300), st.lists(st.sampled_from([b"$", b"$M", b"$M>", b"$X<", b"$M>\xff", b"\0"])), frames)
def test_any_bytes_then_silence_then_a_frame(garbage: bytes, starts: list[bytes], frame: MspFrame) -> None:
    decoder = Decoder()
    decoder.feed(garbage + b"".join(starts))
    decoder.flush()
    assert decoder.pending == 0
    assert decoder.feed(encode(frame)) == [frame]


def assert_found(damaged: bytes, good: list[MspFrame]) -> None:
    """Good frames are found after damaged bytes, or the checksum, which has but 8 bits, fits another frame there."""
    decoder, stream = Decoder(), damaged + b"".join(map(encode, good))
    found = decoder.feed(stream) + decoder.flush()
    if found[-len(good) :] != good:
        starts = [stream.find(encode(frame)) for frame in found]
        assert any(0 <= at < len(damaged) < at + len(encode(f)) for at, f in zip(starts, found, strict=True))


@settings(max_examples=300)
@given(frames, st.data(), st.lists(frames, min_size=1, max_size=3))
def test_a_flipped_bit_costs_that_frame_alone(broken: MspFrame, data: st.DataObject, good: list[MspFrame]) -> None:
    stream = bytearray(encode(broken))
    at = data.draw(st.integers(0, len(stream) - 1))
    stream[at] ^= 1 << data.draw(st.integers(0, 7))
    assert_found(bytes(stream), good)


@given(frames, st.data(), frames)
def test_half_a_frame_hides_nothing(broken: MspFrame, data: st.DataObject, good: MspFrame) -> None:
    stream = encode(broken)
    assert_found(stream[: data.draw(st.integers(0, len(stream) - 1))], [good])


def test_what_is_not_whole_delays_no_frame_that_is() -> None:
    """Of a reply only the first half has come, or its length is corrupt: the next one is not held up."""
    decoder, good = Decoder(), MspFrame(1, b"abc", REPLY)
    for half in (b"$M>\xff\x01" + (MAX_PAYLOAD).to_bytes(2, "little"), b"$M>", b"$X>\0\1\0\xff\0"):
        assert decoder.feed(half) == []
        data = encode(good)
        assert decoder.feed(data[:4]) == [] and decoder.feed(data[4:]) == [good]
        assert decoder.pending == 0
    assert decoder.bad_checksums == 0


def test_lengths_beyond_the_longest_payload_are_not_believed() -> None:
    good = MspFrame(1, b"abc", REPLY)
    assert Decoder().feed(b"$M>\xff\x01\xff\xff" + encode(good)) == [good]
    assert Decoder().feed(b"$X>\0\1\0\xff\xff" + encode(good)) == [good]


def test_bad_checksums_are_counted() -> None:
    decoder = Decoder()
    for version in (1, 2):
        data = bytearray(encode(MspFrame(1, b"abc", REPLY, version)))
        data[-1] ^= 1
        assert decoder.feed(bytes(data)) == []
    assert decoder.bad_checksums == 2


@pytest.mark.parametrize(
    ("frame", "word"),
    [
        (MspFrame(255), "code is 255"),
        (MspFrame(65536, version=2), "code is 65536"),
        (MspFrame(1, flags=1), "flags is 1"),
        (MspFrame(1, direction="?"), "direction is '[?]'"),
        (MspFrame(1, version=3), "version is 3"),
        (MspFrame(1, bytes(65536)), "65536 bytes"),
    ],
)
def test_what_a_frame_cannot_carry_is_refused_by_name(frame: MspFrame, word: str) -> None:
    with pytest.raises(ValueError, match=word):
        encode(frame)

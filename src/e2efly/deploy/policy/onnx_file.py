"""Checks of a policy's file before ONNX Runtime reads it: it must be complete, and its graph must terminate.

An ONNX file is a protocol buffer: a sequence of fields, each with a tag (its number and kind) and a value. The last
field of a policy's file is a metadata entry of fixed size, `sha256`. It holds the digest of all bytes before it,
including the contract. A changed bit anywhere is therefore found without parsing the rest. ONNX Runtime reads the entry
as ordinary metadata.
"""

from collections.abc import Iterator
from hashlib import sha256

_ENTRY = b"\x72\x4a\x0a\x06sha256\x12\x40"
"""Field 14 (metadata) of 74 bytes: field 1 (key) of 6 bytes, followed by field 2 (value) of 64 bytes."""
_SIZE = len(_ENTRY) + 64
_PARTS: dict[str, dict[int, str]] = {
    "model": {7: "graph"},
    "graph": {1: "node", 5: "tensor", 15: "sparse"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 10: "tensor", 22: "sparse", 23: "sparse"},
    "sparse": {1: "tensor", 2: "tensor"},
}
"""For each kind of message: the fields that are messages to be checked, and their kinds."""
_REFUSED: dict[tuple[str, int], str] = {
    ("model", 20): "information on training",
    ("model", 25): "functions of its own",
    ("attribute", 6): "a graph inside of a node, as If, Loop and Scan have: it may never end",
    ("attribute", 11): "graphs inside of a node",
    ("tensor", 13): "numbers in another file",
}
"""For each kind of message and field: content that no policy needs."""


def sealed(content: bytes) -> bytes:
    """An ONNX file with its digest appended."""
    return content + _ENTRY + sha256(content).hexdigest().encode()


def is_sealed(content: bytes) -> bool:
    """Whether the file ends with a digest, correct or not."""
    return content[-_SIZE:].startswith(_ENTRY)


def check_file(content: bytes) -> None:
    """Refuse a file that is damaged, or whose graph may never terminate or reads other files.

    Raises:
        ValueError: saying what is wrong and what is accepted.
    """
    if not is_sealed(content):
        raise ValueError(
            "no digest at its end: it is cut short, no policy.onnx, or of an older e2efly; accepted: a file as "
            "`e2efly export RUN` writes it, or an older one behind `e2efly export FILE`"
        )
    said, found = content[-64:], sha256(content[:-_SIZE]).hexdigest()
    if said != found.encode():
        raise ValueError(
            f"damaged: its SHA-256 is {found}, it says {said.decode('ascii', 'replace')!r}; copy it or export it again"
        )
    _look_into(memoryview(content), "model")


def _look_into(message: memoryview, kind: str) -> None:
    inside = _PARTS.get(kind, {})
    for number, value in _messages(message):
        if (kind, number) in _REFUSED:
            raise ValueError(f"has {_REFUSED[kind, number]}; accepted: a graph as `e2efly export` writes it")
        if number in inside:
            _look_into(value, inside[number])


def _messages(data: memoryview) -> Iterator[tuple[int, memoryview]]:
    """Number and value of the fields that have a length. All messages are such fields.

    Raises:
        ValueError: for data that is not a protocol buffer.
    """
    at = 0
    while at < len(data):
        tag, at = _whole_number(data, at)
        number, kind = tag >> 3, tag & 7
        if kind == 0:
            _, at = _whole_number(data, at)
        elif kind in (1, 5):
            at += 8 if kind == 1 else 4
        elif kind == 2:
            size, at = _whole_number(data, at)
            yield number, data[at : at + size]
            at += size
        else:
            raise ValueError(f"not an ONNX file: field {number} is of kind {kind}")
    if at != len(data):
        raise ValueError("not an ONNX file: its last field breaks off")


def _whole_number(data: memoryview, at: int) -> tuple[int, int]:
    """A number in groups of 7 bits, lowest first, and where the next begins."""
    value = 0
    for i, byte in enumerate(data[at : at + 10]):
        value |= (byte & 127) << 7 * i
        if byte < 128:
            return value, at + i + 1
    raise ValueError("not an ONNX file: a number breaks off")

"""ONNX files: the digest at their end, and the one reader and writer of what a network needs.

An ONNX file is a protocol buffer: a sequence of fields, each with a tag (its number and kind) and a value. `SCHEMA`
lists the fields that a network needs. `read` refuses every other field, and a second value of a field that has one.
ONNX Runtime is never given the file, but what `write` makes of what was read and checked. So it cannot read the bytes
in another way than the checks did.

The last field of a policy's file is a metadata entry of fixed size, `sha256`. It holds the digest of all bytes before
it, including the contract. A changed bit anywhere is therefore found without parsing the rest.
"""

import os
import stat
import struct
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any

LARGEST = 1 << 25
"""Largest size of a file, bytes. The largest policy of the zoo has half a million."""
FIELDS = 100_000
"""Largest number of fields and of numbers outside of the weights. A policy of the zoo has at most 521."""
NAME = 1000
"""Longest text beside the values of the metadata, bytes."""
METADATA = "metadata_props"
_ENTRY = b"\x72\x4a\x0a\x06sha256\x12\x40"
"""Field 14 (metadata) of 74 bytes: field 1 (key) of 6 bytes, followed by field 2 (value) of 64 bytes."""
_SIZE = len(_ENTRY) + 64
_INTEGER, _FLOAT, _TEXT, _BYTES, _REMARK = "integer", "float", "text", "bytes", "remark"

SCHEMA: dict[str, dict[int, tuple[str, str, str]]] = {
    "model": {
        1: ("ir_version", _INTEGER, ""), 2: ("producer_name", _TEXT, ""), 3: ("producer_version", _TEXT, ""),
        4: ("domain", _TEXT, ""), 5: ("model_version", _INTEGER, ""), 6: ("doc_string", _REMARK, ""),
        7: ("graph", "graph", ""), 8: ("opset_import", "operator set", "*"), 14: (METADATA, "entry", "*"),
    },
    "operator set": {1: ("domain", _TEXT, ""), 2: ("version", _INTEGER, "")},
    "entry": {1: ("key", _TEXT, ""), 2: ("value", _TEXT, "")},
    "graph": {
        1: ("node", "node", "*"), 2: ("name", _TEXT, ""), 5: ("initializer", "tensor", "*"),
        10: ("doc_string", _REMARK, ""), 11: ("input", "value", "*"), 12: ("output", "value", "*"),
        13: ("value_info", _REMARK, "*"), 16: (METADATA, _REMARK, "*"),
    },
    "node": {
        1: ("input", _TEXT, "*"), 2: ("output", _TEXT, "*"), 3: ("name", _TEXT, ""), 4: ("op_type", _TEXT, ""),
        5: ("attribute", "attribute", "*"), 6: ("doc_string", _REMARK, ""), 7: ("domain", _TEXT, ""),
        9: (METADATA, _REMARK, "*"),
    },
    "attribute": {
        1: ("name", _TEXT, ""), 2: ("f", _FLOAT, ""), 3: ("i", _INTEGER, ""), 4: ("s", _BYTES, ""),
        5: ("t", "tensor", ""), 7: ("floats", _FLOAT, "*"), 8: ("ints", _INTEGER, "*"),
        13: ("doc_string", _REMARK, ""), 20: ("type", _INTEGER, ""),
    },
    "tensor": {
        1: ("dims", _INTEGER, "*"), 2: ("data_type", _INTEGER, ""), 8: ("name", _TEXT, ""),
        9: ("raw_data", _BYTES, ""), 12: ("doc_string", _REMARK, ""), 16: (METADATA, _REMARK, "*"),
    },
    "value": {
        1: ("name", _TEXT, ""), 2: ("type", "type", ""), 3: ("doc_string", _REMARK, ""), 4: (METADATA, _REMARK, "*"),
    },
    "type": {1: ("tensor_type", "tensor type", ""), 6: ("denotation", _REMARK, "")},
    "tensor type": {1: ("elem_type", _INTEGER, ""), 2: ("shape", "shape", "")},
    "shape": {1: ("dim", "axis", "*")},
    "axis": {
        1: ("dim_value", _INTEGER, ""), 2: ("dim_param", _TEXT, ""), 3: ("denotation", _REMARK, ""),
    },
}  # fmt: skip
"""For each kind of message the fields that are read: name, kind, and * for one that may occur more than once. Remarks
are for people: they are passed over, and not written."""
NAMES = {
    ("model", 20): "information on training",
    ("model", 25): "functions of its own",
    ("graph", 15): "sparse numbers",
    ("attribute", 6): "a graph inside of a node, as If, Loop and Scan have: it may never end",
    ("attribute", 11): "graphs inside of a node",
    ("tensor", 4): "numbers outside of raw_data, where onnx.numpy_helper.from_array puts them",
    ("tensor", 5): "numbers outside of raw_data, where onnx.numpy_helper.from_array puts them",
    ("tensor", 7): "numbers outside of raw_data, where onnx.numpy_helper.from_array puts them",
    ("tensor", 13): "numbers in another file",
    ("tensor", 14): "numbers in another file",
}
"""Names of fields that are refused, for people. All fields that are not in `SCHEMA` are refused."""
Message = dict[str, Any]
"""A message: the values of its fields by name; of a field that may occur more than once, a list."""


def file_content(path: str | Path) -> bytes:
    """The bytes of a file of at most `LARGEST` bytes.

    Raises:
        ValueError: saying why it cannot be read, without its name.
    """
    try:
        whole = stat.S_ISREG(Path(path).stat().st_mode)  # opening a pipe would wait for its writer
        with Path(path if whole else os.devnull).open("rb") as file:
            content = file.read(LARGEST + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
        said = getattr(error, "strerror", None) or error
        raise ValueError(f"cannot be read: {said}") from None
    if not whole:
        raise ValueError("cannot be read: it is no file")
    if len(content) > LARGEST:
        raise ValueError(f"cannot be read: it has more than {LARGEST} bytes")
    return content


def sealed(content: bytes) -> bytes:
    """An ONNX file with its digest appended."""
    return content + _ENTRY + sha256(content).hexdigest().encode()


def is_sealed(content: bytes) -> bool:
    """Whether the file ends with a digest, correct or not."""
    return content[-_SIZE:].startswith(_ENTRY)


def check_seal(content: bytes) -> None:
    """Refuse a file that is damaged.

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


def read(content: bytes) -> Message:
    """The model of an ONNX file.

    Raises:
        ValueError: for what is no protocol buffer, has a field that is not in `SCHEMA`, a second value of a field that
            has one, or more than `FIELDS` fields.
    """
    return _Reader().message(memoryview(content), "model")


def write(model: Message) -> bytes:
    """The file of a model that `read` gave: its fields in the order of their numbers."""
    return _written(model, "model")


class _Reader:
    """Reads one file."""

    def __init__(self) -> None:
        self.left = FIELDS

    def message(self, data: memoryview, kind: str) -> Message:
        known, found = SCHEMA[kind], {}
        for number, wire, value in self.fields(data):
            if number not in known:
                named = NAMES.get((kind, number), f"field {number} in its {kind}")
                raise ValueError(f"has {named}; accepted: a graph of plain nodes and constants")
            name, of, many = known[number]
            if of == _REMARK:
                continue
            entries = self.values(name, of, wire, value)
            if many:
                found.setdefault(name, []).extend(entries)
            elif name in found or len(entries) != 1:
                raise ValueError(f"not an ONNX file: the field {name} of its {kind} has more than one value")
            else:
                found[name] = entries[0]
        return found

    def fields(self, data: memoryview) -> Iterator[tuple[int, int, Any]]:
        """Number, kind and value of each field: an integer, or bytes."""
        at = 0
        while at < len(data):
            self.count()
            tag, at = _varint(data, at)
            number, wire = tag >> 3, tag & 7
            size = {1: 8, 5: 4}.get(wire, 0)
            if wire == 0:
                value, at = _varint(data, at)
                yield number, wire, value
                continue
            if wire == 2:
                size, at = _varint(data, at)
            elif not size:
                raise ValueError(f"not an ONNX file: field {number} is of kind {wire}")
            if at + size > len(data):
                raise ValueError("not an ONNX file: its last field breaks off")
            yield number, wire, data[at : at + size]
            at += size

    def values(self, name: str, of: str, wire: int, value: Any) -> list[Any]:
        """The values in a field: one, or of a packed field of numbers all."""
        if of == _INTEGER and wire == 0:
            return [_signed(value)]
        if of == _INTEGER and wire == 2:
            integers, at = [], 0
            while at < len(value):
                self.count()
                integer, at = _varint(value, at)
                integers.append(_signed(integer))
            return integers
        if of == _FLOAT and (wire == 5 or (wire == 2 and len(value) % 4 == 0)):
            self.count(len(value) // 4)
            return list(struct.unpack(f"<{len(value) // 4}f", value))
        if wire != 2 or of in (_INTEGER, _FLOAT):
            raise ValueError(f"not an ONNX file: the field {name} is of another kind")
        if of == _BYTES:
            return [bytes(value)]
        if of == _TEXT and len(value) > NAME and name != "value":
            raise ValueError(f"has the field {name} of {len(value)} bytes; accepted: at most {NAME}")
        if of == _TEXT:
            try:
                return [str(value, "utf-8")]
            except UnicodeDecodeError as error:
                raise ValueError(f"not an ONNX file: the field {name} is no text: {error}") from None
        return [self.message(value, of)]

    def count(self, fields: int = 1) -> None:
        self.left -= fields
        if self.left < 0:
            raise ValueError(f"has more than {FIELDS} fields and numbers beside its weights; accepted: at most that")


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """A number of at most 64 bits in groups of 7, lowest first, and where the next begins."""
    value = 0
    for i, byte in enumerate(data[at : at + 10]):
        value |= (byte & 127) << 7 * i
        if byte < 128:
            if value >= 1 << 64:
                break
            return value, at + i + 1
    raise ValueError("not an ONNX file: a number breaks off or has more than 64 bits")


def _signed(value: int) -> int:
    return value - (1 << 64) if value >> 63 else value


def _written(message: Message, kind: str) -> bytes:
    parts = []
    for number, (name, of, many) in sorted(SCHEMA[kind].items()):
        if of != _REMARK:
            for value in message.get(name, ()) if many else [message[name]] if name in message else ():
                parts.append(_field(number, of, value))
    return b"".join(parts)


def _field(number: int, of: str, value: Any) -> bytes:
    if of == _INTEGER:
        return _number(number << 3) + _number(value % (1 << 64))
    if of == _FLOAT:
        return _number(number << 3 | 5) + struct.pack("<f", value)
    data = value if of == _BYTES else value.encode() if of == _TEXT else _written(value, of)
    return _number(number << 3 | 2) + _number(len(data)) + data


def _number(value: int) -> bytes:
    groups = []
    while value > 127:
        groups.append(value & 127 | 128)
        value >>= 7
    return bytes([*groups, value])

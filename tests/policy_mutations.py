"""Damaged policies for fuzzing: with something else in a field of graph or contract."""

import json
import random
from typing import Any

from e2efly.policy.contract import METADATA_KEY
from e2efly.policy.onnx_file import METADATA, SCHEMA, read, sealed, write
from e2efly.policy.onnx_graph import OPERATORS
from tests.mutations import mutated

INTEGERS = (0, 1, -1, 2, 3, 255, 65536, 2**31 - 1, 2**31, 2**40, 2**62, -(2**63), 2**63 - 1)
TEXTS = ("", "observation", "action", "memory", "table", "Loop", "ConstantOfShape", "Gemm", "x" * 5000, "\x1b[2J", "\n")
FLOATS = (0.0, -0.0, 1e-45, 3e38, float("inf"), float("nan"))
VALUES: tuple[Any, ...] = (
    None, True, -1, 0, 10**5000, 1e308, float("nan"), float("inf"), "", "\ud800", "\x00", [], {}, [[0.5] * 4] * 4,
)  # fmt: skip


def mutated_policy(content: bytes, rng: random.Random) -> bytes:
    """A policy's file with a change, and with the digest that belongs to it."""
    model = read(content)
    model[METADATA] = [entry for entry in model[METADATA] if entry["key"] != "sha256"]
    how = rng.randrange(6)
    if how == 0:
        plain = write(model)
        head = rng.randrange(len(plain)) if rng.random() < 0.5 else 3000  # half of them among the nodes
        return sealed(mutated(plain[:head], rng, (), (b"\x0a\x80\x80\x80\x80\x01", b"\xff" * 10)) + plain[head:])
    for _ in range(rng.randint(1, 3)):
        if how == 1:
            entry = next(entry for entry in model[METADATA] if entry["key"] == METADATA_KEY)
            entry["value"] = mutated_json(entry["value"], rng)
        elif how == 2:
            change(model, "model", rng)
        elif "graph" in model:
            kind = rng.choice(("node", "node", "node", "initializer", "input"))
            if parts := model["graph"].get(kind):
                change(rng.choice(parts), {"initializer": "tensor", "input": "value"}.get(kind, kind), rng)
    return sealed(write(model))


def change(message: dict[str, Any], kind: str, rng: random.Random) -> None:
    """Put something else into a field of a message of an ONNX file, or of a message inside of it."""
    name, of, many = rng.choice(list(SCHEMA[kind].values()))
    known = message.get(name, [] if many else None)
    if of in SCHEMA and known and rng.random() < 0.9:
        return change(rng.choice(known) if many else known, of, rng)
    value: Any = {
        "integer": rng.choice(INTEGERS), "float": rng.choice(FLOATS), "bytes": rng.randbytes(rng.choice((0, 4, 8))),
        "text": rng.choice((*TEXTS, *OPERATORS)), "remark": None,
    }.get(of, {})  # fmt: skip
    how = rng.randrange(5)
    if not many:
        message[name] = value
    elif how == 0 and known:
        known.append(rng.choice(known))
    elif how == 1 and known:
        del known[rng.randrange(len(known))]
    elif how == 2 and known:
        known[rng.randrange(len(known))] = value
    elif how == 3:
        rng.shuffle(known)
    else:
        message[name] = [*known, value]
    return None


def mutated_json(text: str, rng: random.Random) -> str:
    """JSON with another value in some place, or that is nested too deeply."""
    if rng.random() < 0.05:
        return "[" * 100_000
    try:
        content = json.loads(text)
    except (ValueError, RecursionError):
        return text
    inner: Any = content
    while isinstance(inner, dict | list) and inner:
        key = rng.choice(list(inner)) if isinstance(inner, dict) else rng.randrange(len(inner))
        if not isinstance(inner[key], dict | list) or not inner[key] or rng.random() < 0.2:
            inner[key] = rng.choice(VALUES)
            break
        inner = inner[key]
    try:
        return json.dumps(content, ensure_ascii=True)
    except ValueError:  # Python does not print integers with thousands of digits
        return text.replace("1", "1" * 5000, 1)

"""Poses as JSON, one object per message: the content of datagrams and lines."""

import contextlib
import json
import math
from typing import Any

import numpy as np

from e2efly.config.names import nearest
from e2efly.config.storage import unique
from e2efly.flight.lines import LONGEST
from e2efly.policy.odometry import Sample

ARRAYS = {"position": 3, "quaternion": 4, "velocity": 3, "body_rate": 3}
"""Number of elements of each array. The first two arrays are required."""
KEYS = (*ARRAYS, "stamp", "frame")
"""All keys of a message."""
LONGEST_GUESS = 20
"""Only so many characters of an unknown key are compared with the known keys, because the comparison is slow for long
keys."""


def parse_pose(message: bytes, received: float) -> Sample:
    """Read one message. It is a JSON object in UTF-8; see `docs/pose-sources.md`. `received` is the time of its
    arrival, s on the local monotonic clock.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    content = object_of("pose", message, KEYS)
    if missing := [key for key in ("position", "quaternion") if key not in content]:
        raise ValueError(f"pose: missing key {', '.join(map(repr, missing))}")
    arrays = {key: array_of("pose", key, content[key], size) for key, size in ARRAYS.items() if key in content}
    stamp, frame = header_of("pose", content)
    return Sample(received=received, stamp=stamp, frame=frame, **arrays)


def object_of(what: str, message: bytes, keys: tuple[str, ...]) -> dict[str, Any]:
    """Parse the JSON object in a message in UTF-8, which may have the known `keys`. `what` is the name of the message
    for error messages.

    Raises:
        ValueError: if it is not such an object. The message names the key if there is one.
    """
    if len(message) > LONGEST:
        raise ValueError(f"{what}: {len(message)} bytes; accepted: at most {LONGEST}")
    try:
        content = json.loads(message.decode(), object_pairs_hook=unique, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{what}: not JSON: {error}") from None
    if not isinstance(content, dict):
        raise ValueError(f"{what}: {short(content)}; accepted: an object with {', '.join(keys)}")
    for key in content:
        if key not in keys:
            guess = nearest(key[:LONGEST_GUESS], keys)
            hint = f"; did you mean {guess!r}?" if guess else ""
            raise ValueError(f"{what}: unknown key {short(key)}{hint} (accepted: {', '.join(keys)})")
    return content


def header_of(what: str, content: dict[str, Any]) -> tuple[float | None, str]:
    """The stamp of a message, s, or None if there is none, and its frame, or an empty text if there is none.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    stamp = number_of(what, "stamp", content["stamp"], "a finite number of seconds") if "stamp" in content else None
    frame = content.get("frame", "")
    if not isinstance(frame, str):
        raise ValueError(f"{what}: frame is {short(frame)}; accepted: a text")
    return stamp, frame


def array_of(what: str, key: str, value: Any, size: int) -> np.ndarray:
    """A list of finite numbers, (size,).

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    accepted = f"a list of {size} finite numbers"
    if not isinstance(value, list) or len(value) != size:
        raise ValueError(f"{what}: {key} is {short(value)}; accepted: {accepted}")
    return np.array([number_of(what, key, entry, accepted) for entry in value])


def number_of(what: str, key: str, value: Any, accepted: str = "a finite number") -> float:
    """A finite number.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    if type(value) in (int, float):  # not bool, which is an int in Python
        with contextlib.suppress(OverflowError):
            number = float(value)
            if math.isfinite(number):
                return number
    raise ValueError(f"{what}: {key} is {short(value)}; accepted: {accepted}")


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number; accepted: finite numbers")


def short(value: Any) -> str:
    """A value of a message, shortened to a few characters."""
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."

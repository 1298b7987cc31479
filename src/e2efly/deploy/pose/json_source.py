"""Poses as JSON, one object per message: what datagrams and lines hold."""

import contextlib
import json
import math
from typing import Any

import numpy as np

from e2efly.deploy.lines import LONGEST
from e2efly.deploy.odometry import Sample
from e2efly.storage import unique
from e2efly.vehicles.names import nearest

ARRAYS = {"position": 3, "quaternion": 4, "velocity": 3, "body_rate": 3}
"""Numbers of each array; the first two must be there."""
KEYS = (*ARRAYS, "stamp", "frame")
"""All keys of a message."""
LONGEST_GUESS = 20
"""Characters of an unknown key for which a known one is looked for: the comparison takes long for long ones."""


def parse_pose(message: bytes, received: float) -> Sample:
    """Read one message.

    Args:
        message: a JSON object in UTF-8; see `docs/pose-sources.md`.
        received: when it arrived, s on the local monotonic clock.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    if len(message) > LONGEST:
        raise ValueError(f"pose: {len(message)} bytes; accepted: at most {LONGEST}")
    try:
        content = json.loads(message.decode(), object_pairs_hook=unique, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"pose: not JSON: {error}") from None
    if not isinstance(content, dict):
        raise ValueError(f"pose: {_short(content)}; accepted: an object with {', '.join(KEYS)}")
    for key in content:
        if key not in KEYS:
            guess = nearest(key[:LONGEST_GUESS], KEYS)
            hint = f"; did you mean {guess!r}?" if guess else ""
            raise ValueError(f"pose: unknown key {_short(key)}{hint} (accepted: {', '.join(KEYS)})")
    if missing := [key for key in ("position", "quaternion") if key not in content]:
        raise ValueError(f"pose: missing key {', '.join(map(repr, missing))}")
    arrays = {key: _array(key, content[key], size) for key, size in ARRAYS.items() if key in content}
    stamp = _number("stamp", content["stamp"], "a finite number of seconds") if "stamp" in content else None
    frame = content.get("frame", "")
    if not isinstance(frame, str):
        raise ValueError(f"pose: frame is {_short(frame)}; accepted: a text")
    return Sample(received=received, stamp=stamp, frame=frame, **arrays)


def _array(key: str, value: Any, size: int) -> np.ndarray:
    accepted = f"a list of {size} finite numbers"
    if not isinstance(value, list) or len(value) != size:
        raise ValueError(f"pose: {key} is {_short(value)}; accepted: {accepted}")
    return np.array([_number(key, entry, accepted) for entry in value])


def _number(key: str, value: Any, accepted: str) -> float:
    if type(value) in (int, float):  # not bool, which is an int to Python
        with contextlib.suppress(OverflowError):
            number = float(value)
            if math.isfinite(number):
                return number
    raise ValueError(f"pose: {key} is {_short(value)}; accepted: {accepted}")


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number; accepted: finite numbers")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."

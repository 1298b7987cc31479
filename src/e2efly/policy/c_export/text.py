"""Strings, numbers and arrays in C syntax."""

import re
import textwrap
from collections.abc import Iterable

import numpy as np

WIDTH = 110
"""Line length of the files, characters."""


def number(value: float) -> str:
    """A float literal that has exactly this value."""
    text = f"{np.float32(value):.9g}"
    return f"{text}{'' if set(text) & set('.en') else '.0'}f"


def string(text: str) -> str:
    """A string literal. Its UTF-8 bytes are written in printable ASCII."""
    plain = "".join(chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in text.encode())
    return f'"{plain}"'


def comment(text: str, indent: str = "") -> str:
    """A comment, with as many lines as it needs."""
    plain = " ".join(re.sub(r"[*]/|/[*]|\\|[?]{2,}", " ", text).split())
    first = textwrap.wrap(plain, WIDTH - 6 - len(indent), break_long_words=False) or [""]
    return f"{indent}/* " + f"\n{indent} * ".join(first) + " */"


def array(kind: str, name: str, entries: Iterable[str]) -> str:
    """The definition of an array, from its numbers as text. An empty array gets one 0: C has no empty arrays."""
    written = list(entries) or ["0"]
    body = textwrap.fill(", ".join(written), WIDTH, initial_indent="    ", subsequent_indent="    ")
    return f"{kind} {name}[{len(written)}] = {{\n{body}\n}};"

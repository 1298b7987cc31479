"""Receives the images that `e2efly hil` serves over TCP on another computer, and tells their times by the own clock."""

from __future__ import annotations

import importlib
import select
import socket
import time
from typing import Any

CONNECT_S = 5.0
"""Longest time to connect, s."""
FIRST, OFTEN_S, SELDOM_S = 8, 0.02, 1.0
"""So many pings go out so often, s, and the others so seldom."""


def capture(output: Any, where: str) -> None:
    """Receive from HOST:PORT.

    Raises:
        RuntimeError: when nobody serves there, or the stream ends.
        ValueError: when it is no such stream.
    """
    stream, shared = importlib.import_module("image_stream"), importlib.import_module("shared_images")
    host, _, port = where.rpartition(":")
    try:
        connection = socket.create_connection((host, int(port)), CONNECT_S)
    except OSError as error:
        raise RuntimeError(f"{where}: {error.strerror or error}; accepted: where e2efly hil serves tcp") from None
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    clocks, layout, got = stream.Clocks(), None, bytearray()
    pings, due = 0, time.monotonic()
    while not output.speech.closing.is_set():
        now = time.monotonic()
        if now >= due:
            connection.sendall(clocks.ping(now))
            pings += 1
            due = now + (OFTEN_S if pings < FIRST else SELDOM_S)
        if not select.select([connection], [], [], max(min(due - now, 0.1), 0.0))[0]:
            continue
        data = connection.recv(1 << 16)
        now = time.monotonic()
        if not data:
            raise RuntimeError(f"{where} has ended the stream")
        got += data
        if layout is None:
            if len(got) < shared.HEADER.size:
                continue
            begin = bytes(got[: len(stream.MAGIC)])
            if begin != stream.MAGIC:
                raise ValueError(f"{where} begins with {begin!r}; accepted: {stream.MAGIC!r}")
            layout = shared.Layout.of(shared.MAGIC + bytes(got[len(begin) : shared.HEADER.size]), where)
            del got[: shared.HEADER.size]
        while len(got) >= stream.MESSAGE.size:
            kind, length, number, moment = stream.MESSAGE.unpack_from(got)
            if kind not in (stream.IMAGE, stream.ANSWER) or length > 2 * layout.bytes + 1024:
                raise ValueError(f"{where} sends a message of kind {kind} with {length} bytes")
            if len(got) < stream.MESSAGE.size + length:
                break
            content = bytes(got[stream.MESSAGE.size : stream.MESSAGE.size + length])
            del got[: stream.MESSAGE.size + length]
            if kind == stream.ANSWER:
                clocks.answered(number, moment, now)
            elif clocks.best is not None and pings >= FIRST:
                values, best = stream.unpacked(content, layout.bytes), clocks.best
                detail = f"clocks agree within {1e3 * best.doubt:.2f} ms"
                output.put(moment - best.ahead, values, layout.shape, layout.type, layout.fov, detail)

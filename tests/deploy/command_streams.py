"""Commanders in tests: commands as bytes, through the real parser, or over a real socket in a rig's time."""

import dataclasses
import json
import socket
from types import TracebackType
from typing import Any

from e2efly.deploy.commander.command import Command
from e2efly.deploy.commander.sources import open_commands


def encode(**content: Any) -> bytes:
    return json.dumps(content).encode()


class Loopback:
    """A real UDP source and its sender; what has arrived counts as arrived at the time of the next `read`."""

    def __init__(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.source = open_commands(f"udp:{self.port}")
        self.sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def __enter__(self) -> "Loopback":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def send(self, message: bytes) -> None:
        self.sender.sendto(message, ("127.0.0.1", self.port))

    @property
    def refused(self) -> int:
        return self.source.refused

    @property
    def problem(self) -> str | None:
        return self.source.problem

    def read(self, now: float) -> list[Command]:
        return [dataclasses.replace(command, received=now) for command in self.source.read(now)]

    def close(self) -> None:
        self.sender.close()
        self.source.close()

    def describe(self) -> str:
        return self.source.describe()

"""Poses from the gates that a camera sees."""

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np

from e2efly.flight.child import Child, text_of
from e2efly.flight.pose.gates.gate_setup import load_setup
from e2efly.flight.pose.gates.gate_source import GateSource
from e2efly.flight.pose.gates.lens import Corners
from e2efly.flight.pose.registry import MalformedError, register

LONGEST = 400
"""Largest number of corners of an image."""


@register("gates", "gates:EYE.toml@IMAGE_URI, with IMAGE_URI a source of the mask of the gates")
def open_gates(where: str) -> GateSource:
    """Start the process that sees, for a vehicle that stands on the ground.

    Raises:
        MalformedError: for a text without a file or an image source.
        ValueError: naming the file, the key and what is accepted, or with what the process reports.
    """
    file, _, uri = where.partition("@")
    if not file or not uri:
        raise MalformedError(where)
    setup = load_setup(Path(file))
    return GateSource(setup, CornerRelay(json.dumps(dataclasses.asdict(setup.image)), uri), f"gates:{file}")


class CornerRelay:
    """The corners that another process finds in the images of a camera."""

    def __init__(self, about: str, uri: str) -> None:
        """Start the process. `about` is the camera's image as a contract's JSON, `uri` its source.

        Raises:
            ValueError: with what the process reports about its failure.
        """
        self.problem: str | None = None
        try:
            self._child = Child(sys.executable, "gate_relay.py", about, uri)
        except ValueError as error:
            raise ValueError(f"pose source gates: {error}") from None

    def read(self, now: float) -> list[tuple[float, Corners]]:
        """What has come since the last call: time of exposure, s, and corners."""
        found = []
        self.problem = self._child.ended or self.problem
        for line in self._child.lines():
            kind, _, rest = line.partition(b" ")
            if kind == b"message":
                found.append(parse_corners(rest.partition(b" ")[2]))
            else:
                self.problem = None if kind == b"solved" else text_of(rest)
        return found

    def close(self) -> None:
        """End the process. This takes up to 2 s."""
        self._child.close()

    def describe(self) -> str:
        """The image source, as the process describes it."""
        return self._child.detail


def parse_corners(message: bytes) -> tuple[float, Corners]:
    """The time of exposure, s, and the corners of a message of `gate_relay.py`, which is our own."""
    content = json.loads(message)
    pixel, inward = (np.array(content[name], float).reshape(-1, 2) for name in ("pixel", "inward"))
    return float(content["stamp"]), Corners(pixel[:LONGEST], inward[:LONGEST])

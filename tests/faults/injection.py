"""What a fault of a campaign is: what it alters while it lasts, its parameters by chance, and who can help."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from e2efly.flight.sight.image_source import Frame
from e2efly.policy.odometry import Sample
from e2efly.validation.sitl import FirmwareState
from e2efly.vehicles.vehicle import Vehicle

Parameters = dict[str, Any]


class Rule(StrEnum):
    """What a flight is held to; each member is what is said of one that breaks it."""

    OFF = "motors off"
    """High over the ground."""
    CLIMB = "climb"
    """Far above where the faults found it."""
    TOUCH = "touch"
    """Fast, from low."""
    ARMED = "armed on the ground"
    """With open throttle."""
    ENDLESS = "does not end"
    """Landed or not, it goes on for as long as it was watched."""


class Flier(StrEnum):
    """Who flies in mode POLICY."""

    POLICY = "policy"
    """One that hovers by poses."""
    SIGHT = "sight"
    """One that sees."""
    COMMANDS = "commands"
    """Another program."""
    FILTER = "filter"
    """The policy that hovers, behind the filter, at a target beyond the fence."""


@dataclass(frozen=True)
class Excuse:
    """Which rules nothing on the companion computer can keep while a fault lasts."""

    why: str
    rules: tuple[Rule, ...] = tuple(Rule)
    for_good: bool = False
    """After the fault is over, too."""
    after: float = 0.0
    """From so long after the fault's beginning on, s."""
    unless_grounded: bool = False
    """Not where it was there before the take-off, which could have been refused."""


def _nothing() -> None:
    """What an injection does that is done by its alterations alone."""


@dataclass(frozen=True)
class Injection:
    """One fault at work. What it alters goes through those that began before it first."""

    pose: Callable[[Sample], Sample | None] | None = None
    """A sample of the pose source, or none."""
    reply: tuple[int, Callable[[bytes], bytes]] | None = None
    """A message's code, and what becomes of the payloads in which the controller reports it."""
    frame: Callable[[Frame], Frame | None] | None = None
    """A camera's image, or none."""
    felt: Callable[[FirmwareState], FirmwareState] | None = None
    """What the controller's own sensors feel."""
    each: Callable[[], None] = _nothing
    """Done before each control step."""
    end: Callable[[], None] = _nothing
    """Done when it is over."""


@dataclass(frozen=True)
class Kind:
    begin: Callable[..., Injection]
    """(stage, **parameters) -> what is at work from now on."""
    draw: Callable[[np.random.Generator], Parameters] = lambda random: {}
    """Parameters by chance."""
    excuse: Excuse | None = None
    """What nothing on the companion computer can help; None: the bridge is to cope with it."""
    limited: tuple[float, float] | None = None
    """Shortest and longest time that it lasts, s; None: it stays."""
    flier: Flier = Flier.POLICY
    """Who has to fly for it to matter. A kind of the policy that hovers strikes every flier."""
    watched: bool = False
    """Whether the bridge needs its watchdog for it."""
    logged: bool = False
    """Whether the bridge needs a flight log for it."""
    body: Callable[..., Vehicle] | None = None
    """(vehicle of the bridge's file, **parameters) -> the vehicle that flies. None: that of the file."""


def uniform(digits: int = 3, **bounds: tuple[float, float]) -> Callable[[np.random.Generator], Parameters]:
    """Parameters, each anywhere between two bounds."""
    return lambda random: {name: round(float(random.uniform(*ends)), digits) for name, ends in bounds.items()}


def held(part: str, name: str, usual: float | bool) -> Callable[..., Injection]:
    """An attribute of a part of the stage, which has another value for a while: the one that is drawn, or not this."""

    def begin(stage: Any, **drawn: float) -> Injection:
        of = getattr(stage, part)
        (value,) = drawn.values() or (not usual,)
        setattr(of, name, value)
        return Injection(end=lambda: setattr(of, name, usual))

    return begin


def one_of(name: str, *values: Any) -> Callable[[np.random.Generator], Parameters]:
    """One parameter, one of some values."""
    return lambda random: {name: values[int(random.integers(len(values)))]}


def vector(random: np.random.Generator, length: float, digits: int = 3) -> list[float]:
    """A length in any direction."""
    way = random.normal(size=3)
    return [round(float(x), digits) for x in length * way / np.linalg.norm(way)]

"""The filter as the bridge uses it, with the command and odometry types of the rest of `flight`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.control import Ctbr, Vec3
from e2efly.flight.filter.filter import Filter, FilterMemory, feel, filtered, remember, watch
from e2efly.flight.filter.forecast import ForecastCommand
from e2efly.flight.pose.neighbours import OtherVehicle
from e2efly.policy.odometry import Odometry


@dataclass(frozen=True)
class CommandChange:
    """How the filter changed a command."""

    limit: str
    """The limit that would not have been kept: a name of `room.NAMES`, or of a solid."""
    room: float
    """The room to that limit that the backup manoeuvre would have left after the wanted command, m. Negative: beyond
    it."""
    share: float
    """How far it was changed towards the manoeuvre's command, 0 to 1."""
    wanted: Ctbr
    """The command as it came from the policy."""


class FilterError(Exception):
    """The filter has no command, because a number is not finite."""


def keep(
    filter: Filter, memory: FilterMemory, odometry: Odometry, now: float, wanted: Ctbr, *,
    floor: bool = True, others: Sequence[OtherVehicle] = (),
) -> tuple[Ctbr, CommandChange | None]:  # fmt: skip
    """The command to send, and how it was changed. It is the wanted command itself if that keeps all limits. `memory`
    is that after `watch`. `now` is in s. `floor` tells whether the lowest height of the fence counts. `others`: the
    other vehicles now.

    Raises:
        FilterError: if a number is not finite.
    """
    told = _told(wanted)
    try:
        found = filtered(filter, memory, odometry, now, told, floor=floor, others=others)
    except (ValueError, ArithmeticError) as error:
        raise FilterError(f"filter: {error}") from error
    if not all(map(math.isfinite, (*found.command, found.room))):
        raise FilterError(f"filter: its command is {tuple(found.command)}; accepted: finite numbers")
    if found.share == 0.0:
        return wanted, None
    thrust, x, y, z = found.command
    return Ctbr(thrust, Vec3(x, y, z)), CommandChange(found.name, found.room, found.share, wanted)


def _told(command: Ctbr) -> ForecastCommand:
    return ForecastCommand(*(float(x) for x in (command.thrust, command.rate.x, command.rate.y, command.rate.z)))


class Keeper:
    """The filter in flight: its memory, its last change, and why it has failed."""

    def __init__(self, filter: Filter) -> None:
        """Filter for a vehicle in a fence."""
        self.filter, self.memory = filter, FilterMemory()
        self.change: CommandChange | None = None
        """How the newest command was changed. None: not at all."""
        self.problem: str | None = None
        """Why it cannot filter. No policy flies then until the vehicle is on the ground. None: it can."""

    def see(self, odometry: Odometry | None, now: float, *, flying: bool) -> None:
        """Process the newest odometry. `flying`: only the air carries the vehicle."""
        self.change = None
        if odometry is not None:
            self.memory = watch(self.filter, self.memory, odometry, now, flying=flying)

    def feel(self, rate: np.ndarray, asked: float) -> None:
        """Process a reading of the flight controller's gyro, (3,) rad/s, that was requested at `asked` s."""
        x, y, z = rate.tolist()
        if all(map(math.isfinite, (x, y, z))):
            self.memory = feel(self.memory, (x, y, z), asked)

    def keep(
        self, odometry: Odometry, now: float, wanted: Ctbr, *, floor: bool, others: Sequence[OtherVehicle] = ()
    ) -> Ctbr | None:
        """The command in place of a policy's command, with the arguments of the function `keep`. None: it failed, and
        `problem` says why.
        """
        try:
            command, self.change = keep(self.filter, self.memory, odometry, now, wanted, floor=floor, others=others)
        except FilterError as error:
            self.problem = str(error)
            return None
        return command

    def sent(self, command: Ctbr | None, now: float) -> None:
        """Remember the command that was sent. None: the throttle was closed."""
        told = ForecastCommand(0.0, 0.0, 0.0, 0.0) if command is None else _told(command)
        self.memory = remember(self.memory, told, now)

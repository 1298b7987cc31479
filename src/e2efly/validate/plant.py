"""What flies: one small interface over every physics, and the delay of commands that all of them share.

Imports no JAX and no simulator: a plant brings its own.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from e2efly.deploy.contract import COMMANDS, Contract
from e2efly.deploy.odometry import Odometry
from e2efly.vehicles import Vehicle, unknown

MOMENT = 1e-9
"""Seconds below which two times are one: rounding of sums of periods."""


@dataclass(frozen=True)
class RigidState:
    """Where a vehicle is and how it moves; float64. World ENU, body FLU."""

    position: np.ndarray
    """(3,) centre of mass, world, m."""
    velocity: np.ndarray
    """(3,) world, m/s."""
    quaternion: np.ndarray
    """(4,) unit, wxyz, body to world."""
    body_rate: np.ndarray
    """(3,) about body x, y, z, rad/s."""

    @staticmethod
    def of(state: object) -> "RigidState":
        """The same fields of anything that has them, as float64 copies.

        Raises:
            ValueError: naming the field, for a wrong shape, a number that is not finite or a quaternion that is not
                unit.
        """
        fields = {name: np.array(getattr(state, name), np.float64) for name in _SHAPES}
        for name, shape in _SHAPES.items():
            if fields[name].shape != shape or not np.isfinite(fields[name]).all():
                raise ValueError(f"{name} is {fields[name].tolist()}; accepted: {shape[0]} finite numbers")
        if abs(np.linalg.norm(fields["quaternion"]) - 1) > 1e-3:
            raise ValueError(f"quaternion is {fields['quaternion'].tolist()}; accepted: a unit quaternion wxyz")
        return RigidState(**fields)

    def odometry(self, time: float) -> Odometry:
        """What a perfect pose source says of it at `time`, s."""
        return Odometry(time, self.position, self.velocity, self.quaternion, self.body_rate)


_SHAPES = {"position": (3,), "velocity": (3,), "quaternion": (4,), "body_rate": (3,)}


class Plant(Protocol):
    """A vehicle with its flight controller, in some physics. Commands act at once: latency is the `Delay`'s."""

    @property
    def name(self) -> str:
        """What tables call it."""
        ...

    @property
    def state(self) -> RigidState:
        """The vehicle now."""
        ...

    def reset(self, state: RigidState) -> None:
        """Put the vehicle there, the rotors at hover speed."""
        ...

    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s.

        Args:
            command: (4,) in the units of the command mode that the plant was made for (`COMMANDS`); for `ctbr`
                collective thrust over mass, m/s^2, and body rates, rad/s.
            dt: seconds, above zero.
        """
        ...

    def close(self) -> None:
        """Let go of what it holds (processes, sockets); it is not used again."""
        ...


@dataclass(frozen=True)
class PlantKind:
    """How to get a plant."""

    make: Callable[[Vehicle, Contract], Plant]
    """(vehicle to simulate, contract of the policy that will fly it) -> plant. Raises ValueError for what it cannot."""
    parallel: bool = True
    """Whether several may run at once, each in a process of its own."""
    latency: float = 0.0
    """Seconds that the plant itself takes from command to rate loop; the `Delay` adds only the rest."""


def _simulator(vehicle: Vehicle, contract: Contract) -> Plant:
    from e2efly.validate.simulator import SimulatorPlant

    return SimulatorPlant(vehicle, contract.action.mode, contract.control_rate_hz)


def _mujoco(vehicle: Vehicle, contract: Contract) -> Plant:
    try:
        from e2efly.validate.mujoco_plant import MujocoPlant
    except ModuleNotFoundError as error:
        raise ValueError(f"plant 'mujoco' needs the package {error.name}: pip install 'e2efly[mujoco]'") from None

    return MujocoPlant(vehicle, contract.action.mode)


def _betaflight(vehicle: Vehicle, contract: Contract) -> Plant:
    from e2efly.validate import betaflight_plant

    return betaflight_plant.make(vehicle, contract)


PLANTS: dict[str, PlantKind] = {
    "simulator": PlantKind(_simulator),
    "mujoco": PlantKind(_mujoco),
    "betaflight": PlantKind(_betaflight, parallel=False, latency=0.004),
}
"""Plants by name; to add one is to add a line."""


def plant_kind(name: str) -> PlantKind:
    """A kind of plant by name.

    Raises:
        ValueError: for an unknown name, with all there are.
    """
    if name not in PLANTS:
        raise ValueError(unknown("plant", name, PLANTS))
    return PLANTS[name]


@dataclass(frozen=True)
class Delay:
    """Commands under way: each acts a latency after it was sent, until the next one does."""

    latency: float
    """Seconds from sending to acting."""
    acting: np.ndarray
    """(4,) what acts now."""
    coming: tuple[tuple[float, np.ndarray], ...] = ()
    """When each command on its way will act, s, in order, and the command."""

    @staticmethod
    def of(latency: float, acting: np.ndarray) -> "Delay":
        """Nothing under way.

        Raises:
            ValueError: for a latency that is negative or not finite.
        """
        if not (math.isfinite(latency) and latency >= 0):
            raise ValueError(f"latency is {latency}; accepted: a finite number of seconds, 0 or more")
        return Delay(latency, acting)

    def send(self, command: np.ndarray, now: float) -> "Delay":
        """Send a command, (4,), at `now`, s."""
        return replace(self, coming=(*self.coming, (now + self.latency, command)))

    def until(self, now: float, end: float) -> tuple["Delay", list[tuple[np.ndarray, float]]]:
        """Let time pass from `now` to `end`, s.

        Returns:
            The delay then, and what acts meanwhile: commands with the seconds for which each is held.
        """
        acting, coming, parts = self.acting, self.coming, []
        while coming and coming[0][0] < end - MOMENT:
            due, command = coming[0]
            if due > now + MOMENT:
                parts.append((acting, due - now))
                now = due
            acting, coming = command, coming[1:]
        parts.append((acting, end - now))
        return replace(self, acting=acting, coming=coming), parts


def check_mode(mode: str, plant: str) -> None:
    """Refuse an unknown command mode.

    Raises:
        ValueError: naming the plant, the mode and all there are.
    """
    if mode not in COMMANDS:
        raise ValueError(f"plant {plant!r}: " + unknown("command mode", mode, COMMANDS))

"""The plant: one small interface to every physics, and the delay of commands that all of them share.

Imports no JAX and no simulator: a plant imports its own simulator when it is made.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from e2efly.config.names import unknown
from e2efly.control import COMMAND_MODES, Quat, Vec3
from e2efly.policy.contract import Contract
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.vehicle import Vehicle, quantities, terms

BESIDE = frozenset({"wind", "rotor_share", "plain_mixer"})
"""Disturbances that a flight may have in addition to another body."""
EVERYTHING = BESIDE | {f.name for f in (*quantities(), *terms())}
"""Everything that can be changed without the knowledge of the flight controller."""
MOMENT = 1e-9
"""Two times that differ by less than this are equal, s. The difference is rounding in sums of periods."""


@dataclass(frozen=True)
class RigidState:
    """The pose and motion of a vehicle, float64. World ENU, body FLU."""

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
        """The same fields of any object that has them, as float64 copies.

        Raises:
            ValueError: naming the field, for a wrong shape, a number that is not finite, or a quaternion that is not
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
        """The odometry that a perfect pose source gives for this state at `time`, s."""
        return Odometry(time, self.position, self.velocity, self.quaternion, self.body_rate)


@dataclass(frozen=True)
class PlantMotion:
    """What the controllers know of the vehicle's motion."""

    position: Vec3
    velocity: Vec3
    attitude: Quat


_SHAPES = {"position": (3,), "velocity": (3,), "quaternion": (4,), "body_rate": (3,)}


@dataclass(frozen=True)
class Shutter:
    """The times at which a camera of a plant exposes.

    Image n = 0, 1, ... is shown from time n times `every`. It is exposed `latency` before that, or at the start if that
    would be earlier.
    """

    every: float
    """Time from one image to the next, s."""
    latency: float
    """Age of an image when it is first shown, s."""

    def exposed(self, n: int) -> float:
        """Exposure time of image `n`, s since the start."""
        return max(n * self.every - self.latency, 0.0)

    def newest(self, now: float) -> int:
        """Number of the image that is shown at `now`, s since the start."""
        return math.floor(now / self.every + 1e-6)


class Plant(ABC):
    """A vehicle with its flight controller, in some physics. Commands act at once: `Delay` adds the latency.

    A plant extends this class, is made by `Plant(vehicle, command_mode)`, and registers itself by `register`. Its
    flight controller is tuned to the vehicle with which the plant is made. `meet` gives it another body.
    """

    name: ClassVar[str] = ""
    """The name under which it is registered, and which tables show."""
    needs: ClassVar[Mapping[str, str]] = {}
    """Packages that it imports, and the argument of `pip install` for each."""
    parallel: ClassVar[bool] = True
    """Whether several plants may run at once, each in a process of its own."""
    latency: ClassVar[float] = 0.0
    """Time that the plant itself takes from command to rate loop, s. The `Delay` adds only the rest of the latency."""
    episodes: ClassVar[int] = 200
    """Default number of starts per criterion in `validate`."""
    whole_flights: ClassVar[bool] = False
    """Whether `e2efly validate` also flies whole flights, from take-off to landing, through the real firmware."""
    takes_address: ClassVar[bool] = False
    """Whether another program simulates it, which `validate` finds by NAME:ADDRESS."""
    alters: ClassVar[frozenset[str]] = frozenset()
    """What `meet` and `disturb` can change without the flight controller's knowledge: fields of the vehicle, and names
    of `BESIDE`."""

    @classmethod
    def of(cls, vehicle: Vehicle, contract: Contract) -> Self:
        """Make the plant for a vehicle, and for the policy of a contract.

        Raises:
            ValueError: for anything that it cannot simulate.
            OSError: when it cannot be started.
        """
        return cls(vehicle, contract.action.mode)  # type: ignore[call-arg]

    @classmethod
    def company(cls, vehicle: Vehicle, contract: Contract, count: int) -> Sequence[Self]:
        """The plants of the vehicles of a world. Unless a plant does it otherwise, each is in a physics of its own: it
        flies through the others.

        Raises:
            ValueError: for anything that it cannot simulate.
            OSError: when it cannot be started.
        """
        return [cls.of(vehicle, contract) for _ in range(count)]

    @classmethod
    def at(cls, address: str) -> type[Self]:
        """The plant that another program simulates at an address.

        Raises:
            ValueError: for an address that it does not accept.
        """
        raise ValueError(f"--plant is {cls.name}:{address}; accepted: {cls.name}, which takes no address")

    @classmethod
    def seeing(cls, cameras: Mapping[str, str]) -> type[Self]:
        """The plant whose own cameras provide images for a policy. It then has `expose` and `shown`.

        Args:
            cameras: by an image of the contract, the text after `--image IMAGE=plant:`.

        Raises:
            ValueError: for a plant without cameras.
        """
        name, where = next(iter(cameras.items()))
        raise ValueError(
            f"--image {name} is 'plant:{where}'; accepted on plant {cls.name!r}, which has no cameras of its own: no "
            "--image, as the task's world is rendered there"
        )

    @classmethod
    def differences(cls, vehicle: Vehicle, contract: Contract) -> list[str]:
        """Differences between the plant's vehicle and this vehicle, one sentence each. It is called before the flights.

        Raises:
            ValueError: for anything that it cannot simulate.
            OSError: when it cannot be started.
        """
        return []

    @property
    @abstractmethod
    def state(self) -> RigidState:
        """The state of the vehicle now."""

    @abstractmethod
    def reset(self, state: RigidState) -> None:
        """Put the vehicle into a state, with the rotors at hover speed."""

    @abstractmethod
    def step(self, command: np.ndarray, dt: float) -> None:
        """Hold a command for `dt` s. In a world of several, time may pass only when all have commanded the same time.

        Args:
            command: (4,) in the units of the command mode with which the plant was made (`COMMAND_MODES`). For `ctbr`:
                collective thrust over mass, m/s^2, and body rates, rad/s.
            dt: seconds, above zero.
        """

    def leave(self) -> None:  # noqa: B027
        """The flight is over. Among others of the same physics, it is in their way without power until `reset`."""

    def meet(self, body: Vehicle, plain_mixer: bool = False) -> None:
        """Fly another body from the next `reset` on. The flight controller stays tuned to the plant's vehicle.

        Args:
            body: a body that differs from the plant's vehicle in fields that `alters` names. Its `rate_gain` is that of
                the rate loop.
            plain_mixer: the mixer clips each rotor by itself, and does not give attitude priority over thrust.

        Raises:
            NotImplementedError: if `alters` names something that this plant does not do.
        """
        raise NotImplementedError(f"plant {self.name!r} has no method meet")

    def disturb(self, wind: np.ndarray, rotor_share: np.ndarray) -> None:
        """Set the disturbance until the next `disturb` or `reset`. At first the air is still and the thrust is full.

        Args:
            wind: (3,) velocity of the air, world, m/s.
            rotor_share: (4,) thrust of each rotor divided by the thrust from the body's thrust map.

        Raises:
            NotImplementedError: if `alters` names something that this plant does not do.
        """
        raise NotImplementedError(f"plant {self.name!r} has no method disturb")

    def expose(self, shutters: Mapping[str, Shutter]) -> None:
        """Take images in flight, from the next `reset` on.

        Args:
            shutters: the shutter of each image for which `seeing` names a camera.

        Raises:
            NotImplementedError: for a plant without cameras.
        """
        raise NotImplementedError(f"plant {self.name!r} has no method expose")

    def shown(self, name: str, now: float) -> np.ndarray:
        """The newest image that a policy has at `now`, s since `reset`.

        Raises:
            NotImplementedError: for a plant without cameras.
        """
        raise NotImplementedError(f"plant {self.name!r} has no method shown")

    def close(self) -> None:  # noqa: B027
        """Release its resources (processes, sockets). It is not used again."""


@dataclass(frozen=True)
class Delay:
    """Commands in transit. Each command acts a latency after it was sent, until the next one acts."""

    latency: float
    """Time from sending to acting, s."""
    acting: np.ndarray
    """(4,) the command that acts now."""
    coming: tuple[tuple[float, np.ndarray], ...] = ()
    """The commands in transit, in order: when each will act, s, and the command."""

    @staticmethod
    def of(latency: float, acting: np.ndarray) -> "Delay":
        """A delay with no command in transit.

        Raises:
            ValueError: for a latency that is negative or not finite.
        """
        if not (math.isfinite(latency) and latency >= 0):
            raise ValueError(f"latency is {latency}; accepted: a finite number of seconds, 0 or more")
        return Delay(latency, acting)

    def send(self, command: np.ndarray, now: float) -> "Delay":
        """Send a command, (4,), at `now`, s. With a latency that has fallen, it overtakes what would act later."""
        due = now + self.latency
        return replace(self, coming=(*(one for one in self.coming if one[0] < due), (due, command)))

    def until(self, now: float, end: float) -> tuple["Delay", list[tuple[np.ndarray, float]]]:
        """Let time pass from `now` to `end`, s.

        Returns:
            The delay at `end`, and the commands that act in between, each with the seconds for which it is held.
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


def check_mode(mode: str, plant: str, rates: bool = False) -> None:
    """Refuse an unknown command mode. With `rates`, also one that does not lead to body rates and thrust.

    Raises:
        ValueError: naming the plant, the mode and what is accepted.
    """
    if mode not in COMMAND_MODES:
        raise ValueError(f"plant {plant!r}: " + unknown("command mode", mode, COMMAND_MODES))
    if rates and COMMAND_MODES[mode].controller is None:
        raise ValueError(f"plant {plant!r} takes no {mode!r} commands; accepted: policies of other modes")

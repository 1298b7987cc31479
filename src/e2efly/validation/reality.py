"""What a flight on a plant meets beside its start: the body, the delay, the air from step to step. Imports no JAX."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.control import Quat
from e2efly.deploy.odometry import Odometry
from e2efly.validation.plant import Plant
from e2efly.vehicles import Vehicle
from e2efly.vehicles.vehicle import quantities, terms


@dataclass(frozen=True)
class Air:
    """What changes in a flight from control step to control step: `t` of them, as many as the longest flight has."""

    wind: np.ndarray
    """(t, 3) velocity of the air, world, m/s."""
    rotor_share: np.ndarray
    """(t, 4) thrust of each rotor over that of the body's thrust map."""
    error: np.ndarray
    """(t, 12) of what the policy sees: position, m; velocity, m/s; half of a small turn about the body's axes, rad;
    body rate, rad/s."""

    @property
    def disturbs(self) -> bool:
        """Whether there is wind, or less than full thrust."""
        return bool(self.wind.any() or (self.rotor_share != 1).any())

    def seen(self, k: int, odometry: Odometry) -> Odometry:
        """What the policy sees of a motion in step `k`."""
        error = self.error[k]
        turn = Quat(1.0, *error[6:9]).normalized()
        return dataclasses.replace(
            odometry,
            position=odometry.position + error[0:3],
            velocity=odometry.velocity + error[3:6],
            quaternion=np.array(Quat.of(odometry.quaternion).compose(turn).stack()),
            body_rate=odometry.body_rate + error[9:12],
        )


@dataclass(frozen=True)
class Reality:
    """What one flight meets."""

    body: Vehicle
    """Which moves; the flight controller need not know it. Its `rate_gain` is that of the rate loop."""
    latency: float
    """Seconds from observation to command."""
    plain_mixer: bool = False
    """Whether the mixer clips each rotor by itself, instead of attitude before thrust."""
    air: Air | None = None
    """None: still air, full thrust, and the truth to see."""


def altered(body: Vehicle, believed: Vehicle) -> frozenset[str]:
    """The fields in which a body is not what the flight controller takes it for."""
    return frozenset(
        f.name
        for f in (*quantities(), *terms())
        if not np.array_equal(getattr(body, f.name), getattr(believed, f.name))
    )


def check_realities(plant: type[Plant], believed: Vehicle, realities: Sequence[Reality]) -> None:
    """Refuse what a plant cannot change without its flight controller's knowledge.

    Raises:
        ValueError: naming the plant, what it would have to change, and what is accepted.
    """
    wanted = set().union(*(altered(reality.body, believed) for reality in realities))
    wanted |= {"plain_mixer"} if any(reality.plain_mixer for reality in realities) else set()
    wanted |= (
        {"wind", "rotor_share"}
        if any(reality.air is not None and reality.air.disturbs for reality in realities)
        else set()
    )
    if beyond := sorted(wanted - plant.alters):
        raise ValueError(
            f"plant {plant.name!r} cannot change {', '.join(beyond)} without its flight controller's knowledge; "
            f"accepted: {', '.join(sorted(plant.alters)) or 'nothing'}, or --controller plant, which tells it"
        )

"""Conditions of a flight on a plant in addition to its start: body, latency, and the air in each step.

Imports no JAX.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.control import Quat
from e2efly.policy.odometry import Odometry
from e2efly.validation.law_step import LawStep
from e2efly.validation.plant import Plant
from e2efly.vehicles.vehicle import Vehicle, quantities, terms


@dataclass(frozen=True)
class Air:
    """Conditions that change from control step to control step, for `t` steps, as many as the longest flight has."""

    wind: np.ndarray
    """(t, 3) velocity of the air, world, m/s."""
    rotor_share: np.ndarray
    """(t, 4) thrust of each rotor divided by the thrust from the body's thrust map."""
    error: np.ndarray
    """(t, 12) errors of the policy's state: position, m; velocity, m/s; half of a small rotation about the body axes,
    rad; body rate, rad/s."""

    @property
    def disturbs(self) -> bool:
        """Whether there is wind, or less than full thrust."""
        return bool(self.wind.any() or (self.rotor_share != 1).any())

    def seen(self, k: int, odometry: Odometry) -> Odometry:
        """The odometry that the policy gets in step `k`."""
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
    """The conditions of one flight."""

    body: Vehicle
    """The body that moves. The flight controller need not know it. Its `rate_gain` is that of the rate loop."""
    latency: float
    """Time from observation to command, s."""
    plain_mixer: bool = False
    """Whether the mixer clips each rotor by itself, and does not give attitude priority over thrust."""
    air: Air | None = None
    """None: still air, full thrust, and a state without errors."""
    law: LawStep | None = None
    """The control steps of the flight under a law. None: there is none."""

    @property
    def disturbs(self) -> bool:
        """Whether there is wind, or another thrust than the body's."""
        return any(each is not None and each.disturbs for each in (self.air, self.law))


def altered(body: Vehicle, believed: Vehicle) -> frozenset[str]:
    """The fields in which a body differs from the vehicle for which the flight controller is tuned."""
    return frozenset(
        f.name
        for f in (*quantities(), *terms())
        if not np.array_equal(getattr(body, f.name), getattr(believed, f.name))
    )


def check_realities(plant: type[Plant], believed: Vehicle, realities: Sequence[Reality]) -> None:
    """Refuse changes that a plant cannot make without the knowledge of its flight controller.

    Raises:
        ValueError: naming the plant, the required change, and what is accepted.
    """
    wanted = set().union(*(altered(reality.body, believed) for reality in realities))
    wanted |= {"plain_mixer"} if any(reality.plain_mixer for reality in realities) else set()
    wanted |= {"wind", "rotor_share"} if any(reality.disturbs for reality in realities) else set()
    if beyond := sorted(wanted - plant.alters):
        raise ValueError(
            f"plant {plant.name!r} cannot change {', '.join(beyond)} without its flight controller's knowledge; "
            f"accepted: {', '.join(sorted(plant.alters)) or 'nothing'}, or --controller plant, which tells it"
        )

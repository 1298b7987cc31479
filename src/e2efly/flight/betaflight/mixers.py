"""Betaflight's own mixers: which of them drives a vehicle's rotors, and in which order the firmware numbers them."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.vehicles.vehicle import Vehicle, rotor_arms

_HALF, _COS30, _COS45, _TAN = 0.5, 0.866025, 0.707107, 0.414178
MIXERS: dict[str, tuple[tuple[float, float, float], ...]] = {
    "QUADX": ((-1, 1, -1), (-1, -1, 1), (1, 1, 1), (1, -1, -1)),
    "HEX6X": (
        (-_HALF, _COS30, 1), (-_HALF, -_COS30, 1), (_HALF, _COS30, -1), (_HALF, -_COS30, -1), (-1, 0, -1), (1, 0, 1),
    ),
    "HEX6": (
        (-_COS30, _HALF, 1), (-_COS30, -_HALF, -1), (_COS30, _HALF, 1), (_COS30, -_HALF, -1), (0, -1, 1), (0, 1, -1),
    ),
    "OCTOFLATP": (
        (_COS45, -_COS45, 1), (-_COS45, -_COS45, 1), (-_COS45, _COS45, 1), (_COS45, _COS45, 1),
        (0, -1, -1), (-1, 0, -1), (0, 1, -1), (1, 0, -1),
    ),
    "OCTOFLATX": (
        (1, -_TAN, 1), (-_TAN, -1, 1), (-1, _TAN, 1), (_TAN, 1, 1),
        (_TAN, -1, -1), (-1, -_TAN, -1), (-_TAN, 1, -1), (1, _TAN, -1),
    ),
}  # fmt: skip
"""Shares of roll, pitch and yaw in the output of each motor, by the name that the command line takes (betaflight:
`mixer_init.c`)."""
NEAR = 2 / 3
"""Largest difference between the bearing of a rotor and that of the mixer's motor, as a share of half the angle between
two neighbouring motors: 30 degrees of four, 20 of six."""


@dataclass(frozen=True)
class OwnMixer:
    """The firmware's mixer for a vehicle."""

    name: str
    """A name of `MIXERS`."""
    motors: tuple[int, ...]
    """For each rotor of the vehicle file, its motor in the firmware's order, from 0."""
    reversed: bool
    """Whether the motors turn against the firmware's usual directions."""

    @property
    def shares(self) -> np.ndarray:
        """(3, N) shares of roll, pitch and yaw in the output of each rotor, in the order of the vehicle file."""
        return np.array(MIXERS[self.name])[list(self.motors)].T

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines of the command line that select it. The firmware's default, `QUADX`, needs none."""
        if self.name == "QUADX" and not self.reversed:
            return ()
        return f"mixer {self.name}", f"set yaw_motors_reversed={'ON' if self.reversed else 'OFF'}"


def mixer_of(vehicle: Vehicle) -> OwnMixer:
    """The mixer of `MIXERS` whose motors lie in the directions of a vehicle's rotors and turn as they do.

    Raises:
        ValueError: naming the vehicle, if there is none, or if its rotors are tilted.
    """
    x, y = rotor_arms(vehicle).T
    bearings = np.arctan2(y, x)
    for name, rows in MIXERS.items() if vehicle.rotor_axis is None else ():
        roll, pitch, yaw = np.array(rows).T
        if len(rows) != len(x):
            continue
        apart = np.abs(np.angle(np.exp(1j * (bearings[:, None] - np.arctan2(roll, -pitch)))))
        motors = apart.argmin(1)
        turning = -yaw[motors] * vehicle.rotor_spin  # a motor that is sped up to turn left turns right itself
        if len({*motors}) == len(x) and len({*turning}) == 1 and apart.min(1).max() <= NEAR * math.pi / len(x):
            return OwnMixer(name, tuple(motors.tolist()), bool(turning[0] < 0))
    raise ValueError(
        f"vehicle {vehicle.name!r} has {len(x)} rotors as no mixer of Betaflight's drives them; accepted: level rotors "
        f"within {NEAR * 180 / len(x):.0f} degrees of the motors of {', '.join(MIXERS)}, which turn as they do or all "
        "the other way"
    )

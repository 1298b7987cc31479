"""Steps of body rate and of thrust, one after the other, from a hover: what `e2efly align` needs. No JAX."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.control.cascade import Motion
from e2efly.control.manoeuvres import ManoeuvreProgress, ManoeuvreRoom, Wish, homewards
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

FIRST = 3.0
"""Time to fly to the place and hover there before the first step, s."""
HOVER = 2.2
"""Time to return and hover between two pairs of steps, s."""
REST = 0.2
"""Time with zero rates and the thrust of hover before and after each pair of steps, s."""
LATE = 1e-4
"""Error of a time, s: by so much earlier a step may begin, so that its length is always the same number of commands."""
ORDER = (1, 2, 3, 0)
"""The order of the commands: body rates about x, y, z, and thrust."""


@dataclass(frozen=True)
class Steps:
    """Pairs of steps: each command is stepped one way, and then as far and as long the other way."""

    rate: float
    """Size of the steps of body rate, rad/s."""
    thrust: float
    """Size of the steps of thrust over mass, m/s^2."""
    length: float
    """Duration of one step, s."""
    count: int
    """Number of pairs of each command. Every second begins with the other sign."""

    @property
    def period(self) -> float:
        """Time from one pair to the next, s."""
        return HOVER + 2 * REST + 2 * self.length

    @property
    def seconds(self) -> float:
        """Duration of the flight, s."""
        return FIRST - HOVER + self.period * len(ORDER) * self.count + HOVER

    def wish(
        self, vehicle: Vehicle, room: ManoeuvreRoom, before: ManoeuvreProgress, time: float, motion: Motion
    ) -> Wish:
        """What it wants at a time, s since the beginning: to hover at its place, or steps without steering."""
        bare, sizes = self.at(time)
        return Wish(
            homewards(before.centre, motion.position.stack()), sizes[1:], float(sizes[0]), before.yaw, bare=bare
        )

    def at(self, time: float) -> tuple[bool, np.ndarray]:
        """Whether a pair of steps is flown, with its rests, and the change of the four commands, (4,) m/s^2, rad/s."""
        since, sizes = time + LATE - (FIRST - HOVER), np.zeros(4)
        number, phase = math.floor(since / self.period), since % self.period - HOVER
        if not 0 <= number < len(ORDER) * self.count or phase < 0:
            return False, sizes
        half = math.floor((phase - REST) / self.length)
        if half in (0, 1):
            channel = ORDER[number // self.count]
            sizes[channel] = (self.rate if channel else self.thrust) * (-1) ** (half + number % self.count)
        return True, sizes

    @property
    def tilt(self) -> float:
        """The largest tilt of a pair, rad."""
        return self.rate * self.length

    def speed(self) -> np.ndarray:
        """The largest speed that a pair leads to, (3,) m/s."""
        level = GRAVITY * math.tan(self.tilt) * self.length
        return np.array([level, level, self.thrust * self.length])

    def reach(self, braking: float, reaction: float) -> np.ndarray:
        """How far a pair leads away before the vehicle has stopped, (3,) m, for this deceleration, m/s^2, and time
        before it, s.
        """
        speed = self.speed()
        return speed * (self.length + REST + reaction) + speed**2 / (2 * braking)

"""`mpc`: linear model predictive control about hover, without steady-state error thanks to a disturbance observer.

Each axis of the world is modelled as a mass whose acceleration follows with a first-order lag. The latency is part of
the model: a plan begins with the motion that the vehicle will have when the first command of the plan acts. DAQP solves
the quadratic programs (Arnström, Bemporad and Axehill, A dual active-set solver for embedded quadratic programming
using recursive LDL' updates, 2022).
"""

import importlib
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.control import Ctbr, Vec3
from e2efly.control.place import ZERO, Place
from e2efly.control.vectors import Array
from e2efly.flight.pilot.hover import flight_gains
from e2efly.flight.pilot.hovering.loops import LIMIT, steer
from e2efly.flight.pilot.hovering.plan import Plan, Solve, planned
from e2efly.flight.pilot.hovering.registry import register
from e2efly.flight.pilot.hovering.response import Seen, UnderWay, ahead, residue, slipped
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

OBSERVER = 2.0
"""Both poles of the observer, 1/s."""


@dataclass(frozen=True)
class Observed:
    """The observer of one flight."""

    velocity: Vec3 | None = None
    """The velocity of the model, world, m/s. None: at the first step."""
    pushed: Vec3 = ZERO
    """The acceleration caused by everything but the rotors and gravity, world, m/s^2."""
    slip: Vec3 = ZERO
    """How much faster the body turns than commanded, rad/s."""


@register("mpc")
@dataclass(frozen=True)
class Mpc:
    """The controller. Its memory is `Observed`."""

    needs: ClassVar[tuple[str, ...]] = ()

    vehicle: Vehicle
    """The vehicle, with gains for the part of the latency that the prediction does not remove. The attitude loop uses
    them."""
    latency: float
    """The time from the vehicle's motion to its rate loop, s."""
    level: Plan
    """The plan of x and of y."""
    up: Plan
    """The plan of z."""
    solve: Solve
    """The solver."""

    @classmethod
    def of(cls, vehicle: Vehicle, latency: float, hold: float = 0.0) -> "Mpc":
        """See `HoverController.of`."""
        try:
            solver: Any = importlib.import_module("daqp")
        except ImportError as error:
            missing = f"hover controller 'mpc': the package daqp is missing ({error})"
            raise ValueError(f"{missing}; accepted: pip install 'e2efly[mpc]', or another hover controller") from None
        gentle = flight_gains(vehicle, residue(latency) + hold / 2)
        loops = np.sqrt(gentle.position_gain * gentle.velocity_gain)
        tilts = 1 / float(gentle.attitude_gain[0]) + 1 / float(np.min(vehicle.rate_gain[:2]))
        return cls(
            gentle, latency, planned(float(loops[0]), tilts),
            planned(float(loops[2]), float(vehicle.motor_time_constant)), solver.solve,
        )  # fmt: skip

    def begin(self) -> Observed:
        """The memory without any push."""
        return Observed()

    def step(
        self, memory: Observed, seen: Seen, under_way: UnderWay, place: Place, dt: float, *, held: bool = False
    ) -> tuple[Observed, Ctbr]:
        """See `HoverController.step`."""
        vehicle, motion, thrust, goal = self.vehicle, seen, under_way.thrust, place.after(-seen.age)
        if not held:
            memory = observed(memory, seen, under_way, dt)
            motion, thrust = ahead(vehicle, seen, under_way, memory.pushed, memory.slip)
            goal = place.after(self.latency - seen.age)
        else:
            memory = Observed(pushed=memory.pushed, slip=memory.slip)
        pushed = memory.pushed
        feed = goal.acceleration - pushed
        gives = motion.attitude.z_axis() * thrust - Vec3(0.0, 0.0, GRAVITY)
        off, behind, over = motion.position - goal.position, motion.velocity - goal.velocity, gives - feed
        x, y, z = zip(*map(_parts, (off, behind, over, feed, goal.velocity)), strict=True)
        limits = list(zip(_most(vehicle), vehicle.speed_max.tolist(), strict=True))
        wanted = Vec3(
            self._axis(self.level, x, limits[0]),
            self._axis(self.level, y, limits[1]),
            self._axis(self.up, z, limits[2]),
        )
        return memory, steer(vehicle, motion, wanted + feed, goal, memory.slip)

    def _axis(self, plan: Plan, parts: tuple[Array, ...], limits: tuple[float, float]) -> Array:
        """The acceleration to command along an axis, relative to that of the goal, m/s^2."""
        rows = np.stack(np.broadcast_arrays(*map(np.atleast_1d, parts)), axis=-1)
        (most, fast), feed, moves = limits, rows[:, 3], rows[:, 4]
        speed = np.stack([-fast - moves, fast - moves], axis=-1)
        first = plan.best(self.solve, rows[:, :3], (-most - feed, most - feed), speed)
        return first if np.ndim(parts[0]) else first[0]


def observed(before: Observed, seen: Seen, under_way: UnderWay, dt: float) -> Observed:
    """The observer after a step of `dt` s: a model of the velocity, which is corrected by the measured velocity."""
    if before.velocity is None:
        return Observed(seen.velocity, before.pushed, before.slip)
    gives = seen.attitude.z_axis() * under_way.thrust - Vec3(0.0, 0.0, GRAVITY)
    expected = before.velocity + (gives + before.pushed) * dt
    off = seen.velocity - expected
    kept = math.exp(-OBSERVER * dt)  # of the discrete observer with both poles there
    pushed = (before.pushed + off * ((1 - kept) ** 2 / max(dt, 1e-3))).clip(LIMIT)
    return Observed(expected + off * (1 - kept**2), pushed, slipped(before.slip, seen, under_way, dt))


def _parts(v: Vec3) -> tuple[Array, Array, Array]:
    return v.x, v.y, v.z


def _most(vehicle: Vehicle) -> tuple[float, float, float]:
    """The largest acceleration along each axis, within tilt and thrust, m/s^2."""
    level = GRAVITY * math.tan(float(vehicle.tilt_max)) / math.sqrt(2)
    up = (vehicle.thrust_to_weight - 1) * GRAVITY
    x, y, z = (float(limit) for limit in vehicle.acceleration_max)
    return min(x, level), min(y, level), min(z, max(up, 0.1 * GRAVITY))

"""Flights of many vehicles at once by a hover controller: rigid bodies with a rate loop, a motor lag and a latency."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from e2efly.control import Ctbr, Quat, Vec3
from e2efly.control.place import ZERO, Place
from e2efly.flight.pilot.hovering import HoverController, Seen, UnderWay, sent
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

STEP = 0.005
"""Of the bodies, s."""


@dataclass(frozen=True)
class Case:
    """What a vehicle meets."""

    to: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where it is to fly to from the origin, m."""
    yaw: float = 0.0
    """The heading that it has and is to keep, rad."""
    mass: float = 1.0
    """Over the vehicle file's."""
    push: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the air, m/s^2."""
    twist: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """By how much its rate loop turns it faster than it is told, rad/s: a weak rotor."""


@dataclass(frozen=True)
class Flights:
    """What n flights came to."""

    time: np.ndarray
    """(t,) s."""
    position: np.ndarray
    """(t, n, 3) m."""
    tilt: np.ndarray
    """(t, n) rad."""
    command: np.ndarray
    """(t, n, 4) thrust over mass and body rates."""
    memory: object = field(repr=False)
    """Of the controller at the end."""

    def after(self, seconds: float) -> np.ndarray:
        """(t', n, 3) positions from then on."""
        return self.position[self.time >= seconds]


def fly(
    controller: HoverController,
    vehicle: Vehicle,
    cases: list[Case],
    latency: float,
    seconds: float = 10.0,
    period: float = 0.01,
    moving: Callable[[float], Place] | None = None,
) -> Flights:
    """Fly all cases, or a moving place.

    Args:
        controller: made for the vehicle and the latency.
        vehicle: that it is made for.
        cases: one a flight.
        latency: from motion to rate loop, s.
        seconds: how long.
        period: of control, s.
        moving: where to be, over time, s, in place of where the cases are to fly to.
    """
    n = len(cases)
    mass, yaw = np.array([c.mass for c in cases]), np.array([c.yaw for c in cases])
    twist = Vec3.of(np.array([c.twist for c in cases]))
    air, to = np.array([c.push for c in cases]), Vec3.of(np.array([c.to for c in cases]))
    zero = np.zeros(n)
    position, velocity, rate = (Vec3(zero, zero, zero) for _ in range(3))
    attitude, thrust = Quat.of_euler(zero, zero, yaw), np.full(n, GRAVITY)
    gains, lag = Vec3.of(vehicle.rate_gain), float(vehicle.motor_time_constant)
    hover = Ctbr(np.full(n, GRAVITY), Vec3(zero, zero, zero))
    queue, under_way, memory, last = [hover] * round(latency / STEP), UnderWay(), controller.begin(), None
    rows: list[tuple[np.ndarray, ...]] = []
    force = Vec3(zero, zero, zero + GRAVITY)
    for k in range(round(seconds / STEP)):
        if k % round(period / STEP) == 0:
            if last is not None:
                under_way = sent(under_way, last, period, vehicle, latency)
            seen = Seen(position, velocity, attitude, rate, force=attitude.unrotate(force), thrust=thrust)
            place = Place(to, ZERO, yaw=yaw) if moving is None else moving(k * STEP)
            memory, last = controller.step(memory, seen, under_way, place, period)
        assert last is not None
        queue.append(last)
        now = queue.pop(0)
        thrust = thrust + (now.thrust - thrust) * (STEP / lag)
        rate = rate + (now.rate + twist - rate).times(gains) * STEP
        attitude = attitude.compose(Quat(1.0 + zero, *(x * STEP / 2 for x in (rate.x, rate.y, rate.z)))).normalized()
        force = attitude.z_axis() * (thrust / mass) + Vec3.of(air)
        velocity = velocity + (force + Vec3(0.0, 0.0, -GRAVITY)) * STEP
        position = position + velocity * STEP
        asked = np.stack(np.broadcast_arrays(now.thrust, now.rate.x, now.rate.y, now.rate.z), axis=-1)
        rows.append((position.stack(), attitude.tilt(), asked))
    where, tilt, asked = (np.stack(x) for x in zip(*rows, strict=True))
    return Flights(STEP * np.arange(1, len(rows) + 1), where, tilt, asked, memory)

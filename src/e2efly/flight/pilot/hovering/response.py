"""The commands that do not act yet, and the motion that the vehicle will have when the next command acts.

Pure functions, for one vehicle or a batch.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from e2efly.control import Ctbr, Quat, Vec3
from e2efly.control.place import ZERO
from e2efly.control.vectors import Array, namespace
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

LONGEST_STEP = 0.02
"""The longest step of the prediction, s."""
SLIP_S, SLIP = 1.0, Vec3(2.0, 2.0, 2.0)
"""Time constant with which the slip of the body rates is followed, s, and its bound, rad/s."""


@dataclass(frozen=True)
class Seen:
    """The inputs of a hover controller. Components are numbers, or arrays of the batch's shape."""

    position: Vec3
    """World, m."""
    velocity: Vec3
    """World, m/s."""
    attitude: Quat
    """Body to world."""
    body_rate: Vec3
    """Body, rad/s."""
    force: Vec3 | None = None
    """Specific force from the accelerometer, body, m/s^2. None: not known."""
    age: float = 0.0
    """The age of this motion, s."""
    thrust: Array | None = None
    """Collective thrust over mass from the measured rotor speeds, m/s^2. None: they are not measured."""


@dataclass(frozen=True)
class UnderWay:
    """The commands that have been sent and do not act yet."""

    thrust: Array = GRAVITY
    """Collective thrust over mass of the rotors when the oldest of these commands begins to act, m/s^2. It is modelled
    with the lag of the motors, and begins with that of hovering."""
    rate: Vec3 = ZERO
    """Body rates at that moment, modelled with the rate loop of the vehicle file, rad/s."""
    commands: tuple[tuple[float, Ctbr], ...] = ()
    """How long each command is held, s, and the command, oldest first. All together last at most for the latency."""


def thrust_of(vehicle: Vehicle, speeds: Sequence[float]) -> float | None:
    """The collective thrust over mass, m/s^2, of rotors with these speeds, rad/s. None: not all speeds are measured."""
    if len(speeds) != vehicle.rotor_count or min(speeds) <= 0:
        return None
    return float(sum(map(vehicle.rotor_thrust, speeds)) / vehicle.mass)


def residue(latency: float) -> float:
    """The latency for which the gains must be chosen if the motion is predicted, s.

    It is a third of the latency, because a prediction has errors.
    """
    return latency / 3


def sent(before: UnderWay, command: Ctbr, seconds: float, vehicle: Vehicle, latency: float) -> UnderWay:
    """The commands under way after a command was held for some time. The command was the newest for `seconds`, s. The
    vehicle's motor lag and rate gains are used. `latency` is the time from its motion to its rate loop, s.
    """
    low, high = (float(vehicle.lift) * float(limit) / float(vehicle.mass) for limit in vehicle.thrust_range)
    given = namespace(command.thrust).clip(command.thrust, low, high)
    commands, thrust, rate = [*before.commands, (seconds, Ctbr(given, command.rate))], before.thrust, before.rate
    over = sum(held for held, _ in commands) - latency
    while commands and over > 1e-9:
        held, oldest = commands.pop(0)
        part = min(held, over)
        thrust = oldest.thrust + (thrust - oldest.thrust) * math.exp(-part / vehicle.motor_time_constant)
        rate = oldest.rate + (rate - oldest.rate).times(_left(vehicle, part))
        if held > part:
            commands.insert(0, (held - part, oldest))
        over -= part
    return UnderWay(thrust, rate, tuple(commands))


def slipped(before: Vec3, seen: Seen, under_way: UnderWay, dt: float) -> Vec3:
    """How much faster the body turns than commanded, rad/s. A steady torque on a rate loop has this effect. `before` is
    the slip so far. `under_way` has the expected body rates. `dt` is the time since the last control step, s.
    """
    off = seen.body_rate - under_way.rate
    return (before + (off - before) * (1 - math.exp(-dt / SLIP_S))).clip(SLIP)


def _left(vehicle: Vehicle, seconds: float) -> Vec3:
    """The share of an error of the body rates that is left after some seconds."""
    return Vec3(*(math.exp(-float(gain) * seconds) for gain in vehicle.rate_gain))


def ahead(
    vehicle: Vehicle, seen: Seen, under_way: UnderWay, pushed: Vec3 = ZERO, slip: Vec3 = ZERO
) -> tuple[Seen, Array]:
    """Predict the motion that the vehicle will have when all commands under way have acted and the next one begins to.

    The body rates follow their setpoint with a first-order lag that is given by the rate gains. The rotors follow
    theirs with the lag of the motors. `pushed` is the acceleration caused by everything but the rotors and gravity,
    world, m/s^2. `slip` is how much faster the body turns than commanded, rad/s.

    Returns:
        The predicted motion, and the collective thrust over mass at that time, m/s^2.
    """
    position, velocity, attitude, rate, thrust = (
        seen.position, seen.velocity, seen.attitude, seen.body_rate, under_way.thrust,
    )  # fmt: skip
    push = pushed - Vec3(0.0, 0.0, GRAVITY)
    for seconds, command in under_way.commands:
        count = max(math.ceil(seconds / LONGEST_STEP - 1e-9), 1)
        h = seconds / count
        left, told = _left(vehicle, h), command.rate + slip
        kept = math.exp(-h / vehicle.motor_time_constant)
        for _ in range(count):
            turned = told + (rate - told).times(left)
            gives = command.thrust + (thrust - command.thrust) * kept
            after = attitude.turned((rate + turned) * (h / 2))
            pull = (attitude.z_axis() * thrust + after.z_axis() * gives) * 0.5 + push
            position = position + velocity * h + pull * (h * h / 2)
            velocity, attitude, rate, thrust = velocity + pull * h, after, turned, gives
    return replace(seen, position=position, velocity=velocity, attitude=attitude, body_rate=rate), thrust

"""What to fly so that a log shows a vehicle's parameters: lines for the drag, doublets and chirps for the rest. No JAX.

`lines` and `doublets` are what is flown where there is room without end; `excite` flies them inside a room.
"""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from e2efly.control.cascade import Ctbr, Motion, limited, reach
from e2efly.control.vectors import Vec3
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

DURATION = 30.0
"""Of all of it, s."""
PULSE = 0.12
"""One half of a doublet, s."""
RATES = (3.0, 3.0, 2.0)
"""Height of the doublets of body rate, rad/s."""
THRUST = 4.0
"""Height of those of thrust over mass, m/s^2."""
LEG = 3.0
"""Time of a straight line, s."""
LINES, CHIRPS = 0.5, 0.35
"""Shares of the time: of lines with doublets, and of chirps; the rest is steps of the heading."""
SWEEP = (0.8, 6.0)
"""From which frequency to which a chirp goes, Hz."""
CHIRPED = (2.0, 2.0, 1.5)
"""Amplitudes of the chirps of body rate, rad/s; that of thrust is `THRUST`."""
YAWS = (0.8, -0.8, 0.0)
"""Headings that are stepped to, rad from the first."""
KICK, KICK_EVERY, FALL = 0.85, 1.1, 8.0
"""Meanwhile the thrust is kicked to this share of the largest, so often, s, and the climb is then undone by so much
less thrust over mass, m/s^2: what the motors give at the top shows nowhere else."""
STOPPING, CENTRAL = 0.42, 0.25
"""Share of the room's length that stopping may take, and that the centre stays away from its edges."""
PULL, PULLED = 0.8, 1.0
"""Back to the centre: speed over distance, 1/s, and the largest, m/s."""
INWARDS = 1.0
"""Speed at which the edge is left, m/s."""
TRIM_GAIN, TRIM = 1.5, 4.0
"""Growth of the trim over the error of the climb, 1/s^2 per m/s, and its largest, m/s^2."""
TILT = 0.6
"""The largest tilt that steering asks for, rad."""
GAINS = (4.0, 2.0), (1.3, 1.3, 3.0)
"""Largest gains of tilt and yaw, and of the velocity, 1/s: the vehicle is not known yet."""
_LINES = np.array([
    (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 0.3), (0, 0, -0.3), (0.8, 0.8, 0), (-0.8, -0.8, 0),
    (0.7, -0.7, 0.2), (-0.7, 0.7, -0.2),
])  # fmt: skip


def lines(time: float, speed: float) -> np.ndarray:
    """The velocity to fly at, world, m/s, (3,): there and back along the axes and the diagonals.

    Args:
        time: since the beginning, s.
        speed: of the fastest, m/s.
    """
    return speed * _LINES[int(time / LEG) % len(_LINES)]


def doublets(time: float) -> tuple[np.ndarray, float]:
    """What is added to the command: body rates, rad/s, (3,), and thrust over mass, m/s^2.

    Every second another one: roll, pitch, yaw, thrust; one way for `PULSE` seconds, and back for as long.
    """
    phase, which = time % 1.0, int(time) % 4
    sign = 1.0 if phase < PULSE else -1.0 if phase < 2 * PULSE else 0.0
    rates = np.zeros(3)
    if which < 3:
        rates[which] = sign * RATES[which]
    return rates, sign * THRUST if which == 3 else 0.0


def softened(vehicle: Vehicle, tilt: float = TILT) -> Vehicle:
    """A vehicle with gains that steer one that is not known.

    Args:
        vehicle: whose gains are taken where they are lower.
        tilt: the largest that steering may ask for, rad.
    """
    return dataclasses.replace(
        vehicle,
        attitude_gain=np.minimum(vehicle.attitude_gain, GAINS[0]),
        velocity_gain=np.minimum(vehicle.velocity_gain, GAINS[1]),
        tilt_max=min(vehicle.tilt_max, tilt),
    )


def trimmed(trim: float, error: float, dt: float, gain: float = TRIM_GAIN, most: float = TRIM) -> float:
    """The thrust over mass that makes up for an unknown mass, m/s^2, after `dt` s of an error of the climb, m/s."""
    return min(max(trim + gain * error * dt, -most), most)


@dataclass(frozen=True)
class Room:
    """Where an excitation flight stays, and how it stops."""

    low: np.ndarray
    """(3,) smallest place, world, m."""
    high: np.ndarray
    """(3,) largest, m."""
    braking: float
    """Deceleration that is counted on, m/s^2 ..."""
    reaction: float
    """... after so long, s."""

    def stop(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Where a motion comes to rest, each axis by itself, (3,) m."""
        return position + velocity * self.reaction + velocity * np.abs(velocity) / (2 * self.braking)

    @property
    def fastest(self) -> np.ndarray:
        """The speed along each axis that is reached and stopped from inside, (3,) m/s."""
        return fastest(self.high - self.low, self.braking, self.reaction)


def fastest(length: np.ndarray, braking: float, reaction: float) -> np.ndarray:
    """The speed that is stopped from on `STOPPING` of a length, m: the root of v reaction + v^2 / (2 braking), m/s."""
    return braking * (np.sqrt(reaction**2 + 2 * STOPPING * length / braking) - reaction)


def length_for(speed: float, braking: float, reaction: float) -> float:
    """The inverse of `fastest`: the length, m, that a speed, m/s, needs."""
    return (speed * reaction + speed**2 / (2 * braking)) / STOPPING


@dataclass(frozen=True)
class Progress:
    """What one control step of an excitation flight hands to the next."""

    centre: np.ndarray
    """(3,) about which it flies, world, m."""
    yaw: float
    """The heading that it holds, rad."""
    leg: int = 0
    """Which line is flown ..."""
    since: float = 0.0
    """... and since when, s from the beginning."""
    trim: float = 0.0
    """Thrust over mass that makes up for an unknown mass, m/s^2."""
    time: float = 0.0
    """Of the last step, s from the beginning."""

    @staticmethod
    def begin(room: Room, position: np.ndarray, yaw: float) -> "Progress":
        """About where the vehicle is, as far as the room's edge lets lines pass through it."""
        inner = CENTRAL * (room.high - room.low)
        return Progress(np.clip(position, room.low + inner, room.high - inner), yaw)


def excite(
    vehicle: Vehicle, room: Room, speed: float, duration: float, before: Progress, time: float, motion: Motion
) -> tuple[Progress, Ctbr]:
    """One control step: lines with doublets, then chirps, then steps of the heading with kicks of the thrust. Pure.

    Args:
        vehicle: whose gains steer.
        room: where to stay.
        speed: of the fastest line, m/s.
        duration: of all of it, s.
        before: from `Progress.begin` or the last step.
        time: since the beginning, s.
        motion: of the vehicle.

    Returns:
        What the next step is handed, and the command.
    """
    position, velocity = motion.position.stack(), motion.velocity.stack()
    stop = room.stop(position, velocity)
    share = time / duration
    pull = np.clip(PULL * (before.centre - position), -PULLED, PULLED)
    leg, since, yaw = before.leg, before.since, before.yaw
    rates, push, wanted = np.zeros(3), 0.0, pull
    if share < LINES:
        along = _LINES[leg % len(_LINES)]
        ahead = ((along > 0) & (stop > room.high)) | ((along < 0) & (stop < room.low))
        if ahead.any() or time - since >= LEG:
            leg, since = leg + 1, time
            along = _LINES[leg % len(_LINES)]
        wanted = np.where(along != 0, np.clip(speed * along, -room.fastest, room.fastest), pull)
        rates, push = doublets(time)
    elif share < LINES + CHIRPS:
        rates, push = chirps((share - LINES) * duration, CHIRPS * duration)
    else:
        push = kicks((share - LINES - CHIRPS) * duration, kick_for(vehicle, room))
        yaw += YAWS[min(int((share - LINES - CHIRPS) / (1 - LINES - CHIRPS) * len(YAWS)), len(YAWS) - 1)]
    # whatever is flown: what would come to rest outside flies inwards
    wanted = np.where(stop > room.high, np.minimum(wanted, -INWARDS), wanted)
    wanted = np.where(stop < room.low, np.maximum(wanted, INWARDS), wanted)
    trim = trimmed(before.trim, float(wanted[2] - velocity[2]), min(max(time - before.time, 0.0), 0.1))
    found = reach(vehicle, motion, Vec3(*wanted), np.float64(yaw))
    command = limited(vehicle, max(float(found.thrust) + trim + push, 0.0), found.rate + Vec3(*rates))
    return Progress(before.centre, before.yaw, leg, since, trim, time), command


def kick_for(vehicle: Vehicle, room: Room) -> float:
    """How much thrust over mass a kick adds to hover's, m/s^2: as much as the room's height lets be stopped from."""
    return float(np.clip((KICK * vehicle.thrust_to_weight - 1) * GRAVITY, 0.0, room.fastest[2] / PULSE))


def kicks(time: float, height: float) -> float:
    """What is added to the thrust over mass, m/s^2: up for `PULSE` seconds, then down until the climb is undone.

    Args:
        time: since the first was due, s; it begins when `KICK_EVERY` has passed for a third.
        height: of a kick, m/s^2.
    """
    phase = (time + 2 * KICK_EVERY / 3) % KICK_EVERY
    if time < KICK_EVERY / 3:
        return 0.0
    return height if phase < PULSE else -FALL if phase < PULSE * (1 + height / FALL) else 0.0


def chirps(time: float, duration: float) -> tuple[np.ndarray, float]:
    """What is added to the command: body rates, rad/s, (3,), and thrust over mass, m/s^2.

    Sines whose frequency rises evenly over `SWEEP`: of roll, pitch, yaw and thrust, one after the other.

    Args:
        time: since the first began, s.
        duration: of the four together, s.
    """
    each = duration / 4
    which, at = min(int(time / each), 3), time % each
    low, high = SWEEP
    sine = math.sin(math.tau * (low * at + (high - low) * at**2 / (2 * each)))
    rates = np.zeros(3)
    if which < 3:
        rates[which] = sine * CHIRPED[which]
    return rates, sine * THRUST if which == 3 else 0.0

"""Flights whose logs show a vehicle's parameters: lines for the drag, doublets and chirps for the rest. No JAX.

`lines` and `doublets` are for unlimited space. `excite` flies a schedule inside a room.
"""

import dataclasses
import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from e2efly.control.cascade import Ctbr, Motion, limited, reach
from e2efly.control.vectors import Vec3
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

DURATION = 30.0
"""Duration of the whole flight, s."""
PULSE = 0.12
"""Duration of one half of a doublet, s."""
RATES = (3.0, 3.0, 2.0)
"""Amplitude of the doublets of body rate, rad/s."""
THRUST = 4.0
"""Amplitude of the doublets of thrust over mass, m/s^2."""
LEG = 3.0
"""Duration of a straight line, s."""
LINES, CHIRPS = 0.5, 0.35
"""Shares of the time for lines with doublets, and for chirps. The rest is for steps of the heading."""
SWEEP = (0.8, 6.0)
"""Lowest and highest frequency of a chirp, Hz."""
CHIRPED = (2.0, 2.0, 1.5)
"""Amplitudes of the chirps of body rate, rad/s. The amplitude of the thrust is `THRUST`."""
YAWS = (0.8, -0.8, 0.0)
"""Headings of the heading steps, rad from the first heading."""
KICK, KICK_EVERY, FALL = 0.85, 1.1, 8.0
"""Kicks of the thrust during the heading steps: share of the largest thrust; interval, s; and the reduction of thrust
over mass with which the climb is undone afterwards, m/s^2. Only the kicks show the motors near full thrust."""
STOPPING, CENTRAL = 0.42, 0.25
"""Share of the room's length that stopping may take, and share of the length between the centre and the room's
edges."""
PULL, PULLED = 0.8, 1.0
"""Return to the centre: speed divided by distance, 1/s, and largest speed, m/s."""
INWARDS = 1.0
"""Speed away from an edge, m/s."""
TRIM_GAIN, TRIM = 1.5, 4.0
"""Growth of the trim divided by the error of the climb rate, 1/s^2 per m/s, and the largest trim, m/s^2."""
TILT = 0.6
"""Largest tilt for steering, rad."""
GAINS = (4.0, 2.0), (1.3, 1.3, 3.0)
"""Largest gains of tilt and yaw, and of the velocity, 1/s. They are low because the vehicle is not known yet."""
_LINES = np.array([
    (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 0.3), (0, 0, -0.3), (0.8, 0.8, 0), (-0.8, -0.8, 0),
    (0.7, -0.7, 0.2), (-0.7, 0.7, -0.2),
])  # fmt: skip


def lines(time: float, speed: float) -> np.ndarray:
    """The velocity to fly at, world, m/s, (3,): in both directions along the axes and the diagonals. `time` is that
    since the beginning, s, and `speed` that of the fastest line, m/s.
    """
    return speed * _LINES[int(time / LEG) % len(_LINES)]


def doublets(time: float) -> tuple[np.ndarray, float]:
    """Additions to the command: body rates, rad/s, (3,), and thrust over mass, m/s^2.

    Every second another doublet begins: roll, pitch, yaw, thrust. It lasts `PULSE` seconds in one direction, and as
    long in the other.
    """
    phase, which = time % 1.0, int(time) % 4
    sign = 1.0 if phase < PULSE else -1.0 if phase < 2 * PULSE else 0.0
    rates = np.zeros(3)
    if which < 3:
        rates[which] = sign * RATES[which]
    return rates, sign * THRUST if which == 3 else 0.0


def softened(vehicle: Vehicle, tilt: float = TILT) -> Vehicle:
    """A vehicle with gains that can steer a vehicle that is not known. The gains of `vehicle` are used where they are
    lower. `tilt` is the largest tilt for steering, rad.
    """
    return dataclasses.replace(
        vehicle,
        attitude_gain=np.minimum(vehicle.attitude_gain, GAINS[0]),
        velocity_gain=np.minimum(vehicle.velocity_gain, GAINS[1]),
        tilt_max=min(vehicle.tilt_max, tilt),
    )


def trimmed(trim: float, error: float, dt: float, gain: float = TRIM_GAIN, most: float = TRIM) -> float:
    """The thrust over mass that compensates an unknown mass, m/s^2, after `dt` s of an error of the climb rate, m/s."""
    return min(max(trim + gain * error * dt, -most), most)


@dataclass(frozen=True)
class ManoeuvreRoom:
    """The space in which an excitation flight stays, and its stopping behaviour."""

    low: np.ndarray
    """(3,) lowest corner, world, m."""
    high: np.ndarray
    """(3,) highest corner, world, m."""
    braking: float
    """Assumed deceleration, m/s^2."""
    reaction: float
    """Assumed time before the deceleration begins, s."""

    def stop(self, position: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Position at which a motion comes to rest, each axis separately, (3,) m."""
        return position + velocity * self.reaction + velocity * np.abs(velocity) / (2 * self.braking)

    @property
    def fastest(self) -> np.ndarray:
        """Largest speed along each axis that can be reached and stopped inside, (3,) m/s."""
        return fastest(self.high - self.low, self.braking, self.reaction)


def fastest(length: np.ndarray, braking: float, reaction: float) -> np.ndarray:
    """Largest speed that can be stopped within `STOPPING` of a length, m/s.

    It is the root of v reaction + v^2 / (2 braking) = that distance, m.
    """
    return braking * (np.sqrt(reaction**2 + 2 * STOPPING * length / braking) - reaction)


def length_for(speed: float, braking: float, reaction: float) -> float:
    """The inverse of `fastest`: the length that a speed, m/s, needs, m."""
    return (speed * reaction + speed**2 / (2 * braking)) / STOPPING


@dataclass(frozen=True)
class ManoeuvreProgress:
    """The state that one control step of an excitation flight passes to the next."""

    centre: np.ndarray
    """(3,) centre of the flight, world, m."""
    yaw: float
    """The heading that it holds, rad."""
    leg: int = 0
    """Index of the present line."""
    since: float = 0.0
    """Start time of this line, s from the beginning."""
    trim: float = 0.0
    """Thrust over mass that compensates an unknown mass, m/s^2."""
    time: float = 0.0
    """Time of the last step, s from the beginning."""

    @staticmethod
    def begin(room: ManoeuvreRoom, position: np.ndarray, yaw: float) -> "ManoeuvreProgress":
        """Begin at the vehicle's position.

        The centre is moved away from the room's edges, so that lines can pass through it.
        """
        inner = CENTRAL * (room.high - room.low)
        return ManoeuvreProgress(np.clip(position, room.low + inner, room.high - inner), yaw)


@dataclass(frozen=True)
class Wish:
    """What a schedule wants in one control step."""

    velocity: np.ndarray
    """(3,) velocity to steer for, world, m/s."""
    rates: np.ndarray
    """(3,) addition to the body rates, rad/s."""
    push: float
    """Addition to the thrust over mass, m/s^2."""
    yaw: float
    """Heading to hold, rad."""
    leg: int = 0
    """Index of the line that is flown."""
    since: float = 0.0
    """Start time of this line, s from the beginning."""
    bare: bool = False
    """Whether nothing steers: the body rates are `rates` alone, and the thrust is that of hover and `push`."""


class Schedule(Protocol):
    """What is flown, and when."""

    @property
    def seconds(self) -> float:
        """Duration of the flight, s."""
        ...

    def wish(
        self, vehicle: Vehicle, room: ManoeuvreRoom, before: ManoeuvreProgress, time: float, motion: Motion
    ) -> Wish:
        """What it wants at a time, s since the beginning."""
        ...


@dataclass(frozen=True)
class Manoeuvres:
    """Lines with doublets, then chirps, then steps of the heading with kicks of the thrust."""

    seconds: float
    """Duration, s."""
    speed: float
    """Speed of the fastest line, m/s."""

    def wish(
        self, vehicle: Vehicle, room: ManoeuvreRoom, before: ManoeuvreProgress, time: float, motion: Motion
    ) -> Wish:
        """What it wants at a time, s since the beginning."""
        position = motion.position.stack()
        stop, share = room.stop(position, motion.velocity.stack()), time / self.seconds
        wish = Wish(homewards(before.centre, position), np.zeros(3), 0.0, before.yaw, before.leg, before.since)
        if share < LINES:
            leg, since, along = before.leg, before.since, _LINES[before.leg % len(_LINES)]
            ahead = ((along > 0) & (stop > room.high)) | ((along < 0) & (stop < room.low))
            if ahead.any() or time - since >= LEG:
                leg, since = leg + 1, time
                along = _LINES[leg % len(_LINES)]
            wanted = np.where(along != 0, np.clip(self.speed * along, -room.fastest, room.fastest), wish.velocity)
            rates, push = doublets(time)
            return dataclasses.replace(wish, velocity=wanted, rates=rates, push=push, leg=leg, since=since)
        if share < LINES + CHIRPS:
            rates, push = chirps((share - LINES) * self.seconds, CHIRPS * self.seconds)
            return dataclasses.replace(wish, rates=rates, push=push)
        push = kicks((share - LINES - CHIRPS) * self.seconds, kick_for(vehicle, room))
        turned = YAWS[min(int((share - LINES - CHIRPS) / (1 - LINES - CHIRPS) * len(YAWS)), len(YAWS) - 1)]
        return dataclasses.replace(wish, push=push, yaw=before.yaw + turned)


def homewards(centre: np.ndarray, position: np.ndarray) -> np.ndarray:
    """The velocity with which a vehicle returns to its place, (3,) m/s."""
    return np.clip(PULL * (centre - position), -PULLED, PULLED)


def excite(
    vehicle: Vehicle, room: ManoeuvreRoom, schedule: Schedule, before: ManoeuvreProgress, time: float, motion: Motion
) -> tuple[ManoeuvreProgress, Ctbr]:
    """One control step of a schedule. Pure. The gains of `vehicle` are used to steer. `time` is that since the
    beginning, s. `before` is the state from `ManoeuvreProgress.begin` or from the last step.

    Returns:
        The state for the next step, and the command.
    """
    position, velocity = motion.position.stack(), motion.velocity.stack()
    stop, wish = room.stop(position, velocity), schedule.wish(vehicle, room, before, time, motion)
    over, under = stop > room.high, stop < room.low
    trim, yaw = before.trim, wish.yaw
    if wish.bare and not (over | under).any():
        command = limited(vehicle, max(GRAVITY + trim + wish.push, 0.0), Vec3(*wish.rates))
    else:
        # at any time: a vehicle that would come to rest outside flies inwards
        wanted = np.where(over, np.minimum(wish.velocity, -INWARDS), wish.velocity)
        wanted = np.where(under, np.maximum(wanted, INWARDS), wanted)
        trim = trimmed(trim, float(wanted[2] - velocity[2]), min(max(time - before.time, 0.0), 0.1))
        found = reach(vehicle, motion, Vec3(*wanted), np.float64(yaw))
        push, rates = (0.0, np.zeros(3)) if wish.bare else (wish.push, wish.rates)
        command = limited(vehicle, max(float(found.thrust) + trim + push, 0.0), found.rate + Vec3(*rates))
    return ManoeuvreProgress(before.centre, before.yaw, wish.leg, wish.since, trim, time), command


def kick_for(vehicle: Vehicle, room: ManoeuvreRoom) -> float:
    """Thrust over mass that a kick adds to that of hover, m/s^2.

    It is limited by the height in which the climb can stop.
    """
    return float(np.clip((KICK * vehicle.thrust_to_weight - 1) * GRAVITY, 0.0, room.fastest[2] / PULSE))


def kicks(time: float, height: float) -> float:
    """Addition to the thrust over mass, m/s^2: up for `PULSE` seconds, then down until the climb is undone. `time` is
    that since the kicks began, s. The first kick comes after a third of `KICK_EVERY`. `height` is the size of a kick,
    m/s^2.
    """
    phase = (time + 2 * KICK_EVERY / 3) % KICK_EVERY
    if time < KICK_EVERY / 3:
        return 0.0
    return height if phase < PULSE else -FALL if phase < PULSE * (1 + height / FALL) else 0.0


def chirps(time: float, duration: float) -> tuple[np.ndarray, float]:
    """Additions to the command: body rates, rad/s, (3,), and thrust over mass, m/s^2.

    They are sines whose frequency rises linearly over `SWEEP`, for roll, pitch, yaw and thrust, one after the other.
    `time` is that since the first chirp began, and `duration` that of the four chirps together, s.
    """
    each = duration / 4
    which, at = min(int(time / each), 3), time % each
    low, high = SWEEP
    sine = math.sin(math.tau * (low * at + (high - low) * at**2 / (2 * each)))
    rates = np.zeros(3)
    if which < 3:
        rates[which] = sine * CHIRPED[which]
    return rates, sine * THRUST if which == 3 else 0.0

"""Measure what AirSim's vehicle does with throttle and rate commands, and how it differs from the policy's vehicle.

No method of AirSim's RPC gives mass, inertia, rotors or drag: in AirSim they are constants in the source of the frame
(`MultiRotorParams.hpp`). Their combined effects are measured instead, in the air, in seconds of simulated time.
"""

from dataclasses import dataclass

import numpy as np

from e2efly.validation.airsim.lockstep import AirSimSession
from e2efly.validation.plant import RigidState
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix, inertia_tensor

HEIGHT = 30.0
"""Height above the place where AirSim has put the vehicle, m."""
THROTTLES = (0.4, 0.7, 1.0)
"""Throttles at which thrust is measured."""
SPEED = 5.0
"""Speed at which drag is measured, m/s."""
SPUN_S = 0.3
"""Time after which the rotors have reached the speed of a throttle, s."""
LONG_S = 0.04
"""Longest time between two commands, s. After 0.06 s without a command AirSim hovers by itself (`api_goal_timeout`)."""
SMALL_GAIN = 0.002
"""Gain of the rate loop while its effect is measured. It is so small that the loop is slow compared with the rotors'
lag."""
_RATE = 1.0
"""Rate command in this measurement, rad/s."""
FREE = 0.03
"""Relative differences below this are not reported."""
_SHARE = 0.7
"""Size of the throttle step, as a share of the range from hover to full throttle."""
_FOLLOWED = 1 - 1 / np.e
_LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
_STILL = np.zeros(3)


@dataclass(frozen=True)
class AirSimModel:
    """The measured effects of throttle and rate commands."""

    thrust: float
    """Thrust over mass per throttle, m/s^2: the slope of a line through `THROTTLES`."""
    offset: float
    """Thrust over mass at zero throttle on the same line, m/s^2."""
    lag: float
    """Time in which thrust follows 63 % of a throttle step, s."""
    turn: np.ndarray
    """(3,) angular acceleration about the body axes per unit of the mixer's input, rad/s^2. A rate gain of 1 gives the
    rate loop this bandwidth in 1/s."""
    drag: np.ndarray
    """(3,) deceleration at `SPEED` along the body axes, m/s^2."""

    def throttle(self, thrust: float) -> float:
        """The throttle, 0 to 1, that gives a thrust over mass, m/s^2."""
        return float(np.clip((thrust - self.offset) / self.thrust, 0.0, 1.0))

    def gains(self, rate_gain: np.ndarray) -> np.ndarray:
        """Gains of AirSim's rate loop that give it a bandwidth, 1/s, about each axis."""
        return np.asarray(rate_gain, float) / self.turn


def measure(session: AirSimSession) -> AirSimModel:
    """Measure the vehicle with several throttles, a throttle step, rotations, and flights in three directions.

    Raises:
        ValueError: when the vehicle does not respond like a quadrotor.
    """
    place = session.state().position + np.array([0.0, 0.0, HEIGHT])
    start = RigidState(place, _STILL, _LEVEL, _STILL)
    session.set_gains(np.full(3, SMALL_GAIN))
    thrusts = []
    for throttle in THROTTLES:
        _spin(session, start, throttle)
        thrusts.append(_acceleration(session, _STILL, throttle)[2] + GRAVITY)
    slope, offset = (float(value) for value in np.polyfit(THROTTLES, thrusts, 1))
    where = session.rpc.where
    if not (np.isfinite(slope) and slope > GRAVITY):
        raise ValueError(f"{where}: full throttle gives {slope + offset:.2f} m/s^2; accepted: more than its weight")
    hover = (GRAVITY - offset) / slope
    lag = _lag(session, start, hover)
    turn, drag = [], []
    for axis in np.eye(3):
        _spin(session, start, hover)
        turn.append(_bandwidth(session, axis, hover, lag) / SMALL_GAIN)
        _spin(session, start, hover)
        session.place(RigidState(place, SPEED * axis, _LEVEL, _STILL))
        drag.append(-float(axis @ _acceleration(session, _STILL, hover)))
    if not all(np.isfinite(turn)) or min(turn) <= 0:
        raise ValueError(f"{where}: answers to body rates with {turn} rad/s^2; accepted: turns the way it is told")
    return AirSimModel(slope, offset, lag, np.array(turn), np.array(drag))


def hold(session: AirSimSession, rates: np.ndarray, throttle: float, seconds: float) -> float:
    """Hold a command for `seconds`. Returns the simulated time that has passed, s."""
    count = max(int(np.ceil(seconds / LONG_S - 1e-9)), 1)
    passed = 0.0
    for _ in range(count):
        session.command(rates, throttle)
        passed += session.advance(seconds / count)
    return passed


def differences(model: AirSimModel, vehicle: Vehicle) -> list[str]:
    """Differences between AirSim's vehicle and another one, one sentence each.

    AirSim's rate loop is given the vehicle's gains.
    """
    low, high = vehicle.thrust_range
    mass, (jx, jy, jz) = float(vehicle.mass), np.diag(inertia_tensor(vehicle)).tolist()
    arms = np.abs(allocation_matrix(vehicle)[1:]).sum(1)  # torque of rotors that all push in one sense or the other
    rows = [
        ("full thrust over mass", "m/s^2", 4 * high / mass, model.thrust + model.offset),
        ("lag of thrust behind a step of throttle", "s", _lag_of(vehicle), model.lag),
    ]
    for name, inertia, arm, turn in zip("xyz", (jx, jy, jz), arms, model.turn, strict=True):
        own = arm * (high - low) / 2 / inertia
        rows.append((f"largest angular acceleration about {name} at half thrust", "rad/s^2", own, turn / 2))
    linear, square = vehicle.drag_linear, vehicle.drag_quadratic
    for i, name in enumerate("xyz"):
        own = float((linear[i] + square[i] * SPEED) * SPEED / mass)
        rows.append((f"drag over mass at {SPEED:g} m/s along {name}", "m/s^2", own, float(model.drag[i])))
    return [
        f"AirSim's vehicle has a {what} of {there:.3g} {unit}; {vehicle.name} has {here:.3g}."
        for what, unit, here, there in rows
        if abs(there - here) > FREE * max(abs(here), abs(there)) and abs(there - here) > _SMALL[unit]
    ]


_SMALL = {"m/s^2": 0.05, "s": 0.003, "rad/s^2": 1.0}
"""Absolute differences below these are not reported, whatever their share. Their causes are the physics step and the
rounding of a state in single precision."""


def _lag_of(vehicle: Vehicle) -> float:
    """Time after which a vehicle's thrust has followed 63 % of the throttle step of `measure`, s.

    It follows from the lag of the vehicle's rotors.
    """
    (k2, k1, k0), high = vehicle.thrust_map, vehicle.thrust_range[1]
    begin = float(vehicle.mass) * GRAVITY / 4
    end = _SHARE * high + (1 - _SHARE) * begin
    level = begin + _FOLLOWED * (end - begin)
    first, then, last = ((-k1 + np.sqrt(k1**2 + 4 * k2 * (f - k0))) / (2 * k2) for f in (begin, level, end))
    return float(vehicle.motor_time_constant * np.log((last - first) / (last - then)))


def _spin(session: AirSimSession, start: RigidState, throttle: float) -> None:
    """Bring the rotors to the speed of a throttle, and put the vehicle at rest at a place."""
    session.place(start)
    hold(session, _STILL, throttle, SPUN_S)
    session.place(start)


def _acceleration(session: AirSimSession, rates: np.ndarray, throttle: float) -> np.ndarray:
    """Mean acceleration over a few physics steps, world, m/s^2.

    The first steps do not count. In its first step AirSim averages the acceleration with the previous one, which does
    not exist for a vehicle that has just been placed.
    """
    hold(session, rates, throttle, LONG_S / 4)
    before = session.state().velocity
    passed = hold(session, rates, throttle, LONG_S / 2)
    return (session.state().velocity - before) / passed


def _lag(session: AirSimSession, start: RigidState, hover: float) -> float:
    """Time after which thrust has followed 63 % of a step from hover, s."""
    _spin(session, start, hover)
    more, times, thrusts, passed = _SHARE + (1 - _SHARE) * hover, [0.0], [0.0], 0.0
    speed = session.state().velocity[2]
    while passed < SPUN_S:
        session.command(_STILL, more)
        if not (seconds := session.advance(session.step)):
            continue  # AirSim has gone one step too far
        now = session.state().velocity[2]
        times.append(passed + seconds / 2)
        thrusts.append((now - speed) / seconds)
        passed, speed = passed + seconds, now
    level = _FOLLOWED * float(np.mean(thrusts[-5:]))
    first = next(i for i, thrust in enumerate(thrusts) if thrust >= level)
    before, after = thrusts[first - 1], thrusts[first]
    return float(times[first - 1] + (times[first] - times[first - 1]) * (level - before) / (after - before))


def _bandwidth(session: AirSimSession, axis: np.ndarray, hover: float, lag: float) -> float:
    """Bandwidth K of the rate loop about an axis, 1/s, from the decay of the rate error after a rate command.

    With a first-order lag T of the rotors, the decay rate is the slower root p of T p^2 - p + K = 0.
    """
    hold(session, _RATE * axis, hover, 0.2)
    early = _RATE - float(axis @ session.state().body_rate)
    passed = hold(session, _RATE * axis, hover, 0.1)
    late = _RATE - float(axis @ session.state().body_rate)
    pole = float(np.log(early / late) / passed) if early > late > 0 else float("nan")
    return pole - lag * pole**2

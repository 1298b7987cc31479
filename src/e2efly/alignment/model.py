"""The model of the fit: the unknown parameters of a vehicle, and the simulation of a window of a flight with them."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.alignment.windows import STEP, past_steps
from e2efly.control import COMMAND_MODES, Vec3
from e2efly.control.vectors import Quat
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import drag, met, rotor_speed_for, rotor_thrust, rotor_wrench
from e2efly.simulation.physics.control import control_law
from e2efly.simulation.physics.integrate import INTEGRATORS, ahead
from e2efly.simulation.physics.mixer import Mixer
from e2efly.simulation.physics.state import Parts, State, split
from e2efly.vehicles.vehicle import Vehicle, quantities, terms


@dataclass(frozen=True)
class Unknown:
    """One number that the fit estimates. Zero means the value of the vehicle file."""

    name: str
    field: str
    """Field of the vehicle. Empty for a number that is not in the vehicle file."""
    entries: tuple[int, ...]
    """Entries of the field that it changes together. Empty: all entries."""
    prior: float
    """Prior standard deviation, before any flight: of the logarithm, or in the field's unit if it is added."""
    drivers: tuple[str, ...]
    """The drivers (`Model.driver`) with which a flight can show it."""
    fly: str
    """What to fly and to log if it cannot be found."""
    added: bool = False
    """Whether it is added to the value of the file, in place of the logarithm of a factor on it."""

    def absent(self, base: Vehicle) -> bool:
        """Whether it is an effect that the vehicle file does not have."""
        return self.field != "" and getattr(base, self.field) is None


_TURNS = ("command", "motor", "rotor_speed")
_ALL = (*_TURNS, "motor_and_rate")
_MOTORS = ("motor", "motor_and_rate")
_RATES = "doublets of body rate about this axis, with rotor speeds or motor outputs in the log"
_FAST = "fast straight flight (5 m/s and more), with velocity and attitude in the log"
_CLIMB = "changes of thrust between half and twice of hover, with the accelerometer in the log"
_YAW = "steps of yaw rate, with rotor speeds or motor outputs in the log"
_STEPS = "steps of thrust and body rate, logged at 200 Hz or more, with the times at which commands were sent"
UNKNOWNS: tuple[Unknown, ...] = (
    Unknown("thrust", "thrust_map", (), 0.5, _ALL, _CLIMB),
    Unknown("torque_ratio", "torque_ratio", (), 0.5, ("command", "motor"), _YAW),
    Unknown("inertia_x", "inertia", (0,), 0.5, _TURNS, _RATES),
    Unknown("inertia_y", "inertia", (1,), 0.5, _TURNS, _RATES),
    Unknown("inertia_z", "inertia", (2,), 0.5, _TURNS, _RATES),
    Unknown("motor_time_constant", "motor_time_constant", (), 0.7, ("command", *_MOTORS), _STEPS),
    Unknown("drag_linear_x", "drag_linear", (0,), 1.0, _ALL, _FAST),
    Unknown("drag_linear_y", "drag_linear", (1,), 1.0, _ALL, _FAST),
    Unknown("drag_linear_z", "drag_linear", (2,), 1.0, _ALL, _FAST),
    Unknown("drag_quadratic_x", "drag_quadratic", (0,), 1.0, _ALL, _FAST),
    Unknown("drag_quadratic_y", "drag_quadratic", (1,), 1.0, _ALL, _FAST),
    Unknown("drag_quadratic_z", "drag_quadratic", (2,), 1.0, _ALL, _FAST),
    Unknown("rate_gain_x", "rate_gain", (0,), 0.7, ("command",), _RATES),
    Unknown("rate_gain_y", "rate_gain", (1,), 0.7, ("command",), _RATES),
    Unknown("rate_gain_z", "rate_gain", (2,), 0.7, ("command",), _RATES),
    Unknown("motor_curve", "", (), 0.3, _MOTORS, _CLIMB),
    Unknown("motor_idle", "", (), 0.15, _MOTORS, _CLIMB),
    Unknown("rotor_inertia", "", (), 0.3, ("motor",), _YAW),
    Unknown("latency", "latency", (), 0.05, ("command", *_MOTORS), _STEPS, added=True),
    Unknown("centre_of_mass_x", "centre_of_mass", (0,), 0.005, ("rotor_speed",), _RATES, added=True),
    Unknown("centre_of_mass_y", "centre_of_mass", (1,), 0.005, ("rotor_speed",), _RATES, added=True),
    Unknown("inertia_xy", "inertia_products", (0,), 1e-4, ("rotor_speed",), _RATES, added=True),
    Unknown("inertia_xz", "inertia_products", (1,), 1e-4, ("rotor_speed",), _RATES, added=True),
    Unknown("inertia_yz", "inertia_products", (2,), 1e-4, ("rotor_speed",), _RATES, added=True),
)  # fmt: skip
"""Unknowns of the vehicle. Most are the logarithm of a factor on the value of the vehicle file. These are added
instead: the delay, s; the curve of the motors (the part of the thrust that rises with the square of the output); the
fraction of the largest thrust at zero output; and the rotors' inertia. The inertia is given by the yaw rate, rad/s,
that the vehicle gains when all rotors of one spin direction gain the speed of hover, divided by ten."""
FROM_ZERO = {"drag_linear": 0.3, "drag_quadratic": 0.1}
"""Where the vehicle file has no drag (zero), the unknown is not a factor on it but the drag itself, never negative, in
this unit times the mass, 1/s and 1/m."""
NUISANCES: tuple[tuple[str, float], ...] = (
    ("gyro_x", 0.05), ("gyro_y", 0.05), ("gyro_z", 0.05), ("force_x", 0.5), ("force_y", 0.5), ("force_z", 0.3),
    ("pose_delay", 0.05), ("tilt_x", 0.03), ("tilt_y", 0.03), ("sag", 0.1), ("flight_thrust", 0.03),
    ("uneven_roll", 0.1), ("uneven_pitch", 0.1), ("uneven_yaw", 0.1), ("accelerometer_filter", 0.7), ("wind_x", 0.5),
    ("wind_y", 0.5),
)  # fmt: skip
"""Nuisance parameters of each flight, with the standard deviation of their priors, in this order: biases of gyroscope
(rad/s) and accelerometer (m/s^2); delay of the pose source (s); tilt of the pose source's body axes (rad); fraction of
the thrust that is lost by the end of the flight; logarithm of a factor on the thrust of this flight, if there are
several flights; fraction by which the rotors on the left, at the rear, and with positive spin pull more than the others
(worn propellers, or a centre of mass that is not in the middle); logarithm of the accelerometer filter's time constant
divided by `FORCE_FILTER`."""
UNITS = {"gyro": "rad/s", "force": "m/s^2", "pose": "s", "tilt": "rad", "wind": "m/s"}
"""Units of the nuisances by the first word of their names. All others have the unit 1."""
GYRO, FORCE, POSE_DELAY, TILT, LOST, FACTOR = slice(0, 3), slice(3, 6), 6, slice(7, 9), 9, 10
UNEVEN, FILTERED, WIND = slice(11, 14), 14, slice(15, 17)
"""Indices in `NUISANCES`: of the biases, of the poses' delay and tilt, of the changes of the thrust, of the
accelerometer's filter, and of the wind."""
FORCE_FILTER = 0.011
"""Time constant of each of the two stages with which a flight controller filters its accelerometer, s. Together they
have the same delay as Betaflight's own 10 Hz filter. Without this filter, a fit would find a thrust that rises less
with the motor outputs."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Model:
    """What is known before the fit, and what drives the simulated vehicle."""

    base: Vehicle
    """The vehicle at which all unknowns are zero."""
    believed: Vehicle
    """The vehicle that the flight controller of the flights assumes."""
    mixer: Mixer
    """The mixer of the flight controller."""
    hover: float | Array
    """Rotor speed of hover, rad/s."""
    driver: str = dataclasses.field(metadata={"static": True})
    """The stream that drives the simulation: command, motor or rotor_speed. With motor_and_rate, motor outputs drive
    the rotors, and the body turns with the measured rates, whatever torques the rotors produce."""
    names: tuple[str, ...] = dataclasses.field(metadata={"static": True})
    """Names of the unknowns that are estimated."""

    @staticmethod
    def of(vehicle: Vehicle, driver: str, believed: Vehicle | None = None, only: tuple[str, ...] = ()) -> "Model":
        """The model of a vehicle that a stream drives.

        `believed` is the vehicle that its flight controller assumes; if omitted, the same vehicle. `only` names the
        unknowns to estimate; if omitted, they are all that the flights can show.
        """
        believed = vehicle if believed is None else believed
        base, told = (jax.tree.map(lambda x: np.asarray(x, np.float64), v) for v in (vehicle, believed))
        names = tuple(u.name for u in UNKNOWNS if _shows(u, base, driver) and (not only or u.name in only))
        return Model(base, told, Mixer.of(believed, np.float64), vehicle.hover_rotor_speed, driver, names)

    @property
    def start(self) -> int:
        """Length of a window's start: position, velocity, attitude, body rate, rotor speeds (relative to that of
        hover).
        """
        return 12 + self.base.rotor_count

    @property
    def width(self) -> int:
        """Number of the numbers that drive the vehicle, without body rates: of a command, or of its rotors."""
        return 4 if self.driver == "command" else self.base.rotor_count

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The unknowns that are estimated."""
        return tuple(u for u in UNKNOWNS if u.name in self.names)

    def controller(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle that the flight controller uses: the rate gains of `vehicle`, everything else as `believed`."""
        return dataclasses.replace(self.believed, rate_gain=vehicle.rate_gain)


def _shows(unknown: Unknown, base: Vehicle, driver: str) -> bool:
    """Whether flights with this driver can show an unknown. A factor on a value of zero has no effect."""
    if driver not in unknown.drivers:
        return False
    return unknown.added or unknown.field in ("", *FROM_ZERO) or not _is_zero(base, unknown)


def from_zero(base: Vehicle, unknowns: Sequence[Unknown]) -> np.ndarray:
    """The unit of each unknown that is a drag which the file has as zero, (u,), in the unit of its field. Else 0."""
    units = [FROM_ZERO.get(u.field, 0.0) * float(base.mass) for u in unknowns]
    return np.where([u.field in FROM_ZERO and _is_zero(base, u) for u in unknowns], units, 0.0)


def _is_zero(base: Vehicle, unknown: Unknown) -> bool:
    value = np.asarray(value_of(base, unknown.field))
    return not np.any(value[list(unknown.entries)] if unknown.entries else value)


def vehicle_of(base: Vehicle, unknowns: Sequence[Unknown], p: Array) -> Vehicle:
    """The vehicle for these values of its unknowns, (u,)."""
    changed: dict[str, Any] = {}
    for unknown, x in zip(unknowns, p, strict=True):
        if not unknown.field:
            continue
        value = jnp.asarray(changed.get(unknown.field, value_of(base, unknown.field)))
        moved = np.isin(np.arange(value.shape[-1]), unknown.entries) if unknown.entries else np.ones(value.shape, bool)
        by = jnp.where(moved, x, 0.0)
        new = value + by if unknown.added else value * jnp.exp(by)
        if unknown.field in FROM_ZERO:
            new = jnp.where(moved & (value == 0), FROM_ZERO[unknown.field] * base.mass * x, new)
        changed[unknown.field] = new
    return dataclasses.replace(base, **changed)


def value_of(vehicle: Vehicle, field: str) -> Any:
    """The value of a field. Terms that the vehicle file does not have: rotors slow down as they speed up; all others
    are zero.
    """
    value = getattr(vehicle, field)
    if value is None and field == "motor_time_constant_down":
        value = vehicle.motor_time_constant
    shape = next(f.metadata["shape"] for f in (*quantities(), *terms()) if f.name == field)
    return np.zeros(shape) if value is None else value


def shares(model: Model, q: Array, when: Array) -> Array:
    """Thrust of each rotor over that of the thrust map, (N,), in a window that begins at this fraction of a flight."""
    x, y = jnp.sign(model.base.rotor_position[:, :2]).T
    sides = jnp.stack([y, -x, jnp.asarray(model.base.rotor_spin)])
    return jnp.exp(q[FACTOR]) * (1 - q[LOST] * when) * (1 + q[UNEVEN] @ sides)


def wind_of(q: Array) -> Vec3:
    """The mean wind of a flight, world, m/s."""
    return Vec3(q[WIND][0], q[WIND][1], 0.0 * q[0])


def simulate(model: Model, p: Array, q: Array, start: Array, window: dict[str, Any]) -> dict[str, Array]:
    """The simulated sensor readings in a window, by stream, (m + 1, k).

    Args:
        model: the model to simulate.
        p: unknowns of the vehicle, (u,).
        q: nuisances of the flight, (len(NUISANCES),).
        start: correction that is added to the measured start of the window, (`model.start`,).
        window: `driven`, `when` and the measured start: position, velocity, quaternion, body_rate, rotor_speed.
    """
    vehicle = vehicle_of(model.base, model.unknowns, p)
    plant = Airframe.of(vehicle, STEP, shares(model, q, window["when"]))
    delay = 0.0 if model.driver == "rotor_speed" else vehicle.latency
    before, acting = commanded(delay, window["driven"])
    places = {unknown.name: i for i, unknown in enumerate(model.unknowns)}
    added = {
        name: p[places[name]] if name in places else 0.0 for name in ("motor_curve", "motor_idle", "rotor_inertia")
    }
    spun, earlier = window["rotor_speed"], None
    if model.driver in _MOTORS:  # the start speeds were not measured: simulate them from the outputs before the start
        earlier = _spinning(plant, jnp.stack(_driven_speed(model, split(before[:, : model.width]), added), -1))
        spun = earlier[-1]
    first = State(
        window["position"] + start[:3],
        window["velocity"] + start[3:6],
        turned(window["quaternion"], start[6:9]),
        window["body_rate"] + start[9:12],
        spun + start[12:] * model.hover,
    )
    law, integrate = control_law(COMMAND_MODES["ctbr"]), INTEGRATORS["rk3"]
    controller = model.controller(vehicle)

    def advance(parts: Parts, drive: Array) -> tuple[Parts, Parts]:
        drives = split(drive[: model.width])
        if model.driver == "rotor_speed":
            parts = dataclasses.replace(parts, rotor_speed=drives)
            parts = integrate(plant, parts, drives, None, STEP)
        elif model.driver == "motor":
            parts = _recoiled(
                model, integrate(plant, parts, _driven_speed(model, drives, added), None, STEP), parts, added
            )
        elif model.driver == "motor_and_rate":
            parts = dataclasses.replace(parts, body_rate=Vec3.of(drive[model.width :] - q[GYRO]))
            parts = integrate(_without_torque(plant), parts, _driven_speed(model, drives, added), None, STEP)
        else:
            middle, _ = ahead(plant, parts, None, STEP)
            parts = integrate(plant, parts, law(controller, model.mixer, middle, drives, None), None, STEP)
        return parts, parts

    begin = Parts.of(first)
    if model.driver == "rotor_speed":
        begin = dataclasses.replace(begin, rotor_speed=split(acting[0]))
    _, later = jax.lax.scan(advance, begin, acting)
    whole = jax.tree.map(lambda a, b: jnp.concatenate([jnp.asarray(a)[None], b]), begin, later)
    return _sensed(plant, whole, q, earlier if model.driver == "motor" else None)


def _spinning(plant: Airframe, asked: Array) -> Array:
    """Rotor speeds, (t, N), that follow the requested speeds of each step with a first-order lag. They begin at the
    first requested speeds.
    """

    def follow(speed: Array, wanted: Array) -> tuple[Array, Array]:
        speed = wanted + (speed - wanted) * plant.decay
        return speed, speed

    return jax.lax.scan(follow, asked[0], asked)[1]


def _filtered(force: Array, q: Array) -> Array:
    """A force, (t,), after the accelerometer's filter."""
    kept = jnp.exp(-STEP / (FORCE_FILTER * jnp.exp(q[FILTERED])))

    def follow(stages: tuple[Array, Array], value: Array) -> tuple[tuple[Array, Array], Array]:
        first = value + (stages[0] - value) * kept
        second = first + (stages[1] - first) * kept
        return (first, second), second

    return jax.lax.scan(follow, (force[0], force[0]), force)[1]


def _driven_speed(model: Model, output: tuple[Array, ...], added: dict[str, Any]) -> Any:
    """Rotor speeds for motor outputs. The thrust rises from its value at zero output, with a linear and a quadratic
    part.
    """
    top, idle, curve = model.mixer.thrust_max, added["motor_idle"], 0.5 + added["motor_curve"]

    def thrust(u: Array) -> Array:
        return jnp.maximum(top * (idle + (1 - idle) * u * ((1 - curve) + curve * jnp.abs(u))), model.mixer.thrust_min)

    return rotor_speed_for(model.base, tuple(thrust(u) for u in output))


def _without_torque(plant: Airframe) -> Airframe:
    zero, one = jnp.zeros_like(plant.torque_ratio), jnp.ones_like(plant.specific)
    arms, ones = (zero,) * len(plant.spin), Vec3(one, one, one)
    return dataclasses.replace(plant, arm_x=arms, arm_y=arms, torque_ratio=zero, inertia=ones, mobility=ones)


def _recoiled(model: Model, now: Parts, before: Parts, added: dict[str, Any]) -> Parts:
    """The state after a step, with the yaw rate that the rotors' inertia gives the body when their speeds change."""
    gained = jnp.stack(now.rotor_speed) - jnp.stack(before.rotor_speed)
    rate = now.body_rate
    turned = 10 * added["rotor_inertia"] * (gained @ model.base.rotor_spin) / (model.base.rotor_count / 2 * model.hover)
    return dataclasses.replace(now, body_rate=Vec3(rate.x, rate.y, rate.z + turned))


def commanded(delay: Array | float, driven: Array) -> tuple[Array, Array]:
    """The mean command that acts in each step, a delay, s, after it was sent: (past, k) before the window, and (m, k)
    in it. `driven` is the integral of the commands.

    Commands from before the window's past are assumed to be the same as at its beginning.
    """
    place = jnp.arange(driven.shape[0]) - delay / STEP
    below = jnp.clip(jax.lax.stop_gradient(jnp.floor(place)).astype(int), 0, driven.shape[0] - 2)
    part = (place - below)[:, None]
    integral = driven[below] * (1 - part) + driven[below + 1] * part
    mean = jnp.diff(integral, axis=0) / STEP
    return mean[: past_steps()], mean[past_steps() :]


def _sensed(plant: Airframe, parts: Parts, q: Array, earlier: Array | None = None) -> dict[str, Array]:
    """The simulated sensor readings. The accelerometer passes its filter if the earlier rotor speeds, (past, N), are
    known.
    """
    collective, _ = rotor_wrench(plant, met(plant, rotor_thrust(plant, parts.rotor_speed), parts, None))
    felt = collective
    if earlier is not None:
        before, _ = rotor_wrench(plant, rotor_thrust(plant, split(earlier)))
        felt = _filtered(jnp.concatenate([before, collective]), q)[len(earlier) :]
    air = drag(plant, parts.attitude.unrotate(parts.velocity))
    force = Vec3(air.x, air.y, air.z + collective).stack() * plant.specific
    rate, velocity = parts.body_rate.stack(), parts.velocity.stack()
    # a pose that arrives late is the pose of a slightly earlier time
    late = q[6]
    turn = jnp.stack([q[7], q[8], jnp.zeros_like(q[7])]) - rate * late
    accelerated = parts.attitude.rotate(Vec3.of(force)).stack() - jnp.array([0.0, 0.0, 9.81])
    return {
        "body_rate": rate + q[0:3],
        "specific_force": Vec3(air.x, air.y, air.z + felt).stack() * plant.specific + q[3:6],
        "rotor_speed": jnp.stack(parts.rotor_speed, -1),
        "velocity": velocity - accelerated * late,
        "quaternion": turned(parts.attitude.stack(), turn),
        "position": parts.position.stack() - velocity * late,
    }


def turned(quaternion: Array, angle: Array) -> Array:
    """An attitude, (*n, 4), rotated by a small angle about its own axes, (*n, 3) rad."""
    return Quat.of(quaternion).turned(Vec3.of(angle)).stack()


def attitude_error(measured: Array, simulated: Array) -> Array:
    """The small angle from one attitude to the other, about body axes, rad, (..., 3)."""
    away = Quat.of(measured).conjugate().compose(Quat.of(simulated)).stack()
    return 2 * away[..., 1:] * jnp.where(away[..., :1] < 0, -1.0, 1.0)

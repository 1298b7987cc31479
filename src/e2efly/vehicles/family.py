"""Families of vehicles: ranges from a TOML file, and the laws that draw vehicles within them. Imports no JAX.

The laws are one function from uniform numbers to a `Vehicle`. It computes in the library of these numbers: NumPy
numbers give one vehicle for a file or a test, JAX numbers give a batch for the episodes of a training. The formulae and
their sources are in docs/any-vehicle.md.
"""

import dataclasses
import hashlib
import json
import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.domain import Domain, Extent
from e2efly.config.tables import read_table
from e2efly.vehicles import rotor_frames
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import FAMILIES, OF_FAMILIES, load_vehicle, read_values, vehicle_file
from e2efly.vehicles.rotor_frames import Range
from e2efly.vehicles.vehicle import Vehicle, quantities, rotor_arms, rotor_axes
from e2efly.vehicles.vehicle_domain import misfits

DRAWN = 20
"""Number of uniform random numbers that define a quadrotor."""

_ARM_OF_KILOGRAM = 0.12
"""Arm of a typical quadrotor of 1 kg, m. The arm grows with the cube root of the mass, from the Crazyflie to 5-inch
racers."""
_ARM_SPREAD = 1.7
"""Largest factor on this arm. The smallest factor is one divided by it."""
_COMMANDED = 6.0
"""Largest collective thrust that a policy commands, divided by the weight, whatever more a vehicle has. With a wider
range of commands, small ones would be less precise."""
_RINGING = 4.0
"""Largest product of rate gain and motor lag that is drawn. It gives a damping ratio of 1 / (2 sqrt(4)) = 0.25."""
_AIR = 1.225
"""Density of air, kg/m^3: the standard atmosphere at sea level."""
_SPIN = (1.0, -1.0, -1.0, 1.0)


def _range(unit: str, at_least: float | None = None, above: float | None = None, high: float = math.inf) -> Any:
    """Smallest and largest value of a quantity, with the bounds that both must satisfy."""
    entry = {"unit": unit, "shape": (2,), "at_least": None, "above": None}
    return dataclasses.field(metadata=entry | {"from": at_least, "beyond": above, "high": high})


def _of_frames(unit: str, at_least: float, high: float) -> Any:
    """A range that a family of quadrotors does not have."""
    return dataclasses.field(default=None, metadata=_range(unit, at_least, high=high).metadata)


@dataclass(frozen=True)
class Ranges:
    """The ranges of a family's vehicles: the smallest and largest value of each quantity."""

    mass: Range = _range("kg", above=0.0)
    """Mass."""
    arm: Range = _range("m", above=0.0)
    """Largest distance of a rotor from the centre of mass."""
    thrust_to_weight: Range = _range("1", above=1.05, high=20.0)
    """Largest collective thrust divided by weight. A vehicle with less than the lower bound cannot hover."""
    motor_time_constant: Range = _range("s", above=0.0)
    """Time constant of the rotors."""
    rate_gain: Range = _range("1/s", above=0.0)
    """Gain of the rate loop for roll and pitch."""
    yaw_gain: Range = _range("1/s", above=0.0)
    """Gain of the rate loop for yaw."""
    roll_rate_max: Range = _range("rad/s", above=0.0)
    """Largest roll and pitch rate that the flight controller accepts. A policy commands no more than the upper end of
    this range, even if a vehicle accepts more."""
    yaw_rate_max: Range = _range("rad/s", above=0.0)
    """The same for yaw."""
    latency: Range = _range("s", at_least=0.0, high=1.0)
    """Time from the observation to the arrival of the command at the rate loop."""
    inertia_ratio: Range = _range("1", above=0.0)
    """Roll and pitch inertia divided by mass times squared arm."""
    torque_ratio: Range = _range("1", above=0.0)
    """Yaw torque of a rotor divided by its thrust and by the arm."""
    drag_linear: Range = _range("1/s", at_least=0.0)
    """Linear drag divided by mass, for each axis."""
    drag_quadratic: Range = _range("1/m", at_least=0.0)
    """Quadratic drag divided by mass, for each axis."""
    control_rate: Range = _range("Hz", at_least=0.1, high=10_000.0)
    """Rate at which the policy is called. Both ends of the range are the same number."""
    rotors: Range | None = _of_frames("1", 4.0, rotor_frames.MOST)
    """Number of rotors. This range and the two below are given together, or all are None: four level rotors that lie
    symmetrically."""
    tilt: Range | None = _of_frames("rad", 0.0, math.pi / 4)
    """Largest angle between a rotor's axis and body z."""
    lopsided: Range | None = _of_frames("1", 0.0, 0.3)
    """Distance of the rotors' mean place from the centre of mass along body x and y, the larger of the two, divided by
    the arm."""

    @property
    def given(self) -> dict[str, Range]:
        """The ranges that are not None, by name."""
        return {name: value for name, value in dataclasses.asdict(self).items() if value is not None}

    @property
    def hash(self) -> str:
        """First 16 hex digits of the SHA-256 of all ranges."""
        return hashlib.sha256(json.dumps(self.given, sort_keys=True).encode()).hexdigest()[:16]

    def check(self, where: str) -> None:
        """Check each range, and that vehicles can be drawn within all of them.

        Raises:
            ValueError: naming the range, its values and what is accepted.
        """
        if 0 < sum(name in self.given for name in OF_FRAMES) < len(OF_FRAMES):
            raise ValueError(f"{where}: {', '.join(OF_FRAMES)} are not all given; accepted: all three, or none")
        for known in (f for f in dataclasses.fields(self) if f.name in self.given):
            low, high = getattr(self, known.name)
            least, above, most = (known.metadata[key] for key in ("from", "beyond", "high"))
            if not ((low >= least if above is None else low > above) and low <= high <= most):  # also false for NaN
                bottom = f"of at least {least:g}" if above is None else f"above {above:g}"
                top = f", at most {most:g}" if math.isfinite(most) else ""
                hovers = ": no other vehicle can hover" if known.name == OF_FAMILIES else ""
                raise ValueError(
                    f"{where}: {known.name} is {[low, high]} {known.metadata['unit']}; accepted: two rising numbers "
                    f"{bottom}{top}{hovers}"
                )
        if self.control_rate[0] != self.control_rate[1]:
            raise ValueError(f"{where}: control_rate is {list(self.control_rate)} Hz; accepted: one rate, twice")
        if self.rate_gain[0] * self.motor_time_constant[1] > _RINGING:
            raise ValueError(
                f"{where}: rate_gain begins at {self.rate_gain[0]} 1/s and motor_time_constant ends at "
                f"{self.motor_time_constant[1]} s; accepted: a product of at most {_RINGING:g}, above which such a "
                "rate loop rings"
            )

    @property
    def domain(self) -> Domain:
        """The ranges of what a vehicle file has: all but the control rate, which belongs to the policy."""
        known = [f for f in dataclasses.fields(self) if f.name != "control_rate" and f.name in self.given]
        return tuple(Extent(f.name, f.metadata["unit"], *getattr(self, f.name)) for f in known)

    def outside(self, vehicle: Vehicle) -> tuple[str, ...]:
        """The quantities in which a vehicle lies outside the ranges, as text: quantity, value and what is accepted."""
        return misfits(self.domain, self.domain_of(vehicle), vehicle.name)

    def domain_of(self, vehicle: Vehicle) -> Domain:
        """The quantities of these ranges that a loaded vehicle has."""
        values = measured(vehicle)
        return tuple(Extent(x.name, x.unit, min(values[x.name]), max(values[x.name])) for x in self.domain)


OF_FRAMES = tuple(f.name for f in dataclasses.fields(Ranges) if f.default is None)
"""The ranges that only families of frames with several rotors have."""


def measured(vehicle: Vehicle) -> dict[str, tuple[float, ...]]:
    """The quantities of `Ranges` for a loaded vehicle, except the control rate, which belongs to the policy."""
    v = vehicle
    arm = float(np.linalg.norm(v.rotor_position, axis=1).max())
    return {
        "mass": (v.mass,),
        "arm": (arm,),
        "thrust_to_weight": (v.thrust_to_weight,),
        "motor_time_constant": (v.motor_time_constant,),
        "rate_gain": (float(v.rate_gain[0]), float(v.rate_gain[1])),
        "yaw_gain": (float(v.rate_gain[2]),),
        "roll_rate_max": (float(v.body_rate_max[0]), float(v.body_rate_max[1])),
        "yaw_rate_max": (float(v.body_rate_max[2]),),
        "latency": (v.latency,),
        "inertia_ratio": tuple(float(j) / (v.mass * arm**2) for j in v.inertia[:2]),
        "torque_ratio": (v.torque_ratio / arm,),
        "drag_linear": tuple(float(k) / v.mass for k in v.drag_linear),
        "drag_quadratic": tuple(float(k) / v.mass for k in v.drag_quadratic),
        "rotors": (float(v.rotor_count),),
        "tilt": (float(np.arccos(np.clip(rotor_axes(v)[:, 2], -1.0, 1.0)).max()),),
        "lopsided": (float(np.abs(rotor_arms(v).mean(0)).max()) / arm,),
    }


@dataclass(frozen=True)
class Family:
    """Vehicles that a policy is trained for together."""

    name: str
    """The stem of its file name."""
    ranges: Ranges
    straightened: bool = True
    """Whether frames of several rotors that do not hover are straightened until they do (`rotor_frames.hovers`)."""

    @property
    def hash(self) -> str:
        """The hash of its ranges. The laws are the same for all families."""
        return self.ranges.hash

    @property
    def drawn(self) -> int:
        """Number of uniform random numbers that define a vehicle."""
        return DRAWN if self.ranges.rotors is None else DRAWN + rotor_frames.DRAWN

    @cached_property
    def middle(self) -> Vehicle:
        """The vehicle in the middle of all draws, float64, as if loaded. Its latency is the middle of its range."""
        return _loaded(self.draw(np.full(self.drawn, 0.5)), self.name)

    def sample(self, count: int, seed: int) -> list[Vehicle]:
        """Draw `count` vehicles, each as if loaded from a file of its own, float64."""
        drawn = np.random.default_rng(seed).random((count, self.drawn))
        return [_loaded(self.draw(u), f"{self.name}_{i}") for i, u in enumerate(drawn)]

    def draw(self, u: Any) -> Vehicle:
        """The vehicle that belongs to given uniform numbers. The numbers are (*n, `drawn`), uniform in [0, 1), from
        NumPy or JAX.

        Returns:
            The vehicle. Each field has the leading axes *n. Its largest commanded rates are within the ranges. Its
            gains above the rate loop follow from the gain of that loop; a policy that commands rates does not use them.
            A family of frames draws `rotor_frames.MOST` rotors, of which those that are absent have an axis of zero.
        """
        r, xp = self.ranges, u.__array_namespace__() if hasattr(u, "__array_namespace__") else np
        (
            mass, spread, corner, strong, lag, quick, yaw_quick, turn, yaw_turn, late, heavy, slim, flat, size, torque,
            tip, curve, linear, quadratic, upright,
        ) = (u[..., i] for i in range(DRAWN))  # fmt: skip
        m = _log(xp, mass, r.mass)
        # mass grows with the cube of the size: V. Kumar and N. Michael, Opportunities and challenges with autonomous
        # micro aerial vehicles, 2012
        arm = _ARM_OF_KILOGRAM * xp.cbrt(m) * _log(xp, spread, (1 / _ARM_SPREAD, _ARM_SPREAD))
        arm = xp.clip(arm, *r.arm)
        angle = _between(corner, (math.radians(35), math.radians(55)))
        forward, left = arm * xp.cos(angle), arm * xp.sin(angle)
        places = xp.stack(
            [xp.stack([x * forward, y * left], axis=-1) for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1))], axis=-2
        )
        # the radius of a propeller: neighbouring rotors are at most 1.41 arms apart, and the tip moves at Mach 0.2 to
        # 0.5
        radius = arm * _between(size, (0.35, 0.68))
        full = _between(tip, (60.0, 180.0)) / radius
        top = _log(xp, strong, r.thrust_to_weight) * m * GRAVITY / 4
        share = _between(curve, (0.1, 0.3))  # share of the thrust at full speed that grows linearly
        thrust_map = xp.stack([(1 - share) * top / full**2, share * top / full, 0 * top], axis=-1)
        time = _log(xp, lag, r.motor_time_constant)
        fastest = xp.clip(_RINGING / time, r.rate_gain[0], r.rate_gain[1])
        gain = r.rate_gain[0] * (fastest / r.rate_gain[0]) ** quick
        yaw_gain = xp.clip(gain * _between(yaw_quick, (0.25, 1.0)), *r.yaw_gain)
        rate, yaw_rate = _between(turn, r.roll_rate_max), _between(yaw_turn, r.yaw_rate_max)
        # the ratio would be 0.5 with all mass at the rotors, and almost 0 with all mass in the middle
        roll = _log(xp, heavy, r.inertia_ratio)
        pitch = xp.clip(roll * _log(xp, slim, (0.8, 1.25)), *r.inertia_ratio)
        inertia = xp.stack([roll, pitch, (roll + pitch) * _between(flat, (0.6, 0.98))], axis=-1)
        inertia = inertia * (m * arm**2)[..., None]
        # blade flapping and induced drag: M. Faessler et al., Differential flatness of quadrotor dynamics subject to
        # rotor drag, 2018; form drag of an area of 0 to 1.5 squared arms
        one = xp.ones_like(m)
        level = xp.stack([one, one, _between(upright, (1.0, 3.0))], axis=-1)
        form = xp.clip((0.75 * _AIR * quadratic * arm**2 / m)[..., None] * level, *r.drag_quadratic)
        flapping = xp.stack([one, one, _between(upright, (1.0, 1.3))], axis=-1)
        flapping = xp.clip(_between(linear, r.drag_linear)[..., None] * flapping, *r.drag_linear)
        three = xp.ones_like(inertia)
        slow = gain / 3
        quadrotor = Vehicle(
            name=self.name,
            mass=m,
            inertia=inertia,
            rotor_position=places,
            rotor_spin=xp.ones_like(places[..., 0]) * xp.asarray(_SPIN, places.dtype),
            thrust_map=thrust_map,
            torque_ratio=arm * _log(xp, torque, r.torque_ratio),
            rotor_thrust_max=top,
            rotor_speed_max=full,
            rotor_speed_min=full * 0.08,
            motor_time_constant=time,
            drag_linear=flapping * m[..., None],
            drag_quadratic=form * m[..., None],
            body_rate_max=xp.stack([rate, rate, yaw_rate], axis=-1),
            rate_gain=xp.stack([gain, gain, yaw_gain], axis=-1),
            attitude_gain=xp.stack([slow, yaw_gain / 4], axis=-1),
            velocity_gain=three * (slow / 3)[..., None],
            position_gain=three * (slow / 9)[..., None],
            tilt_max=0.8 * one,
            acceleration_max=6.0 * three,
            speed_max=3.0 * three,
            control_rate=r.control_rate[0] * one,
            latency=_between(late, r.latency),
            feet_height=0.5 * arm,
            radius=arm + radius,
        )
        return quadrotor if r.rotors is None else self._framed(xp, u[..., DRAWN:], arm, quadrotor)

    def _framed(self, xp: Any, u: Any, arm: Any, vehicle: Vehicle) -> Vehicle:
        """A drawn quadrotor with the rotors of a drawn frame in place of its four. Its thrust over the weight, and all
        else, stays.
        """
        rotors, tilt, lopsided = (self.ranges.given[name] for name in OF_FRAMES)
        strength, torque_ratio = 4 * vehicle.rotor_thrust_max / (vehicle.mass * GRAVITY), vehicle.torque_ratio / arm

        def hovers(frame: rotor_frames.RotorFrame) -> Any:
            return rotor_frames.hovers(xp, frame, strength, torque_ratio)

        frame = rotor_frames.draw(xp, u, rotors, tilt, lopsided, hovers if self.straightened else None)
        share = 4 / frame.axis[..., 2].sum(-1)
        return dataclasses.replace(
            vehicle,
            rotor_position=frame.place * arm[..., None, None],
            rotor_axis=frame.axis,
            rotor_spin=frame.spin,
            thrust_map=vehicle.thrust_map * share[..., None],
            rotor_thrust_max=vehicle.rotor_thrust_max * share,
            mixer="qp",
        )

    def limits(self, command_mode: str) -> tuple[list[float], list[float]]:
        """Smallest and largest command, the same for every vehicle of the family.

        A vehicle follows a command as far as it can.

        Raises:
            ValueError: for a command mode in which the same command has different meanings for different vehicles.
        """
        r = self.ranges
        if command_mode == "ctbr":
            rates = [r.roll_rate_max[1], r.roll_rate_max[1], r.yaw_rate_max[1]]
            return [0.0, *(-x for x in rates)], [min(r.thrust_to_weight[1], _COMMANDED) * GRAVITY, *rates]
        if command_mode in ("rotor_share", "rotor_speed") and r.rotors is None:
            return [0.0] * 4, [1.0] * 4
        rotors = ", 'rotor_share' or 'rotor_speed'" if r.rotors is None else ", as each has its own number of rotors"
        raise ValueError(f"env.command_mode is {command_mode!r}; accepted for vehicle {self.name!r}: 'ctbr'{rotors}")


def _between(u: Any, bounds: Range) -> Any:
    """Map u in [0, 1) to a uniform value between the bounds."""
    return bounds[0] + (bounds[1] - bounds[0]) * u


def _log(xp: Any, u: Any, bounds: Range) -> Any:
    """Map u in [0, 1) to a value between the bounds that is uniform in the logarithm."""
    low, high = math.log(bounds[0]), math.log(bounds[1])
    return xp.exp(low + (high - low) * u)


def _loaded(vehicle: Vehicle, name: str) -> Vehicle:
    """A vehicle without leading axes, as if read from a file: plain numbers in place of arrays without axes, and only
    the rotors that it has.
    """
    values = {f.name: getattr(vehicle, f.name) for f in quantities(vehicle)}
    if vehicle.rotor_axis is not None:
        has = rotor_frames.present(vehicle.rotor_axis)
        values |= {f.name: values[f.name][has] for f in quantities(vehicle) if "per_rotor" in f.metadata}
    plain: dict[str, Any] = {key: value if np.ndim(value) else float(value) for key, value in values.items()}
    return Vehicle(name=name, mixer=vehicle.mixer, **plain)


def family_names() -> list[str]:
    """Names of the families that the package ships."""
    return sorted(path.stem for path in FAMILIES.glob("*.toml"))


def load_family(name_or_path: str | Path) -> Family | None:
    """The family with this shipped name or TOML file. None if the file describes a single vehicle.

    Raises:
        ValueError: naming the file, the range, its value and what is accepted; or if there is no such file.
    """
    path = vehicle_file(name_or_path)
    table, where = read_table(path), str(path)
    if OF_FAMILIES not in table:
        return None
    values = read_values(table, dataclasses.fields(Ranges), where)
    ranges = Ranges(**{key: (float(low), float(high)) for key, (low, high) in values.items()})
    ranges.check(where)
    return Family(path.stem, ranges)


def nominal_vehicle(name_or_path: str | Path) -> Vehicle:
    """The vehicle with this name or file. For a family: the vehicle in the middle of all draws.

    Raises:
        ValueError: as for `load_family` and `load_vehicle`.
    """
    family = load_family(name_or_path)
    return load_vehicle(name_or_path) if family is None else family.middle

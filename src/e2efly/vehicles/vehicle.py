"""The vehicle: one frozen dataclass, read from a TOML file in which every value has a unit and a source.

Rotor order of a quadrotor is Betaflight's: rear right, front right, rear left, front left. With another number of
rotors, it is the order of the vehicle file. Body frame FLU.
"""

import dataclasses
import hashlib
import json
from dataclasses import dataclass, field
from typing import Any, Literal, cast, get_args

import numpy as np

from e2efly.vehicles.gravity import GRAVITY

Controller = Literal["policy", "plant"]
"""The vehicle for which the flight controller is tuned: the policy's own vehicle, or the vehicle that flies."""
MixerRule = Literal["shift", "betaflight", "qp"]
"""What a mixer does when a rotor would leave its limits. `shift`: scale down the torque, then shift the thrusts in the
proportions of pure thrust. `betaflight`: the same with one shift for all rotors, which is pure thrust only if the
centre of mass is in the middle. `qp`: the nearest wrench by weighted least squares."""
ROTOR_COUNTS = range(4, 17)
"""Accepted numbers of rotors. Fewer than four do not give independent thrust, roll, pitch and yaw."""


def quantity(unit: str, shape: tuple[int, ...] = (), at_least: float | None = None, above: float | None = None) -> Any:
    """A value of a vehicle file: its unit, its shape, and the bound that every entry must satisfy."""
    return field(metadata={"unit": unit, "shape": shape, "at_least": at_least, "above": above})


def _per_rotor(unit: str, components: tuple[int, ...] = ()) -> Any:
    """A value for each rotor: one number, or as many as one of `components`. Its `shape` is that of a quadrotor."""
    metadata = quantity(unit, (4, *components[:1])).metadata
    return field(metadata={**metadata, "per_rotor": components})


def _term(
    unit: str,
    shape: tuple[int, ...] = (),
    at_least: float | None = None,
    above: float | None = None,
    per_rotor: tuple[int, ...] | None = None,
) -> Any:
    """A value that a vehicle file may leave out. The physics then does not have the effect that it describes."""
    metadata = quantity(unit, shape, at_least, above).metadata
    return field(default=None, metadata=metadata if per_rotor is None else {**metadata, "per_rotor": per_rotor})


@dataclass(frozen=True)
class Vehicle:
    """Physical parameters of a multirotor with N rotors, float64 as loaded.

    In a simulation any field may have leading batch axes (one value per vehicle): mass `(*n,)`, inertia `(*n, 3)`.
    """

    name: str = field(metadata={"static": True})
    """The name of the vehicle: the stem of its file name."""
    mass: Any = quantity("kg", above=0.0)
    """Mass."""
    inertia: Any = quantity("kg*m^2", (3,), above=0.0)
    """Moments of inertia about the body axes. They are the whole inertia tensor if `inertia_products` is left out."""
    rotor_position: Any = _per_rotor("m", (2, 3))
    """Rotor positions in the body's x-y plane, (N, 2), or in space, (N, 3). Without a height they are in that plane."""
    rotor_spin: Any = _per_rotor("1")
    """Sign of each rotor's reaction torque about its axis, (N,)."""
    thrust_map: Any = quantity("N*s^2/rad^2, N*s/rad, N", (3,))
    """Thrust of a rotor = k2 W^2 + k1 W + k0 at rotor speed W, never below zero. Order: [k2, k1, k0]."""
    torque_ratio: Any = quantity("m", at_least=0.0)
    """Reaction torque of a rotor divided by its thrust."""
    rotor_thrust_max: Any = quantity("N", above=0.0)
    """Largest thrust of one rotor. The tighter one of this limit and `rotor_speed_max` applies."""
    rotor_speed_max: Any = quantity("rad/s", above=0.0)
    """Largest rotor speed."""
    rotor_speed_min: Any = quantity("rad/s", at_least=0.0)
    """Idle rotor speed."""
    motor_time_constant: Any = quantity("s", above=0.0)
    """Time constant of the first-order motor lag."""
    drag_linear: Any = quantity("N*s/m", (3,), at_least=0.0)
    """Drag divided by air-relative speed, per body axis."""
    drag_quadratic: Any = quantity("N*s^2/m^2", (3,), at_least=0.0)
    """Drag divided by the signed square of the air-relative speed, per body axis."""
    body_rate_max: Any = quantity("rad/s", (3,), above=0.0)
    """Largest commanded body rates."""
    rate_gain: Any = quantity("1/s", (3,), above=0.0)
    """Commanded angular acceleration divided by the body-rate error."""
    attitude_gain: Any = quantity("1/s", (2,), above=0.0)
    """Commanded body rate divided by the attitude error: [tilt, yaw]."""
    velocity_gain: Any = quantity("1/s", (3,), above=0.0)
    """Commanded acceleration divided by the velocity error, world axes."""
    position_gain: Any = quantity("1/s", (3,), above=0.0)
    """Commanded velocity divided by the position error, world axes."""
    tilt_max: Any = quantity("rad", above=0.0)
    """Largest tilt that the controllers command. It must be below pi/2."""
    acceleration_max: Any = quantity("m/s^2", (3,), above=0.0)
    """Largest commanded acceleration, world axes."""
    speed_max: Any = quantity("m/s", (3,), above=0.0)
    """Largest commanded velocity, world axes."""
    control_rate: Any = quantity("Hz", at_least=0.1)
    """Rate at which the policy is called."""
    latency: Any = quantity("s", at_least=0.0)
    """Time from the policy's observation to the arrival of its command at the rate loop."""
    feet_height: Any = quantity("m", above=0.0)
    """Height of the centre of mass above the feet."""
    radius: Any = quantity("m", above=0.0)
    """Radius of the sphere that encloses the vehicle, for collisions."""
    rotor_inertia: Any = _term("kg*m^2", at_least=0.0)
    """Moment of inertia about the rotor axis of one rotor, including everything that turns with it."""
    motor_time_constant_down: Any = _term("s", above=0.0)
    """Time constant of a rotor that slows down. `motor_time_constant` is then that of a rotor that speeds up."""
    centre_of_mass: Any = _term("m", (3,))
    """Centre of mass, in the same axes as `rotor_position`. The drag acts at the origin of these axes."""
    inertia_products: Any = _term("kg*m^2", (3,))
    """Entries xy, xz and yz of the inertia tensor, whose diagonal is `inertia`. Entry xy is minus the integral of x y
    dm."""
    drag_torque: Any = _term("N*m*s", (3,), at_least=0.0)
    """Torque with which the air resists rotation of the body, divided by body rate, per axis."""
    rate_integral_gain: Any = _term("1/s^2", (3,), at_least=0.0)
    """Commanded angular acceleration divided by the integral of the body-rate error."""
    gyro_time_constant: Any = _term("s", above=0.0)
    """Time constant of the first-order filter through which the rate loop reads the body rates."""
    nominal_voltage: Any = _term("V", above=0.0)
    """Voltage of the battery, under load, at which the rotors turn at their commanded speeds. The thrust limits hold at
    this voltage."""
    battery_voltage: Any = _term("V", above=0.0)
    """Voltage of the battery without load, in flight."""
    voltage_sag: Any = _term("V/N", at_least=0.0)
    """Voltage that the battery loses under load, divided by the thrust of all rotors. If left out: no loss."""
    speed_per_volt: Any = _term("1", at_least=0.0)
    """Relative change of rotor speed divided by relative change of voltage, at a given command. If left out: 1."""
    rotor_speed_ceiling: Any = _term("rad/s", (4,), above=0.0, per_rotor=())
    """Highest speed that each rotor really reaches, whatever the command, (N,). The flight controller does not know
    it."""
    rotor_axis: Any = _term("1", (4, 3), per_rotor=(3,))
    """Unit vector along which each rotor pushes, (N, 3). If left out, all push along body z."""
    inflow_loss: Any = _term("rad/m", at_least=0.0)
    """Share of its thrust that a rotor loses, divided by the ratio of axial inflow velocity to rotor speed."""
    mixer: str = field(default="", metadata={"static": True})
    """A `MixerRule`. Empty: `shift` with four rotors, `qp` with more."""

    @property
    def rotor_count(self) -> int:
        """Number of rotors, N."""
        return int(np.shape(self.rotor_spin)[-1])

    @property
    def mixer_rule(self) -> MixerRule:
        """The rule of the flight controller's mixer."""
        return cast(MixerRule, self.mixer) if self.mixer else _usual_mixer(self.rotor_count)

    @property
    def lift(self) -> Any:
        """Thrust along body z of rotors that each push by one newton, N. Level rotors: their number."""
        return self.rotor_count if self.rotor_axis is None else self.rotor_axis[..., 2].sum(-1)

    @property
    def hash(self) -> str:
        """First 16 hex digits of the SHA-256 of all values.

        Two vehicles fly alike if and only if their hashes are equal.
        """
        values: dict[str, Any] = {f.name: np.asarray(getattr(self, f.name), float).tolist() for f in quantities(self)}
        if self.mixer_rule != _usual_mixer(self.rotor_count):
            values["mixer"] = self.mixer_rule
        return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()[:16]

    def under(self, other: "Vehicle", *names: str) -> "Vehicle":
        """This body with the flight controller of another vehicle. If no `names` of fields are given, all of
        `CONTROLLED` are taken.
        """
        return dataclasses.replace(self, **{name: getattr(other, name) for name in names or CONTROLLED})

    @property
    def thrust_range(self) -> tuple[float, float]:
        """Smallest and largest thrust of one rotor, N: at idle speed, and at the tighter one of the two maxima."""
        low, high = (self.rotor_thrust(speed) for speed in (self.rotor_speed_min, self.rotor_speed_max))
        return float(low), float(min(high, self.rotor_thrust_max))

    @property
    def thrust_to_weight(self) -> float:
        """Largest collective thrust divided by weight."""
        return float(self.lift * self.thrust_range[1] / (self.mass * GRAVITY))

    @property
    def full_rotor_speed(self) -> float:
        """Largest speed of a rotor, rad/s, at which the tighter one of its two maxima applies."""
        k2, k1, k0 = self.thrust_map
        top = self.thrust_range[1]
        return float((-k1 + np.sqrt(k1**2 + 4 * k2 * (top - k0))) / (2 * k2))

    @property
    def hover_rotor_speed(self) -> float:
        """Rotor speed at which equal rotors carry the weight, rad/s."""
        k2, k1, k0 = self.thrust_map
        return float((-k1 + np.sqrt(k1**2 + 4 * k2 * (self.mass * GRAVITY / self.lift - k0))) / (2 * k2))

    def rotor_thrust(self, speed: float) -> float:
        """Thrust of one rotor, N, at a rotor speed, rad/s."""
        k2, k1, k0 = self.thrust_map
        return max(k2 * speed**2 + k1 * speed + k0, 0.0)


TIMED = ("control_rate", "latency")
"""Values of a vehicle file that describe the policy's computer and its link."""
RATE_LOOP = ("rate_gain", "rate_integral_gain", "gyro_time_constant")
"""Values of a vehicle file that describe the rate loop."""
CONTROLLED = (
    "body_rate_max", *RATE_LOOP, "attitude_gain", "velocity_gain", "position_gain", "tilt_max", "acceleration_max",
    "speed_max", *TIMED,
)  # fmt: skip
"""Values of a vehicle file that describe the flight controller, and the computer and link that send it commands. All
other values describe the body."""


@dataclass(frozen=True)
class Flown:
    """The vehicle that flies, and the vehicle for which its flight controller is tuned."""

    body: Vehicle
    """The vehicle that moves. Of its flight-controller values only those of the rate loop are used."""
    believed: Vehicle
    """The vehicle for which the flight controller is tuned: thrust per mass, inertia, mixer, gains, limits."""

    @staticmethod
    def of(own: Vehicle, flown: Vehicle, controller: str = "policy") -> "Flown":
        """Let another vehicle fly in place of the policy's own vehicle.

        Args:
            own: the vehicle that the policy was trained on. Control rate and latency stay its own.
            flown: the vehicle that flies.
            controller: `policy`: the flight controller stays that of `own`, and does not know the body that flies.
                `plant`: it is tuned to the vehicle that flies.

        Raises:
            ValueError: for another controller, and for a flight controller of a vehicle with another number of rotors.
        """
        if controller not in get_args(Controller):
            raise ValueError(f"--controller is {controller!r}; accepted: {' or '.join(get_args(Controller))}")
        if controller == "policy" and own.rotor_count != flown.rotor_count:
            raise ValueError(
                f"--controller is 'policy', and vehicle {flown.name!r} has {flown.rotor_count} rotors where the "
                f"flight controller of {own.name!r} drives {own.rotor_count}; accepted: 'plant', or a vehicle with "
                f"{own.rotor_count} rotors"
            )
        if controller == "policy":
            return Flown(flown.under(own), own)
        tuned = flown.under(own, *TIMED)
        return Flown(tuned, tuned)

    @property
    def as_believed(self) -> bool:
        """Whether the flight controller knows exactly what flies."""
        return self.body.hash == self.believed.hash


def quantities(vehicle: Vehicle | None = None) -> tuple[dataclasses.Field, ...]:
    """The fields with a unit that every vehicle has. If a vehicle is given: also its optional terms of the physics."""
    return tuple(
        f
        for f in dataclasses.fields(Vehicle)
        if "unit" in f.metadata and (f.default is not None or getattr(vehicle, f.name, None) is not None)
    )


def has_shape(f: dataclasses.Field, shape: tuple[int, ...]) -> bool:
    """Whether a value of this shape is one of this field, for any number of rotors."""
    if (components := f.metadata.get("per_rotor")) is None:
        return shape == f.metadata["shape"]
    if not shape or shape[0] not in ROTOR_COUNTS:
        return False
    return shape[1:] in [(size,) for size in components] if components else len(shape) == 1


def terms() -> tuple[dataclasses.Field, ...]:
    """The fields that a vehicle file may leave out.

    Each is a term of the physics, and None means that the term is absent.
    """
    return tuple(f for f in dataclasses.fields(Vehicle) if f.default is None)


def rotor_arms(vehicle: Vehicle) -> np.ndarray:
    """Positions of the rotors relative to the centre of mass, in the body's x-y plane, (N, 2), m."""
    return rotor_places(vehicle)[:, :2]


def rotor_places(vehicle: Vehicle) -> np.ndarray:
    """Positions of the rotors relative to the centre of mass, body axes, (N, 3), m."""
    given = np.asarray(vehicle.rotor_position, np.float64)
    places = np.pad(given, ((0, 0), (0, 3 - given.shape[1])))
    return places if vehicle.centre_of_mass is None else places - np.asarray(vehicle.centre_of_mass)


def rotor_axes(vehicle: Vehicle) -> np.ndarray:
    """Directions in which the rotors push, body axes, (N, 3)."""
    if vehicle.rotor_axis is None:
        return np.tile([0.0, 0.0, 1.0], (vehicle.rotor_count, 1))
    return np.asarray(vehicle.rotor_axis, np.float64)


def inertia_tensor(vehicle: Vehicle) -> np.ndarray:
    """Inertia about the centre of mass in body axes, (3, 3), kg*m^2."""
    tensor = np.diag(np.asarray(vehicle.inertia, np.float64))
    if vehicle.inertia_products is not None:
        tensor[(0, 0, 1), (1, 2, 2)] = tensor[(1, 2, 2), (0, 0, 1)] = vehicle.inertia_products
    return tensor


def principal_moments(vehicle: Vehicle) -> np.ndarray:
    """Principal moments of inertia in ascending order, (3,), kg*m^2."""
    if vehicle.inertia_products is None:
        return np.sort(vehicle.inertia)
    return np.linalg.eigvalsh(inertia_tensor(vehicle))


def allocation_matrix(vehicle: Vehicle) -> np.ndarray:
    """The 4xN matrix from rotor thrusts, N, to [thrust along body z, N; torque about body x, y, z, N*m].

    Torques are about the centre of mass.
    """
    return wrench_matrix(vehicle)[2:]


def wrench_matrix(vehicle: Vehicle) -> np.ndarray:
    """The 6xN matrix from rotor thrusts, N, to [force along body x, y, z, N; torque about body x, y, z, N*m].

    Torques are about the centre of mass.
    """
    axes = rotor_axes(vehicle)
    reaction = (np.asarray(vehicle.rotor_spin) * vehicle.torque_ratio)[:, None] * axes
    return np.concatenate([axes, np.cross(rotor_places(vehicle), axes) + reaction], axis=1).T


def _usual_mixer(rotor_count: int) -> MixerRule:
    return "shift" if rotor_count == 4 else "qp"

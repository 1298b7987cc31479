"""A vehicle in the form in which the physics sub-steps compute with it."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics.cable import Cable, Load
from e2efly.simulation.physics.state import split
from e2efly.vehicles.vehicle import Vehicle

Rotors = tuple[Array, ...]
"""One array for each rotor, each of the batch's shape."""


@dataclass(frozen=True)
class Tilt:
    """What rotors that do not all push along body z do, for each newton that a rotor pushes."""

    axis: tuple[Rotors, Rotors, Rotors]
    """Force along body x, y and z: the components of the directions in which the rotors push."""
    moment: tuple[Rotors, Rotors, Rotors]
    """Torque about body x, y and z, with the reaction torque, m."""

    @staticmethod
    def of(vehicle: Vehicle) -> "Tilt | None":
        """The tilt of a vehicle, any field of which may be batched. None if its file gives no axes of the rotors."""
        if vehicle.rotor_axis is None:
            return None
        places, axes = vehicle.rotor_position, vehicle.rotor_axis
        arm = [places[..., i] if i < places.shape[-1] else 0.0 * places[..., 0] for i in range(3)]
        if vehicle.centre_of_mass is not None:
            arm = [x - vehicle.centre_of_mass[..., i, None] for i, x in enumerate(arm)]
        arms, axis = Vec3(*arm), Vec3(*(axes[..., i] for i in range(3)))
        moment = arms.cross(axis) + axis * (vehicle.rotor_spin * jnp.asarray(vehicle.torque_ratio)[..., None])
        pushes, turns = (tuple(split(part) for part in (v.x, v.y, v.z)) for v in (axis, moment))
        return Tilt(pushes, turns)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Battery:
    """Effect of the battery on commanded rotor speeds. Voltages are divided by the nominal voltage."""

    voltage: Array
    """Voltage without load."""
    sag: Array | None
    """Voltage lost per newton of the thrust of all rotors, 1/N. None: no loss."""
    exponent: Array | None
    """Relative change of rotor speed divided by relative change of voltage. None: 1."""

    @staticmethod
    def of(vehicle: Vehicle) -> "Battery | None":
        """The battery of a vehicle, any field of which may be batched. None if the vehicle file has no battery."""
        if vehicle.battery_voltage is None:
            return None
        nominal, sag = vehicle.nominal_voltage, vehicle.voltage_sag
        return Battery(
            vehicle.battery_voltage / nominal, None if sag is None else sag / nominal, vehicle.speed_per_volt
        )


@dataclass(frozen=True)
class Airframe:
    """Parameters of the vehicle's motion, split into arrays of the batch's shape, with values derived from them.

    It is made once per control step. If every vehicle has its own parameters, most of a sub-step's time would otherwise
    go into picking them out of arrays with a component axis, into divisions and into exponentials. Constants stay
    constants.
    """

    thrust_map: tuple[Array, Array, Array]
    """Coefficients of squared rotor speed, of rotor speed, and the constant; N, s/rad."""
    arm_x: Rotors
    """Positions of the rotors relative to the centre of mass, body, m."""
    arm_y: Rotors
    spin: Rotors
    """Signs of the rotors' yaw torques."""
    torque_ratio: Array
    """Yaw torque divided by thrust, m."""
    specific: Array
    """One divided by the mass, 1/kg."""
    inertia: Vec3
    """Diagonal of the inertia tensor, kg*m^2."""
    mobility: Vec3
    """Diagonal of the inverse of the inertia tensor, 1/(kg*m^2)."""
    drag_linear: Vec3
    """Linear drag, N*s/m."""
    drag_quadratic: Vec3
    """Quadratic drag, N*s^2/m^2."""
    rotor_share: Rotors | None
    """Thrust of each rotor divided by the thrust from the thrust map. None: 1."""
    decay: Array | np.ndarray
    """Fraction of a rotor's difference to its command that remains after a sub-step."""
    half_decay: Array | np.ndarray
    """The same fraction after half a sub-step."""
    rotor_inertia: Array | None = None
    """Inertia of each rotor about its axis, kg*m^2. None, here and in the fields below: the physics has no such
    term."""
    lag_rate: Array | None = None
    """One divided by the time constant of the rotors, 1/s, if their acceleration is needed."""
    decay_down: Array | np.ndarray | None = None
    """`decay` of a rotor that slows down."""
    half_decay_down: Array | np.ndarray | None = None
    """`half_decay` of a rotor that slows down."""
    lag_rate_down: Array | None = None
    """`lag_rate` of a rotor that slows down."""
    drag_torque: Vec3 | None = None
    """Torque against rotation divided by body rate, N*m*s."""
    products: Vec3 | None = None
    """Entries xy, xz and yz of the inertia tensor, kg*m^2."""
    mobility_products: Vec3 | None = None
    """Entries xy, xz and yz of the inverse of the inertia tensor, 1/(kg*m^2)."""
    battery: Battery | None = None
    centre: Vec3 | None = None
    """Centre of mass relative to the point where the drag acts, body, m."""
    ceiling: Rotors | None = None
    """Highest speed that each rotor reaches, rad/s."""
    tilt: Tilt | None = None
    """Directions of the rotors. None: all push along body z."""
    inflow_loss: Array | None = None
    """Share of the thrust that is lost, divided by the ratio of axial inflow velocity to rotor speed, rad/m."""
    push: tuple[Array, Array] | None = None
    """Acceleration by a force from outside, world, x and y, m/s^2."""
    cable: Cable | None = None
    """The cable of the load that hangs from the vehicle."""

    @staticmethod
    def of(
        vehicle: Vehicle,
        dt: float,
        rotor_share: Array | None = None,
        push: Array | None = None,
        load: Load | None = None,
    ) -> "Airframe":
        """The plant of a vehicle, any field of which may be batched.

        Sub-steps take `dt` seconds, `rotor_share` is (*n, r), and `push` (*n, 2). The load hangs from the vehicle.
        """
        v, time, down = vehicle, vehicle.motor_time_constant, vehicle.motor_time_constant_down
        k2, k1, k0 = (v.thrust_map[..., i] for i in range(3))
        x, y = v.rotor_position[..., 0], v.rotor_position[..., 1]
        if v.centre_of_mass is not None:
            x, y = x - v.centre_of_mass[..., 0, None], y - v.centre_of_mass[..., 1, None]
        inertia, products = Vec3.of(v.inertia), None if v.inertia_products is None else Vec3.of(v.inertia_products)
        mobility, mobility_products = Vec3.of(1 / v.inertia), None
        if products is not None:
            mobility, mobility_products = _inverse(inertia, products)
        return Airframe(
            thrust_map=(k2, k1, k0),
            arm_x=split(x),
            arm_y=split(y),
            spin=split(v.rotor_spin),
            torque_ratio=v.torque_ratio,
            specific=1 / v.mass,
            inertia=inertia,
            mobility=mobility,
            drag_linear=Vec3.of(v.drag_linear),
            drag_quadratic=Vec3.of(v.drag_quadratic),
            rotor_share=None if rotor_share is None else split(rotor_share),
            decay=_exp(-dt / time),
            half_decay=_exp(-0.5 * dt / time),
            rotor_inertia=v.rotor_inertia,
            lag_rate=None if v.rotor_inertia is None else 1 / time,
            decay_down=None if down is None else _exp(-dt / down),
            half_decay_down=None if down is None else _exp(-0.5 * dt / down),
            lag_rate_down=None if v.rotor_inertia is None or down is None else 1 / down,
            drag_torque=None if v.drag_torque is None else Vec3.of(v.drag_torque),
            battery=Battery.of(v),
            products=products,
            mobility_products=mobility_products,
            centre=None if v.centre_of_mass is None else Vec3.of(v.centre_of_mass),
            ceiling=None if v.rotor_speed_ceiling is None else split(v.rotor_speed_ceiling),
            tilt=Tilt.of(v),
            inflow_loss=v.inflow_loss,
            push=None if push is None else (push[..., 0], push[..., 1]),
            cable=None if load is None else Cable.of(load, v, dt),
        )


def _inverse(diagonal: Vec3, products: Vec3) -> tuple[Vec3, Vec3]:
    """Diagonal and entries xy, xz and yz of the inverse of a symmetric tensor, from the same entries of the tensor."""
    a, b, c, xy, xz, yz = diagonal.x, diagonal.y, diagonal.z, products.x, products.y, products.z
    bc, ac, ab = b * c - yz * yz, a * c - xz * xz, a * b - xy * xy
    x, y, z = xz * yz - xy * c, xy * yz - b * xz, xy * xz - a * yz
    whole = 1 / (a * bc + xy * x + xz * y)
    return Vec3(bc, ac, ab) * whole, Vec3(x, y, z) * whole


def _exp(x: Array | np.ndarray) -> Array | np.ndarray:
    """Exponential that keeps NumPy constants as constants."""
    return jnp.exp(x) if isinstance(x, jax.Array) else np.exp(x)

"""The rigid body: its forces and torques, and the resulting accelerations (paper, Quadrotor Dynamics)."""

import operator
from functools import reduce

import jax
import jax.numpy as jnp
from jax import Array

from e2efly.control.vectors import Quat, Vec3
from e2efly.simulation.physics.airframe import Airframe, Rotors
from e2efly.simulation.physics.cable import Hanging
from e2efly.simulation.physics.state import Parts
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle, quantities, terms
from e2efly.vehicles.vehicle_rules import LEAST_VOLTAGE

SLOWEST = 1.0
"""Rotor speed below which the loss of thrust by inflow grows no more, rad/s: such a rotor hardly pushes."""

jax.tree_util.register_dataclass(
    Vehicle, data_fields=[f.name for f in (*quantities(), *terms())], meta_fields=["name", "mixer"]
)


def rotor_thrust(plant: Airframe, rotor_speed: Rotors) -> Rotors:
    """Thrust of each rotor, N: the quadratic thrust map, never negative, times the rotor's share."""
    k2, k1, k0 = plant.thrust_map
    thrust = tuple(jnp.maximum((k2 * w + k1) * w + k0, 0.0) for w in rotor_speed)
    if plant.rotor_share is None:
        return thrust
    return tuple(f * share for f, share in zip(thrust, plant.rotor_share, strict=True))


def met(plant: Airframe, thrust: Rotors, parts: Parts, wind: Vec3 | None) -> Rotors:
    """Thrust of each rotor in the air that it meets, N, from that in still air, if the plant has an `inflow_loss`.

    A rotor that moves along its axis against the air at v m/s and turns at W rad/s keeps the share 1 - `inflow_loss`
    v / W, never less than nothing. The turning of the body moves its rotors, too; heights of rotors are not counted.
    """
    if plant.inflow_loss is None:
        return thrust
    air, rate = air_velocity(parts.attitude, parts.velocity, wind), parts.body_rate
    axes = None if plant.tilt is None else zip(*plant.tilt.axis, strict=True)
    moving = [air + rate.cross(Vec3(x, y, 0.0 * x)) for x, y in zip(plant.arm_x, plant.arm_y, strict=True)]
    inflow = [v.z for v in moving] if axes is None else [v.dot(Vec3(*a)) for v, a in zip(moving, axes, strict=True)]
    return tuple(
        f * jnp.maximum(1.0 - plant.inflow_loss * v / jnp.maximum(w, SLOWEST), 0.0)
        for f, v, w in zip(thrust, inflow, parts.rotor_speed, strict=True)
    )


def reached(plant: Airframe, rotor_speed: Rotors, command: Rotors) -> Rotors:
    """Speeds, rad/s, that rotors approach under speed commands.

    The battery's voltage is that under their present thrust. No rotor passes its ceiling.
    """
    battery = plant.battery
    if battery is not None:
        voltage = battery.voltage
        if battery.sag is not None:
            voltage = jnp.maximum(voltage - battery.sag * total(rotor_thrust(plant, rotor_speed)), LEAST_VOLTAGE)
        share = voltage if battery.exponent is None else voltage**battery.exponent
        command = tuple(share * speed for speed in command)
    if plant.ceiling is None:
        return command
    return tuple(jnp.minimum(speed, most) for speed, most in zip(command, plant.ceiling, strict=True))


def rotor_speed_for(vehicle: Vehicle, thrust: Rotors) -> Rotors:
    """The rotor speed, rad/s, that gives each thrust, N (at or above the idle thrust)."""
    k2, k1, k0 = (vehicle.thrust_map[..., i] for i in range(3))
    half, scale = k1 / (2 * k2), 1 / k2
    return tuple(jnp.sqrt(half**2 + (f - k0) * scale) - half for f in thrust)


def hover_rotor_speed(vehicle: Vehicle) -> Array:
    """The speed, rad/s, at which equal rotors carry the weight."""
    return rotor_speed_for(vehicle, (vehicle.mass * GRAVITY / vehicle.lift,))[0]


def rotor_wrench(plant: Airframe, thrust: Rotors) -> tuple[Array, Vec3]:
    """Collective thrust along body z, N, and torque about the body axes, N*m, from rotor arms and reaction torques."""
    if plant.tilt is not None:
        x, y, z = (_weighted(moment, thrust) for moment in plant.tilt.moment)
        return _weighted(plant.tilt.axis[2], thrust), Vec3(x, y, z)
    roll, pitch = _weighted(plant.arm_y, thrust), -_weighted(plant.arm_x, thrust)
    return total(thrust), Vec3(roll, pitch, plant.torque_ratio * _weighted(plant.spin, thrust))


def sideways(plant: Airframe, thrust: Rotors) -> tuple[Array, Array] | None:
    """Force of tilted rotors along body x and y, N. None: all rotors push along body z."""
    if plant.tilt is None:
        return None
    return _weighted(plant.tilt.axis[0], thrust), _weighted(plant.tilt.axis[1], thrust)


def drag(plant: Airframe, air_velocity: Vec3) -> Vec3:
    """Drag in the body frame, N: -(k1 v + k2 v |v|) per axis of the body-frame air-relative velocity, m/s.

    The paper writes k v v, which has no sign and pushes a vehicle that flies backwards.
    """
    k1, k2 = plant.drag_linear, plant.drag_quadratic
    return air_velocity.times(k1 + air_velocity.abs().times(k2)) * -1.0


def air_velocity(attitude: Quat, velocity: Vec3, wind: Vec3 | None) -> Vec3:
    """Velocity relative to the air, body frame, m/s, from a velocity and a wind in the world frame, m/s."""
    return attitude.unrotate(velocity if wind is None else velocity - wind)


def acceleration(plant: Airframe, attitude: Quat, force: Vec3, collective: Array) -> Vec3:
    """Acceleration of the centre of mass, world, m/s^2, from the collective thrust, N, and all other force, body, N:
    the drag, and what tilted rotors push sideways.
    """
    a = attitude.rotate(Vec3(force.x, force.y, force.z + collective)) * plant.specific
    if plant.push is None:
        return Vec3(a.x, a.y, a.z - GRAVITY)
    x, y = plant.push
    return Vec3(a.x + x, a.y + y, a.z - GRAVITY)


def angular_acceleration(plant: Airframe, body_rate: Vec3, torque: Vec3) -> Vec3:
    """Euler's equation in the body frame, rad/s^2: J^-1 (torque - w x J w)."""
    left = torque - gyroscopic_torque(plant.inertia, body_rate, plant.products)
    return tensor_times(plant.mobility, plant.mobility_products, left)


def tensor_times(diagonal: Vec3, products: Vec3 | None, v: Vec3) -> Vec3:
    """Product of a symmetric tensor and a vector. `products` are the tensor's entries xy, xz and yz (None: zero)."""
    if products is None:
        return v.times(diagonal)
    d, o = diagonal, products
    return Vec3(
        d.x * v.x + o.x * v.y + o.y * v.z, o.x * v.x + d.y * v.y + o.z * v.z, o.y * v.x + o.z * v.y + d.z * v.z
    )  # fmt: skip


def gyroscopic_torque(inertia: Vec3, body_rate: Vec3, products: Vec3 | None = None) -> Vec3:
    """Gyroscopic torque w x J w, N*m. J is given by its diagonal and its entries xy, xz and yz (None: zero)."""
    j, w = inertia, body_rate
    if products is not None:
        return w.cross(tensor_times(inertia, products, w))
    return Vec3((j.z - j.y) * w.y * w.z, (j.x - j.z) * w.z * w.x, (j.y - j.x) * w.x * w.y)


def rotor_momentum_torque(
    inertia: Array,
    spin: Rotors,
    body_rate: Vec3,
    rotor_speed: Rotors,
    rotor_acceleration: Rotors,
    axis: tuple[Rotors, Rotors, Rotors] | None = None,
) -> Vec3:
    """Torque on the body from the angular momentum h of its rotors about their axes, N*m: -(dh/dt + w x h).

    A rotor turns against the air's torque on it, so h = -inertia * sum(spin * speed * axis). The body's own inertia
    includes the rotors as if they stood still, so that body and rotors together keep their angular momentum. `inertia`
    is that of one rotor, kg*m^2. Accelerations are in rad/s^2. `axis` None: all rotors turn about body z.
    """
    if axis is not None:
        turns = [tuple(s * a for s, a in zip(spin, along, strict=True)) for along in axis]
        momenta, changes = (Vec3(*(_weighted(turn, x) for turn in turns)) for x in (rotor_speed, rotor_acceleration))
        return (changes + body_rate.cross(momenta)) * inertia
    momentum = -inertia * _weighted(spin, rotor_speed)
    change = -inertia * _weighted(spin, rotor_acceleration)
    return Vec3(-body_rate.y * momentum, body_rate.x * momentum, -change)


def accelerations(
    plant: Airframe, parts: Parts, wind: Vec3 | None, rotor_acceleration: Rotors | None = None, pull: Vec3 | None = None
) -> tuple[Vec3, Vec3]:
    """Acceleration of the centre of mass in the world, m/s^2, and angular acceleration about the body axes, rad/s^2.

    The wind is the velocity of the air in the world, m/s. Accelerations of the rotors, rad/s^2, are required if the
    plant has rotor inertia. The pull is that of the cable (`pulled`), world, N.
    """
    thrust, tilt = met(plant, rotor_thrust(plant, parts.rotor_speed), parts, wind), plant.tilt
    collective, torque = rotor_wrench(plant, thrust)
    if plant.rotor_inertia is not None and rotor_acceleration is not None:
        torque = torque + rotor_momentum_torque(
            plant.rotor_inertia,
            plant.spin,
            parts.body_rate,
            parts.rotor_speed,
            rotor_acceleration,
            None if tilt is None else tilt.axis,
        )
    air = air_velocity(parts.attitude, parts.velocity, wind)
    if plant.centre is not None:  # the point at which the drag acts moves around the centre of mass
        air = air + plant.centre.cross(parts.body_rate)
    force = drag(plant, air)
    if plant.centre is not None:
        torque = torque + force.cross(plant.centre)
    if plant.drag_torque is not None:
        torque = torque - plant.drag_torque.times(parts.body_rate)
    if (beside := sideways(plant, thrust)) is not None:
        force = Vec3(force.x + beside[0], force.y + beside[1], force.z)
    if plant.cable is not None and pull is not None:
        turned = parts.attitude.unrotate(pull)
        force, torque = force + turned, torque + plant.cable.torque(turned)
    linear = acceleration(plant, parts.attitude, force, collective)
    return linear, angular_acceleration(plant, parts.body_rate, torque)


def pulled(plant: Airframe, parts: Parts) -> Vec3 | None:
    """Force of the cable on the vehicle, world, N. None: no load hangs from it."""
    if plant.cable is None or parts.load is None:
        return None
    return plant.cable.pull(parts.attitude, parts.position, parts.velocity, parts.body_rate, parts.load)


def derivative(plant: Airframe, parts: Parts, wind: Vec3 | None, rotor_acceleration: Rotors | None = None) -> Parts:
    """Time derivative of the body's state. Arguments are as for `accelerations`.

    The entry of the rotor speeds is zero.
    """
    pull = pulled(plant, parts)
    linear, angular = accelerations(plant, parts, wind, rotor_acceleration, pull)
    load = None
    if plant.cable is not None and parts.load is not None and pull is not None:
        load = Hanging(parts.load.velocity, plant.cable.falling(pull))
    zero = jnp.zeros_like(linear.z)
    return Parts(
        position=parts.velocity,
        velocity=linear,
        attitude=parts.attitude.derivative(parts.body_rate),
        body_rate=angular,
        rotor_speed=(zero,) * len(parts.rotor_speed),
        load=load,
    )


def total(rotors: Rotors) -> Array:
    """The sum over all rotors."""
    return reduce(operator.add, rotors)


def _weighted(a: Rotors, b: Rotors) -> Array:
    return reduce(operator.add, (x * y for x, y in zip(a, b, strict=True)))

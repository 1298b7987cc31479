"""The terms of the physics against MuJoCo, which is given the bodies themselves and none of our formulas."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics import INTEGRATORS, State
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import derivative, rotor_speed_for
from e2efly.simulation.physics.state import Parts, split
from e2efly.vehicles.payload import with_payload
from e2efly.vehicles.vehicle import Vehicle

pytestmark = pytest.mark.usefixtures("x64")

STEP = 2e-4


def world(body: str, rest: str = "") -> tuple[mujoco.MjModel, mujoco.MjData]:
    """A free body in empty space."""
    model = mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <compiler inertiafromgeom="false"/>
      <option timestep="{STEP}" integrator="RK4" gravity="0 0 -9.81" density="0" viscosity="0">
        <flag contact="disable"/>
      </option>
      <worldbody><body name="vehicle"><freejoint/>{body}</body></worldbody>
      {rest}
    </mujoco>""")
    return model, mujoco.MjData(model)


def test_rotors_that_are_bodies_of_their_own(stone: Vehicle, random_state: Callable[..., State]) -> None:
    """Four wheels on hinges, driven against the frame: how they speed up is MuJoCo's, and so is how the frame turns."""
    vehicle = dataclasses.replace(stone, rotor_inertia=1.5e-5)
    rotors, across, light = "", 8e-6, 1e-4
    for i, (x, y) in enumerate(vehicle.rotor_position):
        rotors += (
            f'<body pos="{x} {y} 0"><joint name="hinge_{i}" type="hinge" axis="0 0 1"/>'
            f'<inertial pos="0 0 0" mass="{light}" diaginertia="{across} {across} {vehicle.rotor_inertia}"/></body>'
        )
    x, y = vehicle.rotor_position.T
    of_rotors = np.array([np.sum(across + light * y**2), np.sum(across + light * x**2), 0.0])
    of_rotors[2] = np.sum(vehicle.rotor_inertia + light * (x**2 + y**2))
    frame = " ".join(map(str, vehicle.inertia - of_rotors))
    mass = vehicle.mass - 4 * light
    model, data = world(f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{frame}"/>{rotors}')
    start, rng = random_state(7), np.random.default_rng(7)
    turns = -vehicle.rotor_spin  # against the reaction torque
    data.qpos[3:7] = start.quaternion
    data.qvel[3:6] = start.body_rate
    data.qvel[6:] = turns * np.array([1500.0, 2000.0, 2500.0, 1800.0])
    rates, speeds, pushes = [], [], []
    for push in rng.uniform(-0.15, 0.15, (10, 4)).repeat(100, 0):
        data.qfrc_applied[6:] = push
        mujoco.mj_forward(model, data)
        rates.append(data.qvel[3:6].copy())
        speeds.append(turns * data.qvel[6:])
        pushes.append(turns * data.qacc[6:])
        mujoco.mj_step(model, data)
    rates, speeds, pushes = np.array(rates), np.array(speeds), np.array(pushes)
    assert np.ptp(speeds, axis=0).min() > 250
    assert np.ptp(rates, axis=0).min() > 1

    plant = Airframe.of(vehicle, STEP)
    quiet = Parts.of(dataclasses.replace(start, velocity=jnp.zeros(3), position=jnp.zeros(3)))

    def one(rate: jax.Array, driven: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        (speed, change), h = driven, STEP

        def slope(rate: jax.Array, at: float) -> jax.Array:
            turning = split(speed + at * change)
            parts = dataclasses.replace(quiet, body_rate=Vec3.of(rate), rotor_speed=turning)
            return derivative(plant, parts, None, split(change)).body_rate.stack()

        a = slope(rate, 0.0)
        b = slope(rate + a * h / 2, h / 2)
        return rate + (a + 4 * b + slope(rate + (2 * b - a) * h, h)) * h / 6, rate

    ours = jax.lax.scan(one, jnp.asarray(rates[0]), (jnp.asarray(speeds), jnp.asarray(pushes)))[1]
    np.testing.assert_allclose(ours, rates, atol=3e-6)


def test_an_inertial_frame_that_is_not_the_bodys(vis_r: Vehicle, random_state: Callable[..., State]) -> None:
    """MuJoCo is told where the centre of mass is, a full inertia, and that rotors and drag act at other places."""
    away, products = np.array([0.004, -0.006, 0.03]), np.array([1e-4, -2e-4, 5e-5])
    vehicle = dataclasses.replace(vis_r, centre_of_mass=away, inertia_products=products, drag_quadratic=np.zeros(3))
    thrust = np.array([1.7, 1.9, 2.1, 1.8])
    sites, actuators = '<site name="origin"/>', ""
    for i, (x, y) in enumerate(vehicle.rotor_position):
        sites += f'<site name="rotor_{i}" pos="{x} {y} 0"/>'
        gear = f"0 0 1 0 0 {vehicle.rotor_spin[i] * vehicle.torque_ratio}"
        actuators += f'<general site="rotor_{i}" gear="{gear}" biastype="affine" biasprm="{thrust[i]} 0 0"/>'
    for gear, k in zip(("1 0 0", "0 1 0", "0 0 1"), vehicle.drag_linear, strict=True):
        actuators += (
            f'<general site="origin" gear="{gear} 0 0 0" gainprm="0" biastype="affine" biasprm="0 0 {-20 * k}"/>'
        )
    place, moments = (" ".join(map(str, x)) for x in (away, [*vehicle.inertia, *products]))
    model, data = world(
        f'<inertial pos="{place}" mass="{vehicle.mass}" fullinertia="{moments}"/>{sites}',
        f"<actuator>{actuators}</actuator>",
    )
    vehicle = dataclasses.replace(vehicle, drag_linear=20 * vehicle.drag_linear)  # strong, to be seen
    start = random_state(8)
    end, turn = both_flown(model, data, vehicle, start, away, thrust)
    np.testing.assert_allclose(end.position, data.qpos[:3] + turn.apply(away), atol=1e-7)
    np.testing.assert_allclose(end.velocity, data.qvel[:3] + turn.apply(np.cross(data.qvel[3:], away)), atol=1e-6)
    np.testing.assert_allclose(end.body_rate, data.qvel[3:], atol=1e-6)


def test_a_payload_that_is_fixed(vacuum: Vehicle, random_state: Callable[..., State]) -> None:
    """MuJoCo is told of two bodies that are welded together, and puts them together itself."""
    mass, place, thrust = 0.25, np.array([0.02, -0.01, -0.06]), np.array([2.4, 2.6, 2.7, 2.5])
    sites, actuators = "", ""
    for i, (x, y) in enumerate(vacuum.rotor_position):
        sites += f'<site name="rotor_{i}" pos="{x} {y} 0"/>'
        gear = f"0 0 1 0 0 {vacuum.rotor_spin[i] * vacuum.torque_ratio}"
        actuators += f'<general site="rotor_{i}" gear="{gear}" biastype="affine" biasprm="{thrust[i]} 0 0"/>'
    there, moments = (" ".join(map(str, x)) for x in (place, vacuum.inertia))
    model, data = world(
        f'<inertial pos="0 0 0" mass="{vacuum.mass}" diaginertia="{moments}"/>{sites}'
        f'<body pos="{there}"><inertial pos="0 0 0" mass="{mass}" diaginertia="1e-12 1e-12 1e-12"/></body>',
        f"<actuator>{actuators}</actuator>",
    )
    vehicle, start = with_payload(vacuum, mass, place), random_state(9)
    away = vehicle.centre_of_mass
    end, turn = both_flown(model, data, vehicle, start, away, thrust)
    np.testing.assert_allclose(end.position, data.qpos[:3] + turn.apply(away), atol=1e-7)
    np.testing.assert_allclose(end.body_rate, data.qvel[3:], atol=1e-6)


def both_flown(
    model: Any, data: Any, vehicle: Vehicle, start: State, away: np.ndarray, thrust: np.ndarray
) -> tuple[State, Rotation]:
    """Fly 2000 steps in MuJoCo, whose body's origin is `away` from the centre of mass, and in our physics.

    Returns:
        Our state at the end, and MuJoCo's attitude. Its other figures are in `data`.
    """
    turn = Rotation.from_quat(np.array(start.quaternion), scalar_first=True)
    data.qpos[:3] = start.position - turn.apply(away)
    data.qpos[3:] = start.quaternion
    data.qvel[:3] = start.velocity - turn.apply(np.cross(start.body_rate, away))
    data.qvel[3:] = start.body_rate
    for _ in range(2000):
        mujoco.mj_step(model, data)
    speed = rotor_speed_for(vehicle, split(jnp.asarray(thrust)))
    end = flown(vehicle, dataclasses.replace(start, rotor_speed=jnp.stack(speed)), 2000)
    return end, Rotation.from_quat(data.qpos[3:], scalar_first=True)


def flown(vehicle: Vehicle, start: State, steps: int) -> State:
    """Our physics at constant rotor speeds."""
    plant, speed = Airframe.of(vehicle, STEP), split(start.rotor_speed)
    one = lambda _, parts: INTEGRATORS["rk4"](plant, parts, speed, None, STEP)  # noqa: E731
    return jax.lax.fori_loop(0, steps, one, Parts.of(start)).join()

"""The same vehicle in MuJoCo: an independent engine, driven by the same rotor thrusts."""

import dataclasses
from collections.abc import Callable

import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from e2efly.simulation.physics import Physics, State
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

STEP = 1e-3
SECONDS = 2.0


def model_of(vehicle: Vehicle) -> mujoco.MjModel:
    """A free body with the vehicle's mass and inertia, and a thruster with reaction torque at each rotor."""
    sites = "".join(f'<site name="r{i}" pos="{x} {y} 0"/>' for i, (x, y) in enumerate(vehicle.rotor_position))
    thrusters = "".join(
        f'<general site="r{i}" gear="0 0 1 0 0 {spin * vehicle.torque_ratio}"/>'
        for i, spin in enumerate(vehicle.rotor_spin)
    )
    inertia = " ".join(map(str, vehicle.inertia))
    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="{STEP}" integrator="RK4" gravity="0 0 -9.81" density="0" viscosity="0">
        <flag contact="disable"/>
      </option>
      <worldbody>
        <body>
          <freejoint/>
          <inertial pos="0 0 0" mass="{vehicle.mass}" diaginertia="{inertia}"/>
          {sites}
        </body>
      </worldbody>
      <actuator>{thrusters}</actuator>
    </mujoco>""")


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("name", ["vis_r", "vis_h"])
def test_two_seconds_agree_with_mujoco(name: str, fly: Callable[..., State]) -> None:
    vehicle = load_vehicle(name)
    vehicle = dataclasses.replace(vehicle, drag_linear=np.zeros(3), drag_quadratic=np.zeros(3))
    physics = Physics.of(vehicle, "rotor_thrust", "rk4", 1 / STEP, dtype=np.float64)
    assert physics.substeps == 1
    rng, steps = np.random.default_rng(1), round(SECONDS / STEP)
    q = rng.normal(size=4)
    start = State(
        position=jnp.asarray(rng.normal(size=3)),
        velocity=jnp.asarray(rng.normal(size=3)),
        quaternion=jnp.asarray(q / np.linalg.norm(q)),
        body_rate=jnp.asarray(3 * rng.normal(size=3)),
        rotor_speed=jnp.asarray(vehicle.hover_rotor_speed * rng.uniform(0.9, 1.1, 4)),
    )
    # a new command every 50 ms, near hover thrust
    each = vehicle.mass * 9.81 / 4
    thrusts = np.repeat(each * rng.uniform(0.9, 1.1, (steps // 50, 4)), 50, axis=0)
    ours = fly(physics, vehicle, start, jnp.asarray(thrusts))

    # what each rotor pushes, by the lag's closed form: MuJoCo gets the mean over each step (Simpson)
    k2, k1, k0 = vehicle.thrust_map
    wanted = (-k1 + np.sqrt(k1**2 + 4 * k2 * (thrusts - k0))) / (2 * k2)
    speed, pushes = np.asarray(start.rotor_speed), []
    for goal in wanted:
        speeds = [goal + (speed - goal) * np.exp(-t / vehicle.motor_time_constant) for t in (0, STEP / 2, STEP)]
        begin, middle, end = ((k2 * w + k1) * w + k0 for w in speeds)
        pushes.append((begin + 4 * middle + end) / 6)
        speed = speeds[2]

    model = model_of(vehicle)
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate([start.position, start.quaternion])
    data.qvel[:] = np.concatenate([start.velocity, start.body_rate])
    theirs = []
    for push in pushes:
        data.ctrl[:] = push
        mujoco.mj_step(model, data)
        theirs.append(np.concatenate([data.qpos, data.qvel]))
    theirs = np.array(theirs)

    assert np.max(np.linalg.norm(theirs[:, 10:], axis=-1)) > 3  # it tumbles
    np.testing.assert_allclose(ours.position, theirs[:, :3], atol=1e-5)
    np.testing.assert_allclose(ours.velocity, theirs[:, 7:10], atol=1e-4)
    np.testing.assert_allclose(ours.quaternion, theirs[:, 3:7], atol=1e-4)
    np.testing.assert_allclose(ours.body_rate, theirs[:, 10:], atol=1e-4)
    np.testing.assert_allclose(ours.rotor_speed[-1], speed, rtol=1e-10)
